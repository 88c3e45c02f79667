//! Controller and plant in one process, in virtual time, one cycle at a time.

use crate::error::ExperimentError;
use crate::wiring::Wiring;
use std::collections::VecDeque;
use supple_core::controller::{CycleRecord, Mode, Request};
use supple_core::{Controller, Input, Output, State, Vector, step};
use supple_learning::{Learner, Report, Scheduled};
use supple_plant::{ControllerView, Measurement, Plant, PlantConfig, StepRecord, Truth};

/// A controller connected to a simulated plant.
pub struct Rig<const N: usize> {
    controller: Controller<N>,
    state: State<N>,
    plant: Plant<N>,
    /// Whether the drives are active: as in `supple-sim`, from gravity hold until the controller requests
    /// torque off.
    active: bool,
    learner: Option<Learner<N>>,
    /// Learned parameters that the controller has not applied yet.
    scheduled: VecDeque<Scheduled<N>>,
    steps: u64,
    wiring: Wiring<N>,
}

/// Data of one cycle.
pub struct Cycle<'a, const N: usize> {
    /// Input of the controller.
    pub input: Input<N>,
    /// Output of the controller.
    pub output: Output<N>,
    /// Measurements of the arm and the force sensor at the start of the cycle.
    pub measurement: Measurement<N>,
    /// Ground truth at the start of the cycle.
    pub truth: Truth<N>,
    /// All physics steps during the cycle, in order.
    pub steps: &'a [StepRecord],
}

impl<const N: usize> Rig<N> {
    /// Creates a plant at rest at `start_rad` with an idle controller.
    ///
    /// # Errors
    /// If the plant rejects its configuration.
    pub fn new(
        controller: Controller<N>,
        plant: PlantConfig<N>,
        start_rad: Vector<N>,
    ) -> Result<Rig<N>, ExperimentError> {
        Ok(Rig {
            state: State::new(&controller),
            controller,
            plant: Plant::new(plant, start_rad, Vector::zeros())?,
            active: false,
            learner: None,
            scheduled: VecDeque::new(),
            steps: 0,
            wiring: Wiring::AS_DESCRIBED,
        })
    }

    /// Sets the connections of encoders and motors.
    #[must_use]
    pub fn with_wiring(self, wiring: Wiring<N>) -> Rig<N> {
        Rig { wiring, ..self }
    }

    /// Replaces the controller by an idle one, as a restart of its process does; the arm stays in its pose. The learner
    /// is reset.
    pub fn replace_controller(&mut self, controller: Controller<N>) {
        self.state = State::new(&controller);
        self.learner = self
            .learner
            .as_ref()
            .map(|_| Learner::new(controller.config()));
        self.scheduled.clear();
        self.controller = controller;
        (self.active, self.steps) = (false, 0);
    }

    /// Adds a learner, which learns after a request to learn, as in `supple-rt`.
    #[must_use]
    pub fn with_learner(self) -> Rig<N> {
        Rig {
            learner: Some(Learner::new(self.controller.config())),
            ..self
        }
    }

    /// Returns the learner's estimates, if there is a learner.
    pub fn report(&self) -> Option<Report<N>> {
        self.learner.as_ref().map(Learner::report)
    }

    /// Returns the controller.
    pub fn controller(&self) -> &Controller<N> {
        &self.controller
    }

    /// Returns the plant in its present state.
    pub fn plant(&self) -> &Plant<N> {
        &self.plant
    }

    /// Fixes a ball of this mass \[kg\] to the tip.
    ///
    /// # Errors
    /// If the mass is not finite and positive.
    pub fn add_payload(&mut self, mass_kg: f64) -> Result<(), ExperimentError> {
        Ok(self.plant.add_payload(mass_kg)?)
    }

    /// Puts the arm at rest in this pose, as a support does.
    ///
    /// # Errors
    /// If the pose is not finite, or has the tip inside an object.
    pub fn place(&mut self, position_rad: Vector<N>) -> Result<(), ExperimentError> {
        Ok(self.plant.set_state(position_rad, Vector::zeros())?)
    }

    /// Runs one cycle: measures, steps the controller, actuates. The controller applies learned parameters in a cycle without a
    /// request.
    pub fn cycle(&mut self, request: Option<Request<N>>) -> Cycle<'_, N> {
        let measurement = *self.plant.measurement();
        let truth = *self.plant.truth();
        let cycle = measurement.cycle;
        let is_due = |scheduled: &Scheduled<N>| cycle >= scheduled.at_cycle;
        let learned = || {
            let due = self.scheduled.front().is_some_and(is_due);
            let scheduled = due.then(|| self.scheduled.pop_front()).flatten();
            scheduled.map(|scheduled| scheduled.request)
        };
        let request = request.or_else(learned);
        let input = Input {
            cycle: measurement.cycle,
            position_rad: self.wiring.read(&measurement.position_rad).map(Some).into(),
            tip_force_n: Some(measurement.force_n),
            drives_active: self.active,
            request,
        };
        let output = step(&self.controller, &mut self.state, &input);
        if let Some(learner) = &mut self.learner {
            let record = CycleRecord::new(self.steps, &input, &output);
            self.scheduled.extend(learner.observe(&record));
        }
        self.steps += 1;
        self.active = !output.torque_off && (self.active || output.mode == Mode::GravityHold);
        self.plant.set_controller_view(ControllerView {
            active: self.active,
            mode: Some(output.mode),
        });
        self.plant.short_motors([!self.active; N]);
        let torque_nm = match self.active {
            true => self.wiring.drive(&output.torque_nm),
            false => Vector::zeros(),
        };
        self.plant.cycle(&torque_nm);
        Cycle {
            input,
            output,
            measurement,
            truth,
            steps: self.plant.steps(),
        }
    }
}
