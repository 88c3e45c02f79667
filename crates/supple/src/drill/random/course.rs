//! Runs a case: controller, drive guard and simulated arm in one loop, without processes.

use super::arm::Arm;
use super::draw::Case;
use supple_core::controller::{Mode, Request};
use supple_core::drive_guard::{DriveCommand, DriveGuard};
use supple_core::dynamics::potential_energy;
use supple_core::{Input, State, Vector, step};
use supple_experiment::ExperimentError;
use supple_plant::{ControllerView, Injector, Plant};

/// Time before the fault in which the motion of the task is measured \[s\].
const BEFORE_S: f64 = 0.2;
/// Time after the stop from which the arm must be slow \[s\].
const SLOW_AFTER_S: f64 = 0.5;
/// Time after the start of braking until which an energy peak counts \[s\].
const BRAKED_S: f64 = 0.01;

/// Outcome of a case. "Stop" is the first of two events: the controller reports a fault, or the guard ends the torque.
#[derive(Clone, Debug, Default)]
pub(super) struct CaseOutcome {
    /// Time of the injected fault \[s\].
    pub(super) fault_s: Option<f64>,
    /// Fault that the controller reports before the injected fault, as text.
    pub(super) false_fault: Option<String>,
    /// Time \[s\] and text of the first fault that the controller reports after it.
    pub(super) reported: Option<(f64, String)>,
    pub(super) stopped_s: Option<f64>,
    pub(super) braked_s: Option<f64>,
    /// Peak kinetic energies \[J\], here and in the following fields: during the task; shortly before the fault, including the
    /// energy of a blow; from the fault to the stop; at the stop; and from the stop until the motors brake.
    pub(super) task_j: f64,
    pub(super) before_j: f64,
    pub(super) unstopped_j: f64,
    pub(super) stop_j: f64,
    pub(super) after_j: f64,
    /// Maximum increase of the sum of kinetic, potential and elastic energy after the stop \[J\].
    pub(super) gained_j: f64,
    /// Maximum tip speed after the fault, and later than half a second after the stop with active drives \[m/s\].
    pub(super) tip_m_per_s: f64,
    pub(super) late_m_per_s: f64,
    /// Whether torque remained after an idle request.
    pub(super) idle_refused: bool,
}

/// The drives of the simulated arm, behind their guard.
struct Drives<const N: usize> {
    guard: DriveGuard<N>,
    active: bool,
    /// Whether the guard has ended the torque, until the controller requests no torque.
    latched: bool,
}

impl<const N: usize> Drives<N> {
    /// Returns the torques that the motors receive for a command \[N m\].
    fn torque_nm(
        &mut self,
        command: &DriveCommand<N>,
        wanted: bool,
        may_activate: bool,
    ) -> Vector<N> {
        self.latched &= wanted;
        if !self.active && wanted && may_activate && !self.latched {
            self.active = true;
            self.guard.reset_rate_limit(&command.torque_nm);
        }
        let allowed = self.guard.check_command(Some(command), self.active);
        if self.active && allowed.is_err() {
            (self.active, self.latched) = (false, true);
        }
        self.active &= wanted;
        match self.active {
            true => self.guard.limited_nm(&command.torque_nm, command.fault),
            false => {
                self.guard.reset_rate_limit(&command.torque_nm);
                Vector::zeros()
            }
        }
    }
}

/// Runs a case.
///
/// # Errors
/// [`ExperimentError::Plant`] if the plant rejects the case.
pub(super) fn run<const N: usize>(
    arm: &Arm<N>,
    case: &Case<N>,
) -> Result<CaseOutcome, ExperimentError> {
    let (controller, config) = (&arm.controller, arm.config());
    let mut plant = Plant::new(case.plant.clone(), case.start_rad, Vector::zeros())?;
    let mut injector = Injector::new(&case.injections, &mut plant, config.period_s)?;
    let mut state = State::new(controller);
    let mut drives = Drives {
        guard: DriveGuard::new(config),
        active: false,
        latched: false,
    };
    let mut course = CaseOutcome::default();
    let mut requests = case.requests.iter().peekable();
    let mut recent = RecentEnergies::new((BEFORE_S / config.period_s) as usize);
    let mut stop_total_j = 0.0;
    for cycle in 0..(case.duration_s / config.period_s) as u64 {
        let time_s = cycle as f64 * config.period_s;
        let mut request = requests
            .next_if(|(at_s, _)| *at_s <= time_s)
            .map(|(_, request)| *request);
        if let Some(Request::SetPoint(point)) = &mut request {
            point.at_cycle += cycle;
        }
        let position_rad = injector.replies();
        let input = Input {
            cycle,
            position_rad,
            tip_force_n: Some(plant.measurement().force_n),
            drives_active: drives.active,
            request,
        };
        let output = step(controller, &mut state, &input);
        course.idle_refused |= request == Some(Request::Idle) && !output.torque_off;
        drives.guard.observe(&position_rad, 1);
        let command = DriveCommand {
            torque_nm: output.torque_nm,
            mode: Some(output.mode),
            fault: output.fault.is_some(),
        };
        let may_activate = output.mode == Mode::GravityHold && !injector.drives_idle();
        let torque_nm = drives.torque_nm(&command, !output.torque_off, may_activate);

        let kinetic_j = plant.kinetic_energy_j();
        let truth = plant.truth();
        let tip_m_per_s = truth.tip_velocity_m_per_s.norm();
        let total_j = kinetic_j
            + potential_energy(&plant.config().arm, &truth.position_rad)
            + plant.elastic_energy_j();
        match course.fault_s {
            None => {
                course.task_j = course.task_j.max(kinetic_j);
                if let (Some(fault), None) = (output.fault, &course.false_fault) {
                    course.false_fault = Some(fault.to_string());
                }
            }
            Some(_) => {
                course.tip_m_per_s = course.tip_m_per_s.max(tip_m_per_s);
                if let (Some(fault), None) = (output.fault, &course.reported) {
                    course.reported = Some((time_s, fault.to_string()));
                }
                if course.stopped_s.is_none() && (output.fault.is_some() || drives.latched) {
                    course.stopped_s = Some(time_s);
                    (course.stop_j, stop_total_j) = (kinetic_j, total_j);
                }
                if course.stopped_s.is_some() && !drives.active && course.braked_s.is_none() {
                    course.braked_s = Some(time_s);
                }
                match course.stopped_s {
                    None => course.unstopped_j = course.unstopped_j.max(kinetic_j),
                    Some(stopped_s) => {
                        if course.braked_s.is_none_or(|at_s| time_s < at_s + BRAKED_S) {
                            course.after_j = course.after_j.max(kinetic_j);
                        }
                        course.gained_j = course.gained_j.max(total_j - stop_total_j);
                        if drives.active && time_s > stopped_s + SLOW_AFTER_S {
                            course.late_m_per_s = course.late_m_per_s.max(tip_m_per_s);
                        }
                    }
                }
            }
        }
        if course.fault_s == Some(time_s) {
            // A blow transfers its energy to the arm at once.
            course.before_j = course.before_j.max(kinetic_j);
        }
        recent.add(kinetic_j);
        let view = ControllerView {
            active: drives.active,
            mode: Some(output.mode),
        };
        injector.cycle(&mut plant, view, &torque_nm, [!drives.active; N]);
        if injector.drives_idle() {
            drives.active = false;
        }
        if course.fault_s.is_none() && injector.begun() > 0 {
            course.fault_s = Some((cycle + 1) as f64 * config.period_s);
            course.before_j = recent.peak();
        }
    }
    Ok(course)
}

/// Kinetic energies of the last cycles.
struct RecentEnergies {
    energies_j: Vec<f64>,
    next: usize,
}

impl RecentEnergies {
    fn new(cycles: usize) -> RecentEnergies {
        RecentEnergies {
            energies_j: vec![0.0; cycles.max(1)],
            next: 0,
        }
    }

    fn add(&mut self, kinetic_j: f64) {
        self.energies_j[self.next] = kinetic_j;
        self.next = (self.next + 1) % self.energies_j.len();
    }

    fn peak(&self) -> f64 {
        self.energies_j.iter().fold(0.0, |peak, j| peak.max(*j))
    }
}
