//! Encoders that stick: found by their motion, by their references, or by the torque on their motors.

use super::protecting::guarded;
use crate::support::rig::{Rig, bent};
use supple_core::Vector;
use supple_core::config::{Collision, Config, Gains};
use supple_core::controller::{Fault, Request, SafeAction};
use supple_core::math::Vector3;
use supple_core::trajectory::{Line, Sinusoid, Trajectory};

/// Joints for which only the check of motion is active: their friction holds any torque.
fn of_motion() -> Config<4> {
    let mut config = guarded();
    config.plausible.stuck_rad = 0.1;
    config.collision = Collision::disabled();
    for friction in &mut config.friction {
        (friction.coulomb_nm, friction.breakaway_nm) = (20.0, 20.0);
    }
    config
}

/// A stuck encoder of a moving joint, and one whose reference moves.
#[test]
fn a_stuck_encoder_faults() {
    let mut rig = Rig::holding(of_motion(), bent());
    for _ in 0..300 {
        rig.q[0] += 6e-4;
        assert_eq!(rig.cycle().fault, None);
    }
    let found = (0..100).find(|_| rig.cycle().fault.is_some());
    assert!(found.is_some(), "0.6 rad/s to nothing at once");
    assert_eq!(rig.state.safe_action(), Some(SafeAction::Brake));
}

/// Two motors drive joints 1 and 2 together, as the differential of a WAM: with the encoder of one stuck, the angles of both
/// joints still change, each by half of the motion.
#[test]
fn a_stuck_encoder_of_a_motor_of_two_joints_faults() {
    let moved = |stuck: bool| {
        let mut config = of_motion();
        for (joint, sign) in [(1, 1.0), (2, -1.0)] {
            config.joint_from_motor[(joint, 1)] = 0.02;
            config.joint_from_motor[(joint, 2)] = 0.02 * sign;
        }
        let mut rig = Rig::holding(config, bent());
        for _ in 0..300 {
            rig.q[1] += 6e-4;
            assert_eq!(rig.cycle().fault, None);
        }
        (0..60).find_map(|_| {
            let step = if stuck { 3e-4 } else { 6e-4 };
            rig.q[1] += step;
            rig.q[2] -= if stuck { step } else { 0.0 };
            rig.cycle().fault
        })
    };
    assert_eq!(moved(false), None);
    let fault = moved(true);
    assert!(
        matches!(fault, Some(Fault::EncoderStuck { joint: 1, .. })),
        "{fault:?}"
    );
}

/// An impact that stops a joint within three cycles, and friction that holds it afterwards, are no stuck encoder; an encoder
/// that measures the joint's full speed and then no motion is stuck.
#[test]
fn an_impact_is_no_stuck_encoder() {
    let stopped = |last_steps: &[f64]| {
        let mut rig = Rig::holding(of_motion(), bent());
        // Slower than a fifth of the speed limit: the joint does not count as fast. Its first step is one count.
        for k in 0..300 {
            rig.q[0] += if k == 0 { 5e-5 } else { 3e-4 };
            assert_eq!(rig.cycle().fault, None);
        }
        for step in last_steps {
            rig.q[0] += step;
            assert_eq!(rig.cycle().fault, None);
        }
        (0..300).find_map(|_| rig.cycle().fault)
    };
    assert_eq!(stopped(&[2.5e-4, 1.6e-4, 0.6e-4]), None);
    let fault = stopped(&[]);
    assert!(
        matches!(fault, Some(Fault::EncoderStuck { joint: 0, .. })),
        "{fault:?}"
    );
}

/// In a mode with joint references, encoders that have all stopped count as stuck after half of the distance for which a single
/// encoder may be unchanged, if they are too coarse to resolve presliding. Under the impedance law dry friction may hold all
/// joints.
#[test]
fn all_encoders_stuck_at_once_fault_sooner() {
    let stuck = |of_tip: bool, jitter_rad: f64| {
        let mut config = of_motion();
        config.latch.threshold_n = 1e3;
        let mut rig = Rig::holding(config, bent());
        let from_m = rig.tip();
        rig.accept(match of_tip {
            true => Request::Track(Trajectory::Line(Line {
                from_m,
                to_m: from_m - Vector3::new(0.0, 0.0, 0.15),
                duration_s: 2.0,
            })),
            false => Request::JointImpedance {
                target_rad: bent::<4>() + Vector::<4>::new(0.3, 0.3, 0.0, 0.3),
                duration_s: 2.0,
            },
        });
        for k in 0..2000 {
            rig.q[2] += if k % 2 == 0 { jitter_rad } else { -jitter_rad };
            if let Some(fault) = rig.cycle().fault {
                return fault;
            }
        }
        panic!("no fault");
    };
    for (of_tip, jitter_rad, expected_rad) in
        [(false, 0.0, 0.05), (false, 1e-6, 0.1), (true, 0.0, 0.1)]
    {
        let Fault::EncoderStuck {
            value_rad,
            limit_rad,
            ..
        } = stuck(of_tip, jitter_rad)
        else {
            panic!("another fault");
        };
        assert_eq!(limit_rad, expected_rad);
        assert!(
            value_rad < 1.02 * limit_rad,
            "{value_rad} rad before the fault"
        );
    }
}

/// Dry friction may hold a joint whose reference only swings a little about its angle, however often; a reference that moves away
/// shows that the encoder is stuck.
#[test]
fn a_reference_that_swings_about_a_resting_joint_is_no_stuck_encoder() {
    let tracked = |amplitude_m: f64| {
        let mut config = of_motion();
        config.latch.threshold_n = 1e3;
        let mut rig = Rig::holding(config, bent());
        rig.accept(Request::Track(Trajectory::Sinusoid(Sinusoid {
            centre_m: rig.tip(),
            amplitude_m: Vector3::new(0.0, 0.0, amplitude_m),
            angular_frequency_rad_per_s: 2.0,
            ramp_s: 1.0,
        })));
        (0..20_000).find_map(|_| rig.cycle().fault)
    };
    assert_eq!(tracked(0.02), None);
    let fault = tracked(0.1);
    assert!(
        matches!(fault, Some(Fault::EncoderStuck { .. })),
        "{fault:?}"
    );
}

/// A contact during which no encoder has changed is caused by stuck encoders and does not suspend the check. A contact during
/// which the arm moved suspends the check until the reference is far away.
#[test]
fn stuck_encoders_are_no_contact() {
    let contact = |jolt: bool| {
        let mut config = of_motion();
        config.latch.threshold_n = 0.1;
        let mut rig = Rig::holding(config, bent());
        let down = rig.tip() - Vector3::new(0.0, 0.0, 0.12);
        rig.accept(Request::Track(Trajectory::Line(Line {
            from_m: rig.tip(),
            to_m: down,
            duration_s: 2.0,
        })));
        let (mut latched, mut jolts) = (false, 0);
        for _ in 0..2000 {
            let output = rig.cycle();
            latched |= output.in_contact;
            if output.in_contact && jolt && jolts < 10 {
                rig.q[0] += 1e-6;
                jolts += 1;
            }
            if let Some(fault) = output.fault {
                return (latched, Some(fault));
            }
        }
        (latched, None)
    };
    let (latched, fault) = contact(false);
    assert!(
        latched && matches!(fault, Some(Fault::EncoderStuck { .. })),
        "{fault:?}"
    );
    assert_eq!(contact(true), (true, None));
}

/// A joint that moved when the drives became idle and is at rest when they are re-enabled does not
/// count as a stuck encoder.
#[test]
fn an_arm_stopped_by_braking_can_be_reenabled() {
    let mut rig = Rig::holding(of_motion(), bent());
    for _ in 0..300 {
        rig.q[0] += 6e-4;
        assert_eq!(rig.cycle().fault, None);
    }
    rig.drives_active = false;
    rig.rest();
    rig.drives_active = true;
    for _ in 0..500 {
        assert_eq!(rig.cycle().fault, None);
    }
}

/// Moves the reference of the law away from a blocked arm in two seconds. The joints yield by `yielding_rad` in every tenth
/// cycle, and then rest for a second; one motor of the differential also moves back and forth by `flicker_rad`, first every 10
/// cycles, then every 50. Returns the fault, and the force of the law before the fault \[N\].
fn held_under_a_stiff_law(
    mut config: Config<4>,
    stiffness_n_per_m: f64,
    yielding_rad: f64,
    flicker_rad: f64,
) -> (Option<Fault>, f64) {
    config.plausible.stuck_rad = 1.0;
    config.collision = Collision::disabled();
    config.limits.tracking_error_m = 1.0;
    let mut rig = Rig::holding(config, bent());
    rig.accept(Request::Gains {
        gains: Gains::isotropic(stiffness_n_per_m, 5.0),
        ramp_s: 0.0,
    });
    let from_m = rig.tip();
    rig.accept(Request::Track(Trajectory::Line(Line {
        from_m,
        to_m: from_m - Vector3::new(0.0, 0.0, 0.1),
        duration_s: 2.0,
    })));
    let mut error_m = 0.0;
    for k in 0..3000 {
        let output = rig.cycle();
        if output.fault.is_some() {
            return (output.fault, stiffness_n_per_m * error_m);
        }
        error_m = output.reference.map_or(0.0, |reference| {
            (reference.position - output.tip_position_m).norm()
        });
        if k < 2000 && k % 10 == 0 {
            rig.q -= Vector::repeat(yielding_rad);
        }
        let half_cycles = if k < 2000 { 10 } else { 50 };
        if k % half_cycles == 0 {
            let up = k % (2 * half_cycles) == 0;
            let step_rad = 0.5 * if up { flicker_rad } else { -flicker_rad };
            rig.q += Vector::from([0.0, step_rad, step_rad, 0.0]);
        }
    }
    (None, stiffness_n_per_m * error_m)
}

/// A stiff law must not push with more than the dry friction while an encoder stays unchanged, independent of detected contact.
/// An encoder is not stuck if it measures how the arm yields to the torque, even if the torque remains when the arm rests, or if
/// friction holds the torque.
#[test]
fn a_stiff_law_does_not_push_a_stuck_encoder() {
    for stiffness_n_per_m in [200.0, 1000.0] {
        let (fault, force_n) = held_under_a_stiff_law(guarded(), stiffness_n_per_m, 0.0, 0.0);
        let Some(Fault::EncoderUnmoved {
            value_nm, limit_nm, ..
        }) = fault
        else {
            panic!("{fault:?} at {stiffness_n_per_m} N/m");
        };
        assert!(value_nm < 1.5 * limit_nm, "{value_nm} N m, {limit_nm} N m");
        assert!(force_n < 15.0, "{force_n} N");
        let (fault, _) = held_under_a_stiff_law(guarded(), stiffness_n_per_m, 1e-5, 0.0);
        assert_eq!(fault, None, "at {stiffness_n_per_m} N/m, yielding");
    }
    assert_eq!(held_under_a_stiff_law(guarded(), 5.0, 0.0, 0.0).0, None);
}

/// The step of a coarse encoder briefly reduces the observed torque of a loaded joint; its recovery is no growing torque.
#[test]
fn steps_of_a_coarse_encoder_under_load_are_no_growing_torque() {
    let mut config = guarded();
    config.estimator_rad_per_s = 500.0;
    for flicker_rad in [4e-4, 8e-4] {
        let (fault, force_n) = held_under_a_stiff_law(config, 200.0, 1e-5, flicker_rad);
        assert_eq!(fault, None, "{flicker_rad} rad");
        assert!(force_n > 10.0, "{force_n} N");
    }
}
