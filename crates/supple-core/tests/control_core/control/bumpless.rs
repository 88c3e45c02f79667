//! Changes of mode with the arm in the loop: the torque does not jump, faults are not blended, and
//! the blended torque decays to zero.

use crate::support::configs::{four, seven_active, stop_limited, three};
use crate::support::plant::Plant;
use crate::support::rig::{Rig, bent, bent_wrist, probe_at};
use crate::support::size;
use supple_core::controller::{Mode, Request};
use supple_core::math::Vector3;
use supple_core::trajectory::Rotation;
use supple_core::{Config, Input, Output, Trajectory, Vector};

/// Maximum change of torque from one cycle to the next \[N m\].
fn max_step<const N: usize>(outputs: &[Output<N>]) -> f64 {
    outputs
        .windows(2)
        .map(|pair| size(&(pair[1].torque_nm - pair[0].torque_nm)))
        .fold(0.0, f64::max)
}

/// A controller with its arm, after `seconds` in each requested mode.
struct Run<const N: usize> {
    rig: Rig<N>,
    plant: Plant<N>,
    last: Vec<Output<N>>,
}

impl<const N: usize> Run<N> {
    fn new(config: Config<N>) -> Self {
        Run::at(config, bent())
    }

    fn at(config: Config<N>, pose: Vector<N>) -> Self {
        let mut run = Run {
            rig: Rig::new(config, pose),
            plant: Plant::at_rest(config.arm, pose),
            last: Vec::new(),
        };
        run.rig.cycle();
        run.go(Some(Request::GravityHold), 1000);
        run
    }

    fn go(&mut self, request: Option<Request<N>>, cycles: usize) {
        let nothing = crate::support::plant::nothing;
        let first = self.rig.drive(&mut self.plant, request, nothing);
        assert_eq!((first.refusal, first.fault), (None, None), "{request:?}");
        self.last = vec![first];
        for _ in 1..cycles {
            let output = self.rig.run(&mut self.plant);
            assert_eq!(output.fault, None, "{request:?}");
            self.last.push(output);
        }
    }

    /// Changes the mode and compares the torque steps with those before and after.
    fn change(&mut self, request: Request<N>, handover_s: f64) {
        let before = self.last.clone();
        self.go(Some(request), 600);
        let (last, now) = (&before[before.len() - 1], &self.last);
        let jump = size(&(now[0].torque_nm - last.torque_nm));
        assert!(jump < 1e-9, "{request:?} jumps by {jump} N m");
        // The blending of an offset over the handover has a peak rate of 1.875 times its mean rate.
        let blend = 1.875 * size(&now[0].torques.handover) / handover_s * 1e-3;
        let settled = &now[now.len() / 2..];
        let ordinary = max_step(&before).max(max_step(settled));
        let step = max_step(now);
        assert!(
            step <= blend * 1.01 + ordinary + 0.05,
            "{request:?}: {step} N m in a cycle, blending {blend}, ordinarily {ordinary}"
        );
        let over = (handover_s / 1e-3).ceil() as usize;
        for (k, output) in now.iter().enumerate() {
            let left = size(&output.torques.handover);
            let whole = size(&now[0].torques.handover);
            assert!(left <= whole, "the remainder only shrinks");
            assert!(k < over || left == 0.0, "{left} N m left after {k} cycles");
            if let Some(next) = now.get(k + 1) {
                assert!(size(&next.torques.handover) <= left);
            }
        }
    }
}

/// Into the pose mode and out of it, with loaded springs.
#[test]
fn of_7_active_joints() {
    let config = seven_active();
    let handover_s = config.handover_s;
    let mut run = Run::at(config, bent_wrist());
    let pose = |run: &Run<7>| {
        let tip = supple_core::dynamics::tip_pose(&run.plant.arm, &run.plant.q).translation;
        Request::TrackPose {
            trajectory: Trajectory::Hold(tip + Vector3::new(0.02, 0.01, -0.02)),
            rotation: Rotation {
                axis: Vector3::new(0.0, 0.6, 0.8),
                angle_rad: 0.2,
                duration_s: 1.0,
            },
        }
    };
    run.change(pose(&run), handover_s);
    run.change(pose(&run), handover_s);
    run.change(Request::GravityHold, handover_s);
    run.change(pose(&run), handover_s);
    run.change(Request::GravityHold, handover_s);
    assert_eq!(run.rig.state.mode(), Mode::GravityHold);
}

fn through_all_modes<const N: usize>(config: Config<N>) {
    let handover_s = config.handover_s;
    let mut run = Run::new(config);
    let mut target = run.plant.q;
    target[1] += 0.1;
    let near = |run: &Run<N>| {
        // Not exactly at the tip: the spring is loaded from the start.
        let tip = supple_core::dynamics::tip_pose(&run.plant.arm, &run.plant.q).translation;
        Request::Track(Trajectory::Hold(tip + Vector3::new(0.02, 0.01, -0.02)))
    };
    for (i, role) in config.roles.iter().enumerate() {
        if let supple_core::config::Role::Held { position_rad, .. } = role {
            target[i] = *position_rad;
        }
    }
    run.change(
        Request::Move {
            target_rad: target,
            duration_s: 0.5,
        },
        handover_s,
    );
    run.change(near(&run), handover_s);
    run.change(Request::GravityHold, handover_s);
    run.change(near(&run), handover_s);
    let tip = supple_core::dynamics::tip_pose(&run.plant.arm, &run.plant.q).translation;
    run.change(Request::Track(probe_at(&tip)), handover_s);
    target[1] += 0.1;
    run.change(
        Request::Move {
            target_rad: target,
            duration_s: 0.5,
        },
        handover_s,
    );
    run.change(Request::GravityHold, handover_s);
    // A spring that is loaded from the start: the target is 0.1 rad away within 0.5 s.
    target[1] -= 0.1;
    let comply = Request::JointImpedance {
        target_rad: target,
        duration_s: 0.5,
    };
    run.change(comply, handover_s);
    run.change(near(&run), handover_s);
    run.change(Request::Float, handover_s);
    run.change(comply, handover_s);
    run.change(Request::Float, handover_s);
    run.change(Request::GravityHold, handover_s);
    assert_eq!(run.rig.state.mode(), Mode::GravityHold);
}

#[test]
fn of_3_joints() {
    through_all_modes(three());
}

#[test]
fn of_4_joints() {
    through_all_modes(four());
}

/// A second change of mode before the blending of the first has ended.
#[test]
fn a_second_change_during_blending_causes_no_torque_step() {
    let mut run = Run::new(four());
    let mut previous = run.last[run.last.len() - 1].torque_nm;
    for k in 0..40 {
        let request = match k % 4 {
            0 => Request::Track(Trajectory::Hold(
                supple_core::dynamics::tip_pose(&run.plant.arm, &run.plant.q).translation
                    + Vector3::new(0.03, 0.0, -0.02),
            )),
            1 => Request::GravityHold,
            2 => {
                let mut target_rad = run.plant.q;
                target_rad[2] = 0.0;
                Request::Move {
                    target_rad,
                    duration_s: 1.0,
                }
            }
            _ => Request::Gains {
                gains: supple_core::config::Gains::isotropic(10.0 * f64::from(k), 5.0),
                ramp_s: 0.05,
            },
        };
        run.go(Some(request), 7);
        let jump = size(&(run.last[0].torque_nm - previous));
        assert!(jump < 0.05, "{jump} N m at change {k}");
        previous = run.last[6].torque_nm;
    }
}

/// After a fault the safe action takes effect at once, within the rate limit.
#[test]
fn a_fault_is_not_blended() {
    for request in [
        Request::Track(Trajectory::Hold(Vector3::zeros())),
        Request::Move {
            target_rad: bent::<4>() + Vector::<4>::new(0.3, 0.2, 0.0, 0.2),
            duration_s: 1.0,
        },
    ] {
        let mut config = four();
        config.limits.start_error_m = 5.0;
        config.limits.tracking_error_m = 5.0;
        let mut run = Run::new(config);
        run.go(Some(request), 50);
        run.rig.q = run.plant.q;
        let before = run.last[49].torque_nm;
        let output = run.rig.step(&Input {
            tip_force_n: Some(Vector3::repeat(f64::NAN)),
            ..run.rig.input()
        });
        assert_eq!(output.mode, Mode::Fault);
        let torques = &output.torques;
        assert_eq!(torques.handover, Vector::<4>::zeros());
        let safe = torques.gravity + torques.damping;
        assert_eq!(torques.total(), safe);
        let expected = stop_limited(&config, &before, &safe);
        assert!(size(&(output.torque_nm - expected)) < 1e-9);
    }
}

/// Leaving a fault is bumpless as well.
#[test]
fn a_reset_causes_no_torque_step() {
    let mut run = Run::new(four());
    run.rig.q = run.plant.q;
    run.rig.step(&Input {
        tip_force_n: Some(Vector3::repeat(f64::NAN)),
        ..run.rig.input()
    });
    for _ in 0..300 {
        let output = run.rig.run(&mut run.plant);
        assert_eq!(output.mode, Mode::Fault);
        run.last.push(output);
    }
    run.last.drain(..run.last.len() - 200);
    run.change(Request::Reset, 0.1);
    assert_eq!(run.rig.state.mode(), Mode::GravityHold);
}

/// Whether the drives become active one cycle after the request for gravity hold or later: neither
/// blending nor the rate limit applies.
#[test]
fn enabled_drives_get_the_gravity_torque_at_once() {
    for idle_cycles in [1, 300] {
        let mut rig = Rig::new(four(), bent());
        rig.drives_active = false;
        rig.cycle();
        rig.accept(Request::GravityHold);
        rig.cycles(idle_cycles);
        rig.drives_active = true;
        let weight = supple_core::dynamics::gravity(&rig.controller.config().arm, &rig.q);
        assert!(size(&weight) > 5.0, "{weight}");
        for cycle in 0..100 {
            let torque_nm = rig.cycle().torque_nm;
            let missing = size(&(torque_nm - weight));
            assert!(missing < 1e-6, "{idle_cycles}, cycle {cycle}: {missing}");
        }
    }
}

/// A held joint is moved by hand while the arm is gravity-compensated in a fault: after the reset
/// its loop engages at its current angle and returns at the approach speed of held joints.
#[test]
fn the_loop_of_a_held_joint_moved_in_a_fault_engages_smoothly() {
    for way_rad in [0.15, 0.25, -0.4] {
        let mut rig = Rig::holding(four(), bent());
        rig.step(&Input {
            tip_force_n: Some(Vector3::repeat(f64::NAN)),
            ..rig.input()
        });
        for _ in 0..3000 {
            rig.q[2] += way_rad / 3000.0;
            assert_eq!(rig.cycle().mode, Mode::Fault);
        }
        rig.cycles(100);
        rig.accept(Request::Reset);
        for cycle in 1..=100 {
            let output = rig.cycle();
            assert_eq!(output.fault, None);
            // 600 N m/rad; the set-point moves at 0.25 rad/s while the joint does not follow.
            let limit_nm = 600.0 * 0.25e-3 * f64::from(cycle + 2);
            assert!(output.torques.joint_pd[2].abs() < limit_nm, "{output:?}");
        }
        let output = rig.cycle();
        assert!(output.torques.joint_pd[2] * way_rad < 0.0, "it goes back");
    }
}
