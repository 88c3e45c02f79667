//! All rows, each with what is expected of it: written before any of them was run.

use super::spec::{Event, Expected, Loss, Lowered, Spec, UP, Work, Wrong};
use crate::cli::PlantKind;
use crate::up::CONTROLLER;
use supple_plant::InjectionKind;

/// Time in which the motors of an arm on a bus brake once its host has noticed a loss \[ms\]: 10 ms without
/// an answer, a frame to the safety module, its frame to the motors.
const LOWERED_MS: (f64, f64) = (8.0, 25.0);
/// Silence of the host after which the safety module ends torque by itself \[ms\].
const HEARTBEAT_MS: (f64, f64) = (90.0, 120.0);
/// Time for which the simulated arm's motors apply the fallback torque \[ms\].
const FALLBACK_MS: (f64, f64) = (95.0, 120.0);
/// A controller that is asked to end has the drives lowered within this time \[ms\].
const LEAVING_MS: (f64, f64) = (0.0, 50.0);

/// A fault is found within 100 ms of being observable, and 500 ms later the tip is slow or the motors brake \[ms\].
const FOUND_MS: f64 = 600.0;
/// What is observable only once the arm has moved for a while \[ms\].
const FOUND_LATE_MS: f64 = 1100.0;

/// The arm meets something.
const MET: &[&str] = &[
    "joint_collision",
    "tip_collision",
    "workspace",
    "joint_tracking_error",
];
/// The arm is thrown off its way, or too fast.
const THROWN: &[&str] = &[
    "joint_collision",
    "tip_collision",
    "joint_speed",
    "tip_speed",
    "joint_tracking_error",
    "tracking_error",
    "workspace",
];
/// An encoder does not say where the joint is.
const STUCK: &[&str] = &[
    "encoder_stuck",
    "encoder_unreliable",
    "moves_against_torque",
    "joint_tracking_error",
    "tracking_error",
    "joint_collision",
    "tip_collision",
];
/// An encoder, a motor or gravity is not what the model says: the joint moves the wrong way.
const AGAINST: &[&str] = &[
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
];
/// An angle that cannot be.
const LOST: &[&str] = &[
    "encoder_lost",
    "encoder_unreliable",
    "encoder_jump",
    "measurement_not_finite",
];
/// Pucks that do not answer any more.
const POWERLESS: &[&str] = &["encoder_lost", "encoder_unreliable", "state_stale"];
/// A load that the model does not have.
const LOAD: &[&str] = &[
    "moves_against_torque",
    "unmodelled_load",
    "joint_collision",
    "tip_collision",
];

/// The same while the arm tracks: it may fall too far behind first.
const LADEN: &[&str] = &[
    "moves_against_torque",
    "unmodelled_load",
    "joint_collision",
    "tip_collision",
    "tracking_error",
];

/// Every row of a plant.
pub fn all(plant: PlantKind) -> Vec<Spec> {
    let mut rows = by_the_wall(plant);
    rows.extend(in_virtual_time(plant));
    rows
}

const EVERY: [Work; 5] = [
    Work::GravityHold,
    Work::Move,
    Work::Track,
    Work::Probe,
    Work::Excite,
];

fn by_the_wall(plant: PlantKind) -> Vec<Spec> {
    let brakes = |(from, to)| Expected::Brakes(from, to);
    let mut processes = match plant {
        PlantKind::Sim => vec![
            (CONTROLLER, brakes(FALLBACK_MS)),
            ("supple-sim", Expected::ControllerFault),
        ],
        PlantKind::Emu | PlantKind::Can => vec![
            (CONTROLLER, brakes(LOWERED_MS)),
            ("supple-can", brakes(HEARTBEAT_MS)),
            ("supple-emu", Expected::ControllerFault),
        ],
    };
    processes.push((UP, brakes(LEAVING_MS)));
    let row = |work, event, expected| Spec {
        plant,
        work,
        event,
        expected,
        within_ms: FOUND_MS,
    };
    let nothing = Event::Nothing { wall: true };
    let mut rows = vec![row(Work::Track, nothing, Expected::Unharmed)];
    for work in EVERY {
        for (name, expected) in &processes {
            for loss in [Loss::Kill, Loss::Stop] {
                let expected = match (*name, loss) {
                    // Who watches over the others may stand still.
                    (UP, Loss::Stop) => Expected::Unharmed,
                    _ => *expected,
                };
                rows.push(row(work, Event::Process { name, loss }, expected));
            }
        }
    }
    for work in [Work::GravityHold, Work::Track] {
        rows.push(row(work, Event::Flood, Expected::Heard));
    }
    rows
}

fn in_virtual_time(plant: PlantKind) -> Vec<Spec> {
    use InjectionKind as Kind;
    use Work::{Excite, GravityHold, Move, Probe, Track};
    let mut rows = Vec::new();
    let mut add = |works: &[Work], event, expected, within_ms| {
        rows.extend(works.iter().map(|work| Spec {
            plant,
            work: *work,
            event,
            expected,
            within_ms,
        }));
    };
    let injected = |kind| Event::Injected {
        kind,
        at_once: false,
    };
    let from_the_start = |kind| Event::Injected {
        kind,
        at_once: true,
    };
    let (stops, bears) = (Expected::Stops, Expected::Bears);
    let one = Some(1);
    add(
        &EVERY,
        Event::Nothing { wall: false },
        Expected::Unharmed,
        0.0,
    );

    // What meets the arm.
    let bump = injected(Kind::Bump {
        joint: 3,
        speed_rad_per_s: 2.5,
    });
    add(&EVERY, bump, bears(THROWN), FOUND_MS);
    let bump_back = injected(Kind::Bump {
        joint: 1,
        speed_rad_per_s: -1.5,
    });
    add(
        &[GravityHold, Move, Track],
        bump_back,
        bears(THROWN),
        FOUND_MS,
    );
    // Soft modes may bear it; a stiff one may not.
    add(
        &[GravityHold, Track, Probe],
        Event::Obstacle,
        bears(MET),
        FOUND_MS,
    );
    add(&[Move, Excite], Event::Obstacle, stops(MET), FOUND_LATE_MS);

    // Encoders.
    let stuck = injected(Kind::EncoderStuck { joint: one });
    let all_stuck = injected(Kind::EncoderStuck { joint: None });
    // An arm that stands still has encoders that stand still.
    add(&[GravityHold], stuck, bears(STUCK), FOUND_MS);
    add(&[Move, Excite], stuck, stops(STUCK), FOUND_MS);
    add(&[Track], stuck, stops(STUCK), FOUND_LATE_MS);
    // At 40 mm/s the joint's reference has not moved by what counts in the time that is watched.
    add(&[Probe], stuck, bears(STUCK), FOUND_LATE_MS);
    add(&[GravityHold], all_stuck, bears(STUCK), FOUND_MS);
    add(&[Move, Track], all_stuck, stops(STUCK), FOUND_LATE_MS);
    let late = injected(Kind::EncoderLate {
        joint: None,
        cycles: 20,
    });
    add(
        &[GravityHold, Move, Track, Excite],
        late,
        bears(AGAINST),
        FOUND_LATE_MS,
    );
    let sign = injected(Kind::EncoderSign { joint: one });
    add(&[GravityHold], sign, bears(AGAINST), FOUND_LATE_MS);
    add(&[Move, Track], sign, stops(AGAINST), FOUND_LATE_MS);
    let second = injected(Kind::ReplyLost {
        joint: one,
        every: 2,
    });
    add(&[GravityHold, Track], second, stops(LOST), FOUND_MS);
    let jump = injected(Kind::EncoderOffset {
        joint: one,
        offset_rad: 0.2,
    });
    add(&[GravityHold, Track], jump, stops(LOST), FOUND_MS);
    if plant == PlantKind::Sim {
        let nan = injected(Kind::EncoderNan { joint: one });
        add(&[Track], nan, stops(LOST), FOUND_MS);
    }

    // Motors.
    let dead = injected(Kind::MotorDead { motor: 1 });
    add(&[GravityHold, Move, Track], dead, stops(AGAINST), FOUND_MS);
    let reversed = injected(Kind::TorqueSign { joint: 1 });
    add(&[GravityHold, Track], reversed, stops(AGAINST), FOUND_MS);
    let later = injected(Kind::TorqueLate { cycles: 3 });
    add(
        &[GravityHold, Move, Track],
        later,
        bears(THROWN),
        FOUND_LATE_MS,
    );

    // What the model does not know.
    let gravity = Kind::GravityReversed;
    add(
        &[GravityHold, Move, Track],
        injected(gravity),
        stops(AGAINST),
        FOUND_MS,
    );
    add(
        &[GravityHold],
        from_the_start(gravity),
        stops(AGAINST),
        FOUND_MS,
    );
    let payload = Kind::Payload { mass_kg: 1.0 };
    add(&[GravityHold], injected(payload), stops(LOAD), FOUND_MS);
    // On its way an arm of unknown load is off its path, no more; it shows where the arm holds still.
    add(&[Move], injected(payload), stops(LOAD), FOUND_LATE_MS);
    add(&[Track], injected(payload), stops(LADEN), FOUND_LATE_MS);
    add(
        &[GravityHold],
        from_the_start(payload),
        stops(LOAD),
        FOUND_MS,
    );

    // Drives and requests.
    let idle = Event::Drives(Lowered::Idle);
    add(
        &[GravityHold, Move, Track],
        idle,
        Expected::ComesBack,
        FOUND_MS,
    );
    let stiff = Event::Drives(Lowered::IdleWhenStiff);
    add(&[Track], stiff, Expected::ComesBack, FOUND_MS);
    if plant == PlantKind::Emu {
        // Without power the pucks forget their positions: the drives do not come back by themselves.
        let e_stop = Event::Drives(Lowered::EStop);
        add(&[Move, Track], e_stop, stops(POWERLESS), FOUND_MS);
    }
    add(
        &[Track],
        Event::Request(Wrong::TooFast),
        Expected::Refused,
        0.0,
    );
    add(
        &[Track],
        Event::Request(Wrong::TooStiff),
        Expected::Refused,
        0.0,
    );
    add(
        &[Move],
        Event::Request(Wrong::WhileIdle),
        Expected::Refused,
        0.0,
    );
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn there_are_sixty_rows_and_more_for_each_plant_and_no_two_have_one_name() {
        for plant in [PlantKind::Sim, PlantKind::Emu] {
            let rows = all(plant);
            let names: BTreeSet<String> = rows.iter().map(Spec::name).collect();
            assert_eq!(names.len(), rows.len());
            assert!(rows.len() >= 60, "{} of {plant:?}", rows.len());
        }
    }
}
