//! Tests with a motor whose zero position moved while the program was not running, so that no jump is detected, and with a lost
//! controller: the plant loop computes the holding torque from a wrong angle, and this torque accelerates the arm.

use super::rig::Rig;
use supple_core::Vector;
use supple_damiao::Status;
use supple_drive::{Drives, LossReason, Stage};

/// Speed limit of every joint of this arm \[rad/s\].
const LIMIT_RAD_PER_S: f64 = 2.0;
/// Maximum time above the speed limit while the arm is held \[s\]: 10 ms until detection, the rest for estimation and torque.
const FAST_S: f64 = 0.025;
/// Tolerance of the work of damping motors in a cycle, for rounding and the age of a torque \[J\].
const ROUNDING_J: f64 = 1e-4;

/// Result of a run, from the loss on.
struct Run {
    stages: Vec<&'static str>,
    /// Maximum time for which a joint was above its limit while the loop held the arm or laid it down \[s\].
    fast_s: f64,
    /// Maximum work of the motors in a cycle while they damped \[J\].
    damping_work_j: f64,
    reason: Option<LossReason>,
    ended: bool,
}

fn run(motor: usize, offset_rad: f64) -> Run {
    let spec = format!("zero:motor={motor},offset-rad={offset_rad}");
    let start_rad = Vector::from([0.6, 0.3, 0.0, 1.2, 0.0, 0.0, 0.0]);
    let mut rig = Rig::<7>::new_at("openarm", start_rad, &[&spec]);
    rig.enable();
    rig.plant.link_mut().dead = true;
    let (mut fast_s, mut damping_work_j, mut reason) = (0.0_f64, f64::MIN, None);
    let (mut above_s, mut damped_cycles) = (0.0, 0);
    for _ in 0..30_000 {
        rig.step();
        let velocity = rig.arm().truth().velocity_rad_per_s;
        let stage = rig.plant.guard().stage();
        let holds = matches!(stage, Stage::Holding(..) | Stage::Stowing(..));
        above_s = if holds && velocity.amax() > LIMIT_RAD_PER_S {
            above_s + 1e-3
        } else {
            0.0
        };
        fast_s = fast_s.max(above_s);
        if let Stage::Damping(of, _) = stage {
            reason = Some(of);
            damped_cycles += 1;
            let report = rig.plant.link_mut().report.expect("a report");
            assert!(damped_cycles == 1 || report.drives == Drives::Held);
            // The holding torque fades in 5 ms and acts two cycles later.
            if damped_cycles > 8 {
                let work_j = rig.arm().motor_torque_nm().dot(&velocity) * 1e-3;
                damping_work_j = damping_work_j.max(work_j);
            }
        }
        if matches!(stage, Stage::Resting) && rig.all(Status::Disabled) {
            break;
        }
    }
    Run {
        stages: rig.stage_names(),
        fast_s,
        damping_work_j,
        reason,
        ended: rig.all(Status::Disabled),
    }
}

/// Expected: the holding torque accelerates the shoulder beyond its speed limit, and ends within 25 ms after that. From then on,
/// the motors take energy from the arm; they are disabled at standstill.
#[test]
fn overspeed_while_the_arm_is_held_leads_to_damping() {
    let run = run(1, -1.0);
    assert_eq!(
        run.stages,
        [
            "resting", "active", "holding", "damping", "lowering", "resting"
        ]
    );
    assert_eq!(run.reason, Some(LossReason::OverspeedInHold(0)));
    assert!(run.fast_s < FAST_S, "{} s", run.fast_s);
    assert!(run.damping_work_j < ROUNDING_J, "{} J", run.damping_work_j);
    assert!(run.ended);
}

/// Expected for other joints and the other direction: no joint stays above its limit, whether the torque ends or not.
#[test]
fn no_wrong_zero_keeps_a_joint_above_its_limit() {
    for (motor, offset_rad) in [(1, 1.0), (2, 1.0), (4, 1.0), (4, -1.0)] {
        let run = run(motor, offset_rad);
        assert!(
            run.fast_s < FAST_S,
            "{motor}, {offset_rad} rad: {} s",
            run.fast_s
        );
        assert!(run.damping_work_j < ROUNDING_J, "{motor}, {offset_rad} rad");
        assert!(run.ended, "{motor}, {offset_rad} rad: {:?}", run.stages);
    }
}
