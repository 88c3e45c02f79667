//! Controller and simulated arm in this process, with the interface of a connection to a running system: the simulation
//! runs, cycle by cycle, while a caller waits.

use crate::arm::Arm;
use crate::errors;
use crate::live::{code, columns};
use crate::plant_options::PlantEffects;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use supple_core::codes::RequestCode;
use supple_core::controller::{CycleRecord, NamesJoints, Refusal, Request, SetPoint, check_motion};
use supple_core::math::Vector3;
use supple_core::{Controller, Trajectory, Vector};
use supple_experiment::{ExperimentError, Mismatch, Rig, Setup, Variant, scenario, start_pose};
use supple_ipc::message::{ArmState, CycleTiming, Drives, PlantReport, Telemetry};
use supple_model::{Description, with_dof};
use supple_plant::Scene;

/// Number of cycles that are kept.
const HISTORY: usize = 8192;
/// Number of cycles between two checks for signals.
const SIGNAL_CHECK: u32 = 1000;
/// Time in gravity hold before the first request \[s\].
const SETTLE_S: f64 = 0.2;

/// Options of a simulated system; the package checks them and fills in defaults.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Options {
    start_rad: Option<Vec<f64>>,
    stiffness_n_per_m: f64,
    gravity_error: f64,
    friction_error: f64,
    block: bool,
    seed: u64,
    plant_options: PlantEffects,
}

/// A completed cycle, and the reason if its request was refused.
struct Done {
    telemetry: Telemetry,
    mode: &'static str,
    refusal: Option<String>,
}

/// A system of any number of joints.
trait Cycles: Send {
    fn cycle(&mut self, request: Option<&RequestCode>) -> Result<Done, String>;
}

struct SizedSystem<const N: usize> {
    rig: Rig<N>,
    steps: u64,
    period_s: f64,
    position_rad: Vector<N>,
}

impl<const N: usize> Cycles for SizedSystem<N> {
    fn cycle(&mut self, request: Option<&RequestCode>) -> Result<Done, String> {
        let request = match request {
            Some(code) => code.request::<N>().map_err(|error| error.to_string())?,
            None => None,
        };
        let names = self.rig.controller().config().joint_names;
        let named = |refusal: &Refusal| refusal.with_names(names.as_slice()).to_string();
        // The helper thread of supple-rt does the same before it passes the request to the loop.
        let checked = request.as_ref().map_or(Ok(()), |request| {
            check_motion(self.rig.controller(), &self.position_rad, request)
        });
        let (request, unchecked) = match checked {
            Ok(()) => (request, None),
            Err(refusal) => (None, Some(named(&refusal))),
        };
        let cycle = self.rig.cycle(request);
        let record = CycleRecord::new(self.steps, &cycle.input, &cycle.output)
            .with_joint_names(&cycle.output, &names);
        let state = ArmState::new(
            cycle.input.cycle,
            (cycle.input.cycle as f64 * self.period_s * 1e9) as u64,
            &cycle.input.position_rad,
            cycle.input.tip_force_n,
            match cycle.input.drives_active {
                true => Drives::Active,
                false => Drives::Idle,
            },
            PlantReport::default(),
        );
        self.steps += 1;
        self.position_rad = cycle.output.position_rad;
        let refused = cycle.output.refusal.as_ref().map(named);
        Ok(Done {
            telemetry: Telemetry::of(&record, &state, CycleTiming::default()),
            mode: cycle.output.mode.name(),
            refusal: unchecked.or(refused),
        })
    }
}

struct Running {
    system: Box<dyn Cycles>,
    history: VecDeque<Telemetry>,
    dropped: u64,
    set_point: Option<RequestCode>,
    refused_set_point: Option<String>,
}

impl Running {
    fn received(&self) -> u64 {
        self.dropped + self.history.len() as u64
    }

    fn cycle_number(&self) -> u64 {
        self.history.back().map_or(0, |last| last.state.cycle)
    }

    fn run(&mut self, request: Option<&RequestCode>) -> PyResult<Done> {
        let set_point = match request {
            None => self.set_point.take(),
            Some(_) => None,
        };
        let is_set_point = set_point.is_some();
        let done = self.system.cycle(request.or(set_point.as_ref()));
        let done = done.map_err(PyValueError::new_err)?;
        if is_set_point && done.refusal.is_some() {
            self.refused_set_point.clone_from(&done.refusal);
        }
        if self.history.len() == HISTORY {
            self.history.pop_front();
            self.dropped += 1;
        }
        self.history.push_back(done.telemetry);
        Ok(done)
    }
}

/// A simulated system in this process, with the methods of `Connection`.
#[pyclass(frozen, module = "supple._native")]
pub struct Simulation {
    dof: usize,
    period_s: f64,
    running: Mutex<Running>,
}

#[pymethods]
impl Simulation {
    #[new]
    fn new(
        py: Python<'_>,
        arm: &Arm,
        model: Option<&Arm>,
        options: Options,
    ) -> PyResult<Simulation> {
        options.plant_options.check()?;
        let plant = arm.for_controller(py)?;
        let model = model.map(|model| model.for_controller(py)).transpose()?;
        let built = py.detach(|| {
            with_dof!(plant.dof(), N => sized::<N>(plant, model, &options))
                .map_err(ExperimentError::from)
                .flatten()
        });
        let (system, period_s) = built.map_err(errors::experiment)?;
        let simulation = Simulation {
            dof: plant.dof(),
            period_s,
            running: Mutex::new(Running {
                system,
                history: VecDeque::new(),
                dropped: 0,
                set_point: None,
                refused_set_point: None,
            }),
        };
        simulation.request(py, "gravity_hold", Vec::new(), None, None)?;
        simulation.wait(py, (SETTLE_S / period_s) as u64, 0.0)?;
        Ok(simulation)
    }

    #[getter]
    fn prefix(&self) -> &'static str {
        "simulated"
    }

    #[getter]
    fn dof(&self) -> usize {
        self.dof
    }

    #[getter]
    fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Number of the last cycle.
    fn cycle(&self) -> u64 {
        self.lock().cycle_number()
    }

    /// Cycles so far.
    fn received(&self) -> u64 {
        self.lock().received()
    }

    /// None is ever lost.
    fn lost(&self) -> u64 {
        0
    }

    /// It never ends by itself.
    fn ended(&self) -> Option<String> {
        None
    }

    /// Runs until more than `received` cycles are done. Signals such as Ctrl-C end it.
    fn wait(&self, py: Python<'_>, received: u64, timeout_s: f64) -> PyResult<bool> {
        let _ = timeout_s;
        loop {
            let is_done = py.detach(|| {
                let mut running = self.lock();
                for _ in 0..SIGNAL_CHECK {
                    if running.received() > received {
                        return PyResult::Ok(true);
                    }
                    running.run(None)?;
                }
                Ok(false)
            })?;
            if is_done {
                return Ok(true);
            }
            py.check_signals()?;
        }
    }

    /// The cycles after the first `received`, as far as they are kept, as columns; `first` is how many came before them.
    fn read<'py>(&self, py: Python<'py>, received: u64) -> PyResult<Bound<'py, PyDict>> {
        let (first, cycles): (u64, Vec<Telemetry>) = {
            let running = self.lock();
            let skipped = received.saturating_sub(running.dropped) as usize;
            let cycles = running.history.iter().skip(skipped).copied().collect();
            (received.max(running.dropped), cycles)
        };
        let read = columns(py, self.dof, &cycles)?;
        read.set_item("first", first)?;
        Ok(read)
    }

    /// The last cycle, as columns with one row.
    fn latest<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let last = self.lock().history.back().copied();
        columns(py, self.dof, last.as_slice())
    }

    /// Runs one cycle with a request; returns the cycle and the mode after it.
    #[pyo3(signature = (kind, values, trajectory = None, at_cycle = None))]
    fn request(
        &self,
        py: Python<'_>,
        kind: &str,
        values: Vec<f64>,
        trajectory: Option<&str>,
        at_cycle: Option<u64>,
    ) -> PyResult<(u64, &'static str)> {
        let code = code(kind, trajectory, &values)?;
        py.detach(|| {
            let mut running = self.lock();
            while at_cycle.is_some_and(|at| running.cycle_number() + 1 < at) {
                running.run(None)?;
            }
            let done = running.run(Some(&code))?;
            match done.refusal {
                Some(reason) => Err(PyRuntimeError::new_err(reason)),
                None => Ok((done.telemetry.state.cycle, done.mode)),
            }
        })
    }

    /// Requests idle.
    fn idle(&self, py: Python<'_>) -> PyResult<(u64, &'static str)> {
        self.request(py, "idle", Vec::new(), None, None)
    }

    /// A set-point for the next cycle.
    fn set_point(
        &self,
        position_m: [f64; 3],
        velocity_m_per_s: [f64; 3],
        acceleration_m_per_s2: [f64; 3],
        at_cycle: u64,
    ) {
        let set_point = SetPoint {
            position_m: Vector3::from(position_m),
            velocity_m_per_s: Vector3::from(velocity_m_per_s),
            acceleration_m_per_s2: Vector3::from(acceleration_m_per_s2),
            at_cycle,
        };
        // A request without joint values has the same code for all arms.
        let code = RequestCode::new(Some(&Request::<3>::SetPoint(set_point)));
        self.lock().set_point = Some(code);
    }

    /// Why a set-point was refused since the last call, if one was.
    fn take_refusal(&self) -> Option<String> {
        self.lock().refused_set_point.take()
    }

    /// Nothing: the interface of a connection.
    fn close(&self) {}
}

impl Simulation {
    fn lock(&self) -> MutexGuard<'_, Running> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn sized<const N: usize>(
    plant: &Description,
    model: Option<&Description>,
    options: &Options,
) -> Result<(Box<dyn Cycles>, f64), ExperimentError> {
    let setup = match model {
        Some(model) => Setup::<N>::with_model(plant, model, options.seed)?,
        None => Setup::<N>::new(plant, options.seed)?,
    };
    let setup = setup.with_plant_options(&options.plant_options.options)?;
    let wrong = options.gravity_error != 0.0 || options.friction_error != 0.0;
    let variant = Variant {
        mismatch: wrong.then_some(Mismatch {
            gravity: options.gravity_error,
            friction: options.friction_error,
            seed: options.seed,
        }),
        ..Variant::EXACT
    };
    let mut config = setup.config(&variant)?;
    config.law.gains = scenario::gains_like(&config.law.gains, options.stiffness_n_per_m);
    let paths = setup.paths();
    let scene = match options.block {
        true => scenario::block_at(&paths),
        false => Scene::default(),
    };
    let start_rad = match &options.start_rad {
        Some(start) => Vector::<N>::from_column_slice(start),
        None => {
            let (sinusoid, _) = paths.sinusoid(1.0);
            let hold = Trajectory::Hold(sinusoid.at(0.0).position);
            let home = Vector::<N>::from_column_slice(plant.home_rad());
            start_pose(&config, "the start", &hold, 0.0).unwrap_or(home)
        }
    };
    let controller = Controller::new(config)?;
    let rig = Rig::new(controller, setup.plant(&variant, scene), start_rad)?;
    Ok((
        Box::new(SizedSystem {
            rig,
            steps: 0,
            period_s: config.period_s,
            position_rad: start_rad,
        }),
        config.period_s,
    ))
}
