//! All test cases with their expected results. The expectations were written before the first run.

use super::spec::{
    Activation, DriveShutdown, Event, Expected, FaultTime, InvalidRequest, ProcessFailure,
    RequestObstruction, Spec, TestTask, UP,
};
use crate::cli::PlantKind;
use crate::up::CONTROLLER;
use supple_plant::InjectionKind;

/// Time from a process loss until the motors brake \[ms\]: 10 ms without an answer, on a bus then one frame to the safety
/// module and one to the motors.
const DRIVE_SHUTDOWN_MS: (f64, f64) = (8.0, 25.0);
/// Time without frames from the host after which the safety module disables torque \[ms\].
const HEARTBEAT_MS: (f64, f64) = (90.0, 120.0);
/// Maximum time from the termination signal until the controller has set the drives to idle \[ms\].
const CONTROLLER_EXIT_MS: (f64, f64) = (0.0, 50.0);

/// Limit from the event to rest or braking \[ms\]: the fault is detected within 100 ms of becoming observable; 500 ms
/// later the tip is slow or the motors brake.
const FAULT_AND_STOP_MS: f64 = 600.0;
/// Limit for faults that become observable only after some motion \[ms\].
const LATE_FAULT_AND_STOP_MS: f64 = 1100.0;

/// Tasks in which faults of torques and of gravity are injected.
const WITH_TORQUE: &[TestTask] = &[
    TestTask::GravityHold,
    TestTask::Move,
    TestTask::Track,
    TestTask::TrackStiff,
    TestTask::Float,
    TestTask::JointImpedance,
    TestTask::TrackPose,
    TestTask::Breakaway,
];
/// Valid faults when the arm hits an obstacle.
const CONTACT_FAULTS: &[&str] = &[
    "joint_collision",
    "tip_collision",
    "workspace",
    "joint_tracking_error",
];
/// Valid faults when the joint of a breakaway ramp hits an obstacle.
const RAMP_CONTACT_FAULTS: &[&str] = &extended::<6>(
    &extended::<5>(CONTACT_FAULTS, "encoder_stuck"),
    "encoder_unmoved",
);
/// Valid faults when the arm hits an obstacle in the pose mode.
const POSE_CONTACT_FAULTS: &[&str] = &[
    "joint_collision",
    "tip_collision",
    "joint_speed",
    "rotation_error",
    "singular",
    "workspace",
];
/// Valid faults after a disturbance: the arm leaves its path, exceeds a speed limit or, in the pose mode, gets near a
/// singular pose.
const DISTURBANCE_FAULTS: &[&str] = &[
    "joint_collision",
    "tip_collision",
    "joint_speed",
    "tip_speed",
    "joint_tracking_error",
    "tracking_error",
    "workspace",
    "rotation_error",
    "singular",
];
/// Valid faults for a stuck encoder.
const STUCK_ENCODER_FAULTS: &[&str] = &[
    "encoder_stuck",
    "encoder_unmoved",
    "encoder_unreliable",
    "moves_against_torque",
    "joint_tracking_error",
    "tracking_error",
    "joint_collision",
    "tip_collision",
    "rotation_error",
    "singular",
];
/// Valid faults when a joint moves in the wrong direction: reversed encoder, motor or gravity.
pub const WRONG_DIRECTION_FAULTS: &[&str] = &[
    "moves_against_torque",
    "encoder_unreliable",
    "joint_collision",
    "tip_collision",
    "unmodelled_load",
    "joint_tracking_error",
    "tracking_error",
    "joint_speed",
    "tip_speed",
    "workspace",
    "rotation_error",
    "singular",
];
/// Valid faults for delayed angles: they stay constant until the delay has built up, then they make the loop unstable.
const LATE_ENCODER_FAULTS: &[&str] = &extended::<15>(
    &extended::<14>(
        &extended::<13>(WRONG_DIRECTION_FAULTS, "encoder_stuck"),
        "encoder_unmoved",
    ),
    "oscillation",
);
/// Valid faults for torques that are delayed so much that the loop is unstable.
const LATE_TORQUE_FAULTS: &[&str] = &["oscillation", "joint_speed", "joint_collision"];
/// Valid faults for lost, jumping or non-finite joint angles.
pub const ENCODER_LOSS_FAULTS: &[&str] = &[
    "encoder_lost",
    "encoder_unreliable",
    "encoder_jump",
    "measurement_not_finite",
];
/// Valid faults when the motor pucks are unpowered.
const POWER_LOSS_FAULTS: &[&str] = &["encoder_lost", "encoder_unreliable", "state_stale"];
/// Valid faults for an unmodelled load.
const UNMODELLED_LOAD_FAULTS: &[&str] = &[
    "moves_against_torque",
    "unmodelled_load",
    "joint_collision",
    "tip_collision",
];

/// Valid faults for an unmodelled load during tracking, where the tracking error may trip first.
const UNMODELLED_LOAD_TRACKING_FAULTS: &[&str] =
    &extended::<5>(UNMODELLED_LOAD_FAULTS, "tracking_error");

/// Returns a list of `N` names: the names of another list, and one more.
const fn extended<const N: usize>(names: &[&'static str], more: &'static str) -> [&'static str; N] {
    assert!(names.len() + 1 == N);
    let mut all = [more; N];
    let mut i = 0;
    while i < names.len() {
        all[i] = names[i];
        i += 1;
    }
    all
}

/// All test cases of a plant.
pub fn all(plant: PlantKind) -> Vec<Spec> {
    let mut cases = wall_clock_cases(plant);
    cases.extend(virtual_time_cases(plant));
    cases
}

const ALL_TASKS: [TestTask; 7] = [
    TestTask::GravityHold,
    TestTask::Move,
    TestTask::Track,
    TestTask::Probe,
    TestTask::Excite,
    TestTask::Float,
    TestTask::JointImpedance,
];

/// Returns the test cases of process failures, for the tasks with which `supple up` begins.
fn wall_clock_cases(plant: PlantKind) -> Vec<Spec> {
    let brakes = |(from, to)| Expected::Brakes(from, to);
    let mut processes = match plant {
        PlantKind::Sim => vec![
            (CONTROLLER, brakes(DRIVE_SHUTDOWN_MS)),
            ("supple-sim", Expected::ControllerFault),
        ],
        PlantKind::Emu | PlantKind::Can => vec![
            (CONTROLLER, brakes(DRIVE_SHUTDOWN_MS)),
            ("supple-can", brakes(HEARTBEAT_MS)),
            ("supple-emu", Expected::ControllerFault),
        ],
    };
    processes.push((UP, brakes(CONTROLLER_EXIT_MS)));
    let orderly = [ProcessFailure::Terminate, ProcessFailure::Interrupt];
    let row = |task, event, expected| Spec {
        plant,
        task,
        event,
        expected,
        within_ms: FAULT_AND_STOP_MS,
        realistic: false,
    };
    let nothing = Event::Nothing { wall: true };
    let mut cases = vec![row(TestTask::Track, nothing, Expected::KeepsRunning)];
    for task in ALL_TASKS.into_iter().chain([TestTask::TrackPose]) {
        for (name, expected) in &processes {
            for loss in [ProcessFailure::Kill, ProcessFailure::Stop]
                .into_iter()
                .chain(orderly)
            {
                let expected = match (*name, loss) {
                    // `supple up` only supervises; stopping it does not affect the arm.
                    (UP, ProcessFailure::Stop) => Expected::KeepsRunning,
                    // The emulated arm has ended, with its motors.
                    (
                        "supple-emu" | "supple-sim",
                        ProcessFailure::Terminate | ProcessFailure::Interrupt,
                    ) => *expected,
                    // A controller that receives SIGTERM sets the drives to idle before it ends.
                    (_, ProcessFailure::Terminate | ProcessFailure::Interrupt) => {
                        brakes(CONTROLLER_EXIT_MS)
                    }
                    _ => *expected,
                };
                cases.push(row(task, Event::Process { name, loss }, expected));
            }
        }
    }
    for task in ALL_TASKS.into_iter().chain([TestTask::TrackPose]) {
        let waiting = Event::Hindered(RequestObstruction::RequestsWait);
        cases.push(row(task, waiting, Expected::IdleAccepted));
    }
    for task in [TestTask::GravityHold, TestTask::Move, TestTask::Track] {
        for full in [
            RequestObstruction::LogDiskFull,
            RequestObstruction::StandardErrorFull,
        ] {
            cases.push(row(task, Event::Hindered(full), Expected::IdleAccepted));
        }
    }
    cases
}

fn virtual_time_cases(plant: PlantKind) -> Vec<Spec> {
    use InjectionKind as Kind;
    use TestTask::{
        Breakaway, Excite, Float, GravityHold, JointImpedance, Move, Probe, Track, TrackPose,
        TrackStiff,
    };
    let mut cases = Vec::new();
    let mut add = |tasks: &[TestTask], event, expected, within_ms| {
        cases.extend(tasks.iter().map(|task| Spec {
            plant,
            task: *task,
            event,
            expected,
            within_ms,
            realistic: false,
        }));
    };
    let injected = |kind| Event::Injected {
        kind,
        when: FaultTime::InTheTask(0),
    };
    let from_the_start = |kind| Event::Injected {
        kind,
        when: FaultTime::FromTheStart,
    };
    let (stops, runs_or_faults) = (Expected::FaultAndRest, Expected::KeepsRunningOrFault);
    let one = Some(1);
    let all: Vec<TestTask> = ALL_TASKS
        .into_iter()
        .chain([TrackStiff, TrackPose, Breakaway])
        .collect();
    add(
        &all,
        Event::Nothing { wall: false },
        Expected::KeepsRunning,
        0.0,
    );

    // External disturbances and obstacles.
    let bump = injected(Kind::Bump {
        joint: 3,
        speed_rad_per_s: 2.5,
    });
    add(
        &all,
        bump,
        runs_or_faults(DISTURBANCE_FAULTS),
        FAULT_AND_STOP_MS,
    );
    let bump_back = injected(Kind::Bump {
        joint: 1,
        speed_rad_per_s: -1.5,
    });
    add(
        &[GravityHold, Move, Track, TrackStiff],
        bump_back,
        runs_or_faults(DISTURBANCE_FAULTS),
        FAULT_AND_STOP_MS,
    );
    // Compliant modes may continue; stiff modes must fault.
    add(
        &[GravityHold, Track, Probe, Float, JointImpedance],
        Event::Obstacle,
        runs_or_faults(CONTACT_FAULTS),
        FAULT_AND_STOP_MS,
    );
    // A torque ramp cannot distinguish a blocked joint from a stuck encoder.
    add(
        &[Breakaway],
        Event::Obstacle,
        runs_or_faults(RAMP_CONTACT_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    // A contact accelerates the light joints of the wrist strongly.
    add(
        &[TrackPose],
        Event::Obstacle,
        runs_or_faults(POSE_CONTACT_FAULTS),
        FAULT_AND_STOP_MS,
    );
    add(
        &[Move, Excite],
        Event::Obstacle,
        stops(CONTACT_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );

    // Encoders.
    // Joint 3 has its own motor and therefore its own encoder.
    let stuck = injected(Kind::EncoderStuck { joint: Some(3) });
    let all_stuck = injected(Kind::EncoderStuck { joint: None });
    // A stuck encoder is not observable while this joint is stationary, or moves by less than the resolution of the check.
    add(
        &[GravityHold, Float, Breakaway, Excite],
        stuck,
        runs_or_faults(STUCK_ENCODER_FAULTS),
        FAULT_AND_STOP_MS,
    );
    add(
        &[Move],
        stuck,
        stops(STUCK_ENCODER_FAULTS),
        FAULT_AND_STOP_MS,
    );
    add(
        &[Track, TrackStiff, JointImpedance, TrackPose],
        stuck,
        stops(STUCK_ENCODER_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    // At 40 mm/s the reference does not travel far enough in the observation time for the check to trip.
    add(
        &[Probe],
        stuck,
        runs_or_faults(STUCK_ENCODER_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    add(
        &[GravityHold, Breakaway],
        all_stuck,
        runs_or_faults(STUCK_ENCODER_FAULTS),
        FAULT_AND_STOP_MS,
    );
    add(
        &[Move, Track, TrackStiff, JointImpedance, TrackPose],
        all_stuck,
        stops(STUCK_ENCODER_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    // Many arms have their encoders on the motors: a stuck encoder causes two wrong angles if its motor moves two joints.
    let motor_stuck = injected(Kind::MotorEncoderStuck { motor: 1 });
    add(
        &[GravityHold, Float, Breakaway],
        motor_stuck,
        runs_or_faults(STUCK_ENCODER_FAULTS),
        FAULT_AND_STOP_MS,
    );
    add(
        &[Move, Excite, Track, TrackStiff, JointImpedance, TrackPose],
        motor_stuck,
        stops(STUCK_ENCODER_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    // Slow, fast and near a reversal: a stiff law accelerates a joint whose motion the encoder does not show.
    for motor in [0, 1, 2, 3] {
        for after_ms in [-600, 300, 700, 1700] {
            let stuck = Event::Injected {
                kind: Kind::MotorEncoderStuck { motor },
                when: FaultTime::InTheTask(after_ms),
            };
            add(
                &[TrackStiff],
                stuck,
                runs_or_faults(STUCK_ENCODER_FAULTS),
                LATE_FAULT_AND_STOP_MS,
            );
        }
    }
    let late = injected(Kind::EncoderLate {
        joint: None,
        cycles: 20,
    });
    add(
        &[
            GravityHold,
            Move,
            Track,
            TrackStiff,
            Excite,
            Float,
            JointImpedance,
            TrackPose,
            Breakaway,
        ],
        late,
        runs_or_faults(LATE_ENCODER_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    let sign = injected(Kind::EncoderSign { joint: one });
    add(
        &[GravityHold, Float, Breakaway],
        sign,
        runs_or_faults(WRONG_DIRECTION_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    add(
        &[Move, Track, TrackStiff, JointImpedance, TrackPose],
        sign,
        stops(WRONG_DIRECTION_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    // The move to the start pose makes the fault observable.
    add(
        &[GravityHold],
        from_the_start(Kind::EncoderSign { joint: one }),
        stops(WRONG_DIRECTION_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    let second = injected(Kind::ReplyLost {
        joint: one,
        every: 2,
    });
    add(
        &[
            GravityHold,
            Track,
            TrackStiff,
            Float,
            JointImpedance,
            TrackPose,
            Breakaway,
        ],
        second,
        stops(ENCODER_LOSS_FAULTS),
        FAULT_AND_STOP_MS,
    );
    let jump = injected(Kind::EncoderOffset {
        joint: one,
        offset_rad: 0.2,
    });
    add(
        &[
            GravityHold,
            Track,
            TrackStiff,
            Float,
            JointImpedance,
            TrackPose,
            Breakaway,
        ],
        jump,
        stops(ENCODER_LOSS_FAULTS),
        FAULT_AND_STOP_MS,
    );
    if plant == PlantKind::Sim {
        let nan = injected(Kind::EncoderNan { joint: one });
        add(&[Track], nan, stops(ENCODER_LOSS_FAULTS), FAULT_AND_STOP_MS);
    }

    // Motors.
    let dead = injected(Kind::MotorDead { motor: 1 });
    add(
        WITH_TORQUE,
        dead,
        stops(WRONG_DIRECTION_FAULTS),
        FAULT_AND_STOP_MS,
    );
    let reversed = injected(Kind::TorqueSign { joint: 1 });
    add(
        &[
            GravityHold,
            Move,
            Excite,
            Track,
            TrackStiff,
            Float,
            JointImpedance,
            TrackPose,
            Breakaway,
        ],
        reversed,
        stops(WRONG_DIRECTION_FAULTS),
        FAULT_AND_STOP_MS,
    );
    // Slow and fast, upwards and downwards: the effect of the torque differs.
    for after_ms in [-600, -300, 300, 600, 1200] {
        let reversed = Event::Injected {
            kind: Kind::TorqueSign { joint: 1 },
            when: FaultTime::InTheTask(after_ms),
        };
        add(
            &[Track],
            reversed,
            stops(WRONG_DIRECTION_FAULTS),
            LATE_FAULT_AND_STOP_MS,
        );
    }
    let later = injected(Kind::TorqueLate { cycles: 3 });
    add(
        WITH_TORQUE,
        later,
        runs_or_faults(DISTURBANCE_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    for cycles in [10, 20] {
        let far_later = injected(Kind::TorqueLate { cycles });
        add(
            WITH_TORQUE,
            far_later,
            runs_or_faults(LATE_TORQUE_FAULTS),
            LATE_FAULT_AND_STOP_MS,
        );
    }

    // Unmodelled effects.
    let gravity = Kind::GravityReversed;
    add(
        WITH_TORQUE,
        injected(gravity),
        stops(WRONG_DIRECTION_FAULTS),
        FAULT_AND_STOP_MS,
    );
    add(
        &[GravityHold],
        from_the_start(gravity),
        stops(WRONG_DIRECTION_FAULTS),
        FAULT_AND_STOP_MS,
    );
    let payload = Kind::Payload { mass_kg: 1.0 };
    add(
        &[GravityHold, Breakaway],
        injected(payload),
        stops(UNMODELLED_LOAD_FAULTS),
        FAULT_AND_STOP_MS,
    );
    // During motion an unknown load only causes a path error; it is detected when the arm holds still.
    add(
        &[Move],
        injected(payload),
        stops(UNMODELLED_LOAD_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    add(
        &[Track, TrackStiff],
        injected(payload),
        stops(UNMODELLED_LOAD_TRACKING_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );
    add(
        &[GravityHold],
        from_the_start(payload),
        stops(UNMODELLED_LOAD_FAULTS),
        FAULT_AND_STOP_MS,
    );

    // Float yields to a load as to a hand; its speed limits end the fall. Compliant joints yield according to their stiffness,
    // as to any force: there is no test case for them.
    add(
        &[Float],
        injected(payload),
        stops(DISTURBANCE_FAULTS),
        LATE_FAULT_AND_STOP_MS,
    );

    // Drives and requests.
    let idle = Event::Drives(DriveShutdown::Idle);
    add(
        &[
            GravityHold,
            Move,
            Track,
            Float,
            JointImpedance,
            TrackPose,
            Breakaway,
        ],
        idle,
        Expected::ReturnsToGravityHold,
        FAULT_AND_STOP_MS,
    );
    let at_home = Event::Drives(DriveShutdown::IdleAtHome);
    add(
        &[GravityHold, TrackPose],
        at_home,
        Expected::ReturnsToGravityHold,
        FAULT_AND_STOP_MS,
    );
    let stiff = Event::Drives(DriveShutdown::IdleWhenStiff);
    add(
        &[Track],
        stiff,
        Expected::ReturnsToGravityHold,
        FAULT_AND_STOP_MS,
    );
    if plant == PlantKind::Emu {
        // Without power, the motor pucks lose their position reference, so the drives cannot be re-enabled automatically.
        let activated = Event::Activation(Activation::InFault);
        add(
            &[GravityHold, Move, Track, Float, JointImpedance, Breakaway],
            activated,
            Expected::StaysIdle(ENCODER_LOSS_FAULTS),
            FAULT_AND_STOP_MS,
        );
        let pressed = Event::Activation(Activation::InWork);
        add(
            &[Move, Track, Probe, Excite, JointImpedance, Breakaway],
            pressed,
            Expected::KeepsRunning,
            0.0,
        );
        let e_stop = Event::Drives(DriveShutdown::EStop);
        add(
            &[Move, Track],
            e_stop,
            stops(POWER_LOSS_FAULTS),
            FAULT_AND_STOP_MS,
        );
    }
    add(
        &[Track],
        Event::Request(InvalidRequest::TooFast),
        Expected::Refused,
        0.0,
    );
    add(
        &[Track],
        Event::Request(InvalidRequest::TooStiff),
        Expected::Refused,
        0.0,
    );
    add(
        &[Move],
        Event::Request(InvalidRequest::WhileIdle),
        Expected::Refused,
        0.0,
    );
    cases.extend(realistic_cases(&cases));
    cases
}

/// Returns the cases of lost drives, motor faults and model faults again, with the effects of a real arm.
fn realistic_cases(cases: &[Spec]) -> Vec<Spec> {
    let of_drives = |spec: &&Spec| {
        matches!(
            spec.event,
            Event::Nothing { .. }
                | Event::Drives(DriveShutdown::Idle | DriveShutdown::IdleAtHome)
                | Event::Injected {
                    kind: InjectionKind::TorqueSign { .. }
                        | InjectionKind::MotorDead { .. }
                        | InjectionKind::GravityReversed,
                    ..
                }
        )
    };
    let moving = |spec: &&Spec| {
        matches!(
            spec.task,
            TestTask::Move | TestTask::Track | TestTask::TrackStiff | TestTask::TrackPose
        )
    };
    let lost = |spec: &&Spec| matches!(spec.event, Event::Drives(_));
    let chosen = cases
        .iter()
        .filter(|spec| of_drives(spec) && (moving(spec) || lost(spec)));
    chosen
        .map(|spec| Spec {
            realistic: true,
            ..*spec
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn each_plant_has_at_least_sixty_test_cases_with_unique_names() {
        for plant in [PlantKind::Sim, PlantKind::Emu] {
            let cases = all(plant);
            let names: BTreeSet<String> = cases.iter().map(Spec::name).collect();
            assert_eq!(names.len(), cases.len());
            assert!(cases.len() >= 60, "{} of {plant:?}", cases.len());
        }
    }
}
