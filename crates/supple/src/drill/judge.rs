//! Whether a row came out as expected, and what did not.

use super::measure::{Measures, SLOW_M_PER_S};
use super::spec::{Event, Expected, Spec, Work};
use supple_plant::InjectionKind;

/// Kinetic energy with which an arm may sink on shorted motors \[J\]: 0.1 m/s at the tip of the 4-joint arm.
const SINKING_J: f64 = 0.05;
/// Greatest force beyond the first impact at 0.25 m/s \[N\].
const FORCE_N: f64 = 65.0;
/// A collision is found, and the arm floats, within this time of the contact \[ms\].
const MET_MS: f64 = 20.0;
/// Nothing is pressed \[N\].
const PRESSED_N: f64 = 5.0;
/// Speed of the tip over that before, by which an arm has become faster.
const FASTER: f64 = 1.1;
/// Where a fault makes nothing faster: this much is noise, and sinking on shorted motors \[m/s\].
const SINKING_M_PER_S: f64 = 0.12;
/// What encoders that are 20 ms late, or a gravity that has changed its sign, may make of a tip's speed before it is
/// seen: some 20 to 40 ms of the motors' own torques, or of twice the weight \[m/s\].
const UNSEEN_M_PER_S: f64 = 0.6;
/// An arm that bears a kilogram too much sinks on shorted motors at up to this speed \[m/s\].
const LADEN_M_PER_S: f64 = 0.35;
/// Way and speed of a tip whose drives came back without a jump \[m\], \[m/s\].
const JUMP: (f64, f64) = (0.02, SINKING_M_PER_S);
/// How far a load that the model lacks may take the tip in the 1.5 s that are watched, on motors that brake \[m\].
const SUNK_M: f64 = 0.2;
/// A tip that stands \[m\].
const STANDS_M: f64 = 0.005;

/// What came of it in words, and every way in which it is not as it should be.
pub fn judge(spec: &Spec, seen: &Measures, refusals: &[String]) -> (String, Vec<String>) {
    let mut wrong = Vec::new();
    let mut must = |held: bool, words: String| {
        if !held {
            wrong.push(words);
        }
    };
    if let Some(fault) = seen.fault_before {
        must(false, format!("fault {fault} before anything happened"));
    }
    let works_on = seen.fault.is_none() && seen.end_active && seen.braked_after_ms.is_none();
    match spec.expected {
        Expected::Unharmed => {
            must(works_on, "it does not work on".to_owned());
        }
        Expected::Stops(names) => {
            must(
                stopped_by(seen, names) && seen.fault_after_ms <= Some(spec.within_ms),
                format!("no such fault within {:.0} ms", spec.within_ms),
            );
            must_be_safe(spec, seen, &mut must);
        }
        Expected::Bears(names) => {
            must(
                works_on || stopped_by(seen, names),
                "it neither works on nor stops by such a fault".to_owned(),
            );
            if seen.fault.is_some() || seen.braked_after_ms.is_some() {
                must_be_safe(spec, seen, &mut must);
            } else {
                let bound = SLOW_M_PER_S.max(1.5 * seen.tip_before_m_per_s);
                must(
                    matches!(spec.event, Event::Injected { .. }) || seen.tip_after_m_per_s <= bound,
                    format!("tip at {:.2} m/s", seen.tip_after_m_per_s),
                );
                let resting = spec.work == Work::GravityHold;
                must(
                    !resting || seen.moving_until_ms <= spec.within_ms,
                    format!("still above 0.25 m/s after {:.0} ms", seen.moving_until_ms),
                );
            }
        }
        Expected::Refused => {
            must(!refusals.is_empty(), "accepted".to_owned());
            must(
                seen.tip_moved_m < STANDS_M && seen.fault.is_none(),
                format!("the tip moved {:.0} mm", seen.tip_moved_m * 1e3),
            );
        }
        Expected::ComesBack => {
            must(seen.fault.is_none(), "a fault".to_owned());
            must(
                seen.end_active && seen.end_mode == "gravity_hold",
                format!("in {} at the end, drives {}", seen.end_mode, active(seen)),
            );
            let (way_m, speed) = (seen.back_moved_m, seen.back_tip_m_per_s);
            must(
                way_m.is_some_and(|m| m < JUMP.0) && speed.is_some_and(|s| s < JUMP.1),
                format!(
                    "after activation the tip moved {:.0} mm at up to {:.2} m/s",
                    way_m.unwrap_or(f64::NAN) * 1e3,
                    speed.unwrap_or(f64::NAN)
                ),
            );
        }
        // Judged by the clock.
        Expected::Brakes(..) | Expected::ControllerFault | Expected::Heard => {}
    }
    if spec.event == Event::Obstacle {
        must(seen.impact_n > 0.0, "nothing was met".to_owned());
        must(
            seen.force_n <= FORCE_N,
            format!("{:.0} N after the impact", seen.force_n),
        );
        if let (Expected::Stops(_), ms) = (spec.expected, seen.fault_after_contact_ms) {
            must(
                ms.is_some_and(|ms| ms <= MET_MS),
                format!("stopped {:.0} ms after the contact", ms.unwrap_or(f64::NAN)),
            );
        }
        // Probing presses as its law says.
        if spec.work != Work::Probe && spec.work != Work::Track {
            let pressed_n = seen.pressed_n.unwrap_or(0.0);
            must(
                pressed_n < PRESSED_N,
                format!("pressed with {pressed_n:.0} N after 0.5 s"),
            );
        }
    }
    (outcome(seen, works_on, refusals), wrong)
}

fn stopped_by(seen: &Measures, names: &[&str]) -> bool {
    seen.fault.is_some_and(|fault| names.contains(&fault))
}

/// Rest or braking, in time, and nothing faster than before.
fn must_be_safe(spec: &Spec, seen: &Measures, must: &mut impl FnMut(bool, String)) {
    must(
        seen.moving_until_ms <= spec.within_ms,
        format!(
            "above 0.25 m/s until {:.0} ms, {:.0} allowed",
            seen.moving_until_ms, spec.within_ms
        ),
    );
    if let Some(tip) = seen.tip_later_m_per_s {
        must(
            tip < SLOW_M_PER_S,
            format!("tip at {tip:.2} m/s 0.5 s after the fault"),
        );
    }
    if let Event::Injected {
        kind: InjectionKind::MotorDead { .. },
        ..
    } = spec.event
        && seen.braked_after_ms.is_some()
    {
        // A motor whose circuit is open does not brake: the others do, and the arm sinks on them alone.
        return;
    }
    if let (Some(at_j), Some(later_j)) = (seen.energy_at_fault_j, seen.energy_later_j) {
        must(
            later_j <= at_j.max(SINKING_J),
            format!("{later_j:.2} J 0.2 s after the fault, {at_j:.2} J at it"),
        );
    }
    if let Some(at_fault) = seen.tip_at_fault_m_per_s {
        let slow = match spec.event {
            Event::Injected { kind, .. } => match kind {
                InjectionKind::EncoderLate { .. } | InjectionKind::GravityReversed => {
                    UNSEEN_M_PER_S
                }
                InjectionKind::Payload { .. } => LADEN_M_PER_S,
                _ => SLOW_M_PER_S,
            },
            _ => SLOW_M_PER_S,
        };
        let bound = slow.max(FASTER * at_fault.max(seen.tip_before_m_per_s));
        must(
            seen.tip_after_m_per_s <= bound,
            format!(
                "tip at {:.2} m/s at most, {bound:.2} allowed",
                seen.tip_after_m_per_s
            ),
        );
    }
    if let Event::Injected {
        kind: InjectionKind::Payload { .. },
        ..
    } = spec.event
    {
        must(
            seen.tip_moved_m < SUNK_M || spec.work != Work::GravityHold,
            format!("the tip sank {:.0} mm", seen.tip_moved_m * 1e3),
        );
    }
}

fn active(seen: &Measures) -> &'static str {
    if seen.end_active { "active" } else { "idle" }
}

fn outcome(seen: &Measures, works_on: bool, refusals: &[String]) -> String {
    let mut parts = Vec::new();
    if let (Some(fault), Some(ms)) = (seen.fault, seen.fault_after_ms) {
        parts.push(format!("{fault} after {ms:.0} ms"));
    }
    if let Some(ms) = seen.braked_after_ms {
        parts.push(format!("braked after {ms:.0} ms"));
    }
    if !refusals.is_empty() && seen.fault.is_none() {
        parts.push("refused".to_owned());
    }
    if parts.is_empty() && works_on {
        parts.push(format!("works on in {}", seen.end_mode));
    }
    if parts.is_empty() {
        parts.push(format!("in {}, drives {}", seen.end_mode, active(seen)));
    }
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::super::measure::{Measures, Said};
    use super::super::trace::Line;
    use super::*;
    use crate::cli::PlantKind;
    use supple_core::controller::Mode;

    const MS: u64 = 1_000_000;

    /// A second before and two after, a line and a cycle every millisecond; a fault of this number after 50 ms.
    fn run(fault: u8, change: impl Fn(u64, &mut Line)) -> Measures {
        let lines = (0..3000).map(|ms| {
            let mut line = Line {
                time_ns: ms * MS,
                active: true,
                torque_nm: vec![0.0],
                force_n: 0.0,
                tip_m: [0.0; 3],
                tip_speed_m_per_s: 0.1,
                joint_speed_rad_per_s: 0.0,
                kinetic_energy_j: 0.01,
                injections: u64::from(ms >= 1000),
            };
            change(ms, &mut line);
            line
        });
        let said = (0..3000).map(|ms| Said {
            time_ns: ms * MS,
            cycle: ms,
            mode: Some(Mode::Track),
            fault: if ms >= 1050 { fault } else { 0 },
            active: true,
        });
        let (lines, said): (Vec<Line>, Vec<Said>) = (lines.collect(), said.collect());
        Measures::new(&lines, &said, 500 * MS, 1000 * MS)
    }

    fn spec(event: Event, expected: Expected) -> Spec {
        Spec {
            plant: PlantKind::Sim,
            work: Work::Track,
            event,
            expected,
            within_ms: 600.0,
        }
    }

    fn stuck(expected: Expected) -> Spec {
        let kind = InjectionKind::EncoderStuck { joint: None };
        let at_once = false;
        spec(Event::Injected { kind, at_once }, expected)
    }

    const NAMED: Expected = Expected::Stops(&["encoder_stuck"]);

    #[test]
    fn a_fault_and_rest_are_as_expected_and_another_fault_or_none_is_not() {
        let seen = run(15, |_, _| {});
        assert_eq!(seen.fault_after_ms, Some(50.0));
        let (outcome, wrong) = judge(&stuck(NAMED), &seen, &[]);
        assert_eq!(
            (outcome.as_str(), wrong.len()),
            ("encoder_stuck after 50 ms", 0)
        );
        assert!(!judge(&stuck(NAMED), &run(7, |_, _| {}), &[]).1.is_empty());
        assert!(!judge(&stuck(NAMED), &run(0, |_, _| {}), &[]).1.is_empty());
        assert!(
            judge(&stuck(Expected::Unharmed), &run(0, |_, _| {}), &[])
                .1
                .is_empty()
        );
        assert!(!judge(&stuck(Expected::Unharmed), &seen, &[]).1.is_empty());
    }

    #[test]
    fn an_arm_that_swings_on_after_its_fault_is_not_as_expected_unless_it_brakes() {
        let swing = |braked: bool| {
            run(15, move |ms, line| {
                if ms >= 1000 {
                    line.tip_speed_m_per_s = 2.0;
                }
                line.active = !(braked && ms >= 1060);
            })
        };
        let wrong = judge(&stuck(NAMED), &swing(false), &[]).1;
        assert_eq!(wrong.len(), 2, "{wrong:?}");
        assert!(judge(&stuck(NAMED), &swing(true), &[]).1.is_empty());
    }

    #[test]
    fn energy_that_grows_after_a_fault_is_not_as_expected() {
        let seen = run(15, |ms, line| {
            if ms > 1300 {
                line.kinetic_energy_j = 0.2;
            }
        });
        let wrong = judge(&stuck(NAMED), &seen, &[]).1;
        assert_eq!(wrong, ["0.20 J 0.2 s after the fault, 0.01 J at it"]);
    }

    #[test]
    fn a_block_is_hit_once_and_not_pressed() {
        let met = |later_n: f64| {
            run(14, move |ms, line| match ms {
                1040..1044 => line.force_n = 700.0,
                1044.. => line.force_n = later_n,
                _ => {}
            })
        };
        let mut obstacle = spec(Event::Obstacle, Expected::Stops(&["tip_collision"]));
        obstacle.work = Work::Move;
        assert!(judge(&obstacle, &met(2.0), &[]).1.is_empty());
        assert_eq!(
            judge(&obstacle, &met(60.0), &[]).1,
            ["pressed with 60 N after 0.5 s"]
        );
        assert_eq!(judge(&obstacle, &met(90.0), &[]).1.len(), 2);
    }

    #[test]
    fn a_request_must_be_refused_and_move_nothing() {
        let wrong = spec(
            Event::Request(super::super::spec::Wrong::TooFast),
            Expected::Refused,
        );
        let seen = run(0, |_, _| {});
        assert!(judge(&wrong, &seen, &["too fast".to_owned()]).1.is_empty());
        assert_eq!(judge(&wrong, &seen, &[]).1, ["accepted"]);
        let moved = run(0, |ms, line| {
            line.tip_m[0] = if ms > 1500 { 0.1 } else { 0.0 }
        });
        assert_eq!(judge(&wrong, &moved, &["too fast".to_owned()]).1.len(), 1);
    }

    #[test]
    fn drives_come_back_without_a_jump() {
        let back = |speed: f64| {
            let mut seen = run(0, move |ms, line| {
                line.active = !(1000..2000).contains(&ms);
                if ms >= 2000 {
                    line.tip_speed_m_per_s = speed;
                }
            });
            seen.end_mode = "gravity_hold";
            seen
        };
        let lowered = super::super::spec::Lowered::Idle;
        let spec = spec(Event::Drives(lowered), Expected::ComesBack);
        assert!(judge(&spec, &back(0.05), &[]).1.is_empty());
        assert_eq!(judge(&spec, &back(1.5), &[]).1.len(), 1);
    }
}
