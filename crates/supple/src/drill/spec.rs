//! Specification of a test case: plant, task of the arm, event and expected result.

use crate::cli::PlantKind;
use core::fmt;
use serde::Serialize;
use supple_plant::InjectionKind;

/// Task of the arm when the event occurs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TestTask {
    /// Gravity hold in the stretched-out pose.
    GravityHold,
    /// A stiff downward move at up to 0.25 m/s.
    Move,
    /// The sinusoid of the paper; a downward line if a block is in the way.
    Track,
    /// The sinusoid at a tip stiffness of 1000 N/m.
    TrackStiff,
    /// The probing cycle.
    Probe,
    /// A stiff oscillation of the shoulder, with the tip at up to 0.25 m/s.
    Excite,
    /// Float in the stretched-out pose.
    Float,
    /// The downward motion of the move with compliant joints, at up to 0.19 m/s.
    JointImpedance,
    /// A torque ramp on the shoulder that has not moved it yet, with the other joints held.
    Breakaway,
    /// The downward path of the tip while it rotates, with the 7-joint WAM and every joint active.
    TrackPose,
}

/// How a process fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ProcessFailure {
    /// The process is killed by `kill -9`.
    Kill,
    /// The process is stopped by SIGSTOP; SIGCONT follows.
    Stop,
    /// The process receives SIGTERM, which requests an orderly end.
    Terminate,
    /// The process alone receives SIGINT, as from a terminal.
    Interrupt,
}

/// Time at which a fault is injected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultTime {
    /// Before the first cycle.
    FromTheStart,
    /// At the usual time of the task, near its highest speed, shifted by this time \[ms\].
    InTheTask(i16),
}

/// Way in which the drives are disabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveShutdown {
    /// The drives are set to idle.
    Idle,
    /// The drives are set to idle after the operator has requested gains of 1000 N/m.
    IdleWhenStiff,
    /// The emergency stop is pressed.
    EStop,
    /// The drives are set to idle in the home pose, until the arm has sunk onto its stops.
    IdleAtHome,
}

/// Situation in which an operator activates the drives although the controller is not in gravity hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activation {
    /// A fault has set the drives to idle.
    InFault,
    /// The drives are active, and the arm performs its task.
    InWork,
}

/// A request that the controller must refuse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InvalidRequest {
    /// The sinusoid at 1000 times its speed.
    TooFast,
    /// Damping above the bound that follows from the delay of the drives.
    TooStiff,
    /// A move while the drives are idle.
    WhileIdle,
}

/// Condition in which a request of an operator must still arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequestObstruction {
    /// Sixteen requests fill the queue.
    RequestsWait,
    /// The disk of the log is full.
    LogDiskFull,
    /// Standard error is full and is not read.
    StandardErrorFull,
}

/// Event of the test case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// No event: the baseline of the other cases. In wall-clock time if `wall` is set.
    Nothing {
        /// Whether the case runs in wall-clock time.
        wall: bool,
    },
    /// A process fails; in wall-clock time.
    Process {
        /// Name of the process.
        name: &'static str,
        /// How the process fails.
        loss: ProcessFailure,
    },
    /// Idle is requested under such a condition; in wall-clock time.
    Hindered(RequestObstruction),
    /// A fault in the arm.
    Injected {
        /// The injected fault.
        kind: InjectionKind,
        /// When it begins.
        when: FaultTime,
    },
    /// A block of wood blocks the path.
    Obstacle,
    /// The drives are disabled, and activated again later.
    Drives(DriveShutdown),
    /// An operator activates the drives in a situation in which this must have no effect.
    Activation(Activation),
    /// An operator sends an invalid request.
    Request(InvalidRequest),
}

/// Expected result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// The system keeps running: no fault, drives active.
    KeepsRunning,
    /// One of these faults occurs, and then the arm stands still or brakes.
    FaultAndRest(&'static [&'static str]),
    /// Either the system keeps running or one of these faults occurs; in both cases the arm does not accelerate.
    KeepsRunningOrFault(&'static [&'static str]),
    /// The motors keep the last or the fallback torque, and brake between these two times \[ms\].
    Brakes(f64, f64),
    /// The plant process has ended: the controller latches a fault.
    ControllerFault,
    /// The request is refused with a reason, and the arm does not move.
    Refused,
    /// The re-enabled drives are in gravity hold, and the arm does not jump.
    ReturnsToGravityHold,
    /// Idle is accepted within 20 ms.
    IdleAccepted,
    /// One of these faults occurs; if the drives are activated in the fault, they become idle again at once, and the arm does not
    /// jump.
    StaysIdle(&'static [&'static str]),
}

/// A test case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spec {
    /// Plant.
    pub plant: PlantKind,
    /// Task of the arm.
    pub task: TestTask,
    /// Event of the test case.
    pub event: Event,
    /// Expected result.
    pub expected: Expected,
    /// Time limit from the event to rest or braking \[ms\].
    pub within_ms: f64,
    /// Whether the simulated arm has the effects of a real arm.
    pub realistic: bool,
}

/// Name of this program, which runs `supple up`.
pub const UP: &str = "supple";

impl Spec {
    /// Whether the case runs in wall-clock time instead of virtual time.
    pub fn runs_in_wall_clock_time(&self) -> bool {
        matches!(
            self.event,
            Event::Nothing { wall: true } | Event::Process { .. } | Event::Hindered(_)
        )
    }

    /// Name of the test case, as used by `--only` and `--list`.
    pub fn name(&self) -> String {
        let plant = format!("{:?}", self.plant).to_lowercase();
        let realistic = if self.realistic { "-realistic" } else { "" };
        format!("{plant}/{}/{}{realistic}", self.task, self.event)
    }
}

impl fmt::Display for TestTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            TestTask::GravityHold => "gravity_hold",
            TestTask::Move => "move",
            TestTask::Track => "track",
            TestTask::TrackStiff => "track_stiff",
            TestTask::Probe => "probe",
            TestTask::Excite => "excite",
            TestTask::Float => "float",
            TestTask::JointImpedance => "joint_impedance",
            TestTask::Breakaway => "breakaway",
            TestTask::TrackPose => "track_pose",
        })
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Event::Nothing { wall: false } => f.write_str("nothing"),
            Event::Nothing { wall: true } => f.write_str("nothing-by-the-clock"),
            Event::Process { name, loss } => {
                let how = match loss {
                    ProcessFailure::Kill => "kill",
                    ProcessFailure::Stop => "stop",
                    ProcessFailure::Terminate => "terminate",
                    ProcessFailure::Interrupt => "interrupt",
                };
                write!(f, "{how}-{name}")
            }
            Event::Hindered(hindrance) => f.write_str(match hindrance {
                RequestObstruction::RequestsWait => "sixteen-requests-wait",
                RequestObstruction::LogDiskFull => "log-disk-full",
                RequestObstruction::StandardErrorFull => "standard-error-full",
            }),
            Event::Injected { kind, when } => {
                let injection = supple_plant::Injection {
                    kind: *kind,
                    trigger: supple_plant::Trigger::AtStart,
                };
                match when {
                    FaultTime::FromTheStart => write!(f, "{injection}-from-the-start"),
                    FaultTime::InTheTask(0) => write!(f, "{injection}"),
                    FaultTime::InTheTask(after_ms) => write!(f, "{injection}{after_ms:+}-ms"),
                }
            }
            Event::Obstacle => f.write_str("block-in-the-way"),
            Event::Drives(DriveShutdown::Idle) => f.write_str("drives-idle-and-back"),
            Event::Drives(DriveShutdown::IdleWhenStiff) => {
                f.write_str("stiff-drives-idle-and-back")
            }
            Event::Drives(DriveShutdown::EStop) => f.write_str("e-stop"),
            Event::Drives(DriveShutdown::IdleAtHome) => f.write_str("drives-idle-at-home-and-back"),
            Event::Activation(Activation::InFault) => f.write_str("activated-in-a-fault"),
            Event::Activation(Activation::InWork) => f.write_str("activated-in-work"),
            Event::Request(InvalidRequest::TooFast) => f.write_str("too-fast-request"),
            Event::Request(InvalidRequest::TooStiff) => f.write_str("too-much-damping"),
            Event::Request(InvalidRequest::WhileIdle) => f.write_str("work-while-drives-idle"),
        }
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let any = |names: &[&str]| names.join(" or ");
        match self {
            Expected::KeepsRunning => f.write_str("keeps running"),
            Expected::FaultAndRest(names) => write!(f, "faults and stops: {}", any(names)),
            Expected::KeepsRunningOrFault(names) => {
                write!(f, "keeps running, or faults and stops: {}", any(names))
            }
            Expected::Brakes(from_ms, to_ms) => {
                write!(f, "brakes after {from_ms:.0} to {to_ms:.0} ms")
            }
            Expected::ControllerFault => f.write_str("controller latches a fault"),
            Expected::Refused => f.write_str("refused, arm does not move"),
            Expected::ReturnsToGravityHold => f.write_str("gravity hold again, no jump"),
            Expected::IdleAccepted => f.write_str("idle within 20 ms"),
            Expected::StaysIdle(names) => {
                write!(
                    f,
                    "faults: {}; activated in it, idle again within 25 ms",
                    any(names)
                )
            }
        }
    }
}
