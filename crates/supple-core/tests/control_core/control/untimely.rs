//! Requests at the wrong moment: a reset while the arm still moves, the same request in every cycle, a ramp on a ramp or
//! with a wrong encoder, gains that are still changing, cycle numbers that decrease in a fault.
//!
//! Criterion, fixed before the first run: no request makes an arm faster than it was, and none ends the supervision of
//! a fault.

use crate::support::configs::{four, three};
use crate::support::plant::{Plant, nothing};
use crate::support::property::{Outcome, check};
use crate::support::rig::{Rig, bent, ramp};
use crate::support::size;
use proptest::prelude::*;
use supple_core::config::Gains;
use supple_core::controller::{Breakaway, Fault, Mode, Refusal, Request, SafeAction, check_motion};
use supple_core::dynamics::kinetic_energy;
use supple_core::math::Vector3;
use supple_core::trajectory::Fourier;
use supple_core::{Config, Friction, Trajectory, Vector};

/// An arm in gravity hold that a person has set in motion, one cycle before a fault without a defect.
fn struck<const N: usize>(config: Config<N>, speed: &Vector<N>) -> (Rig<N>, Plant<N>) {
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    plant.qd = *speed;
    for _ in 0..20 {
        rig.run(&mut plant);
    }
    rig.force_n = Some(Vector3::repeat(f64::NAN));
    let output = rig.run(&mut plant);
    assert_eq!(output.safe_action, Some(SafeAction::Stop));
    rig.force_n = None;
    (rig, plant)
}

fn energy_j<const N: usize>(plant: &Plant<N>) -> f64 {
    kinetic_energy(&plant.arm, &plant.q, &plant.qd)
}

/// Requests a reset in every cycle from `after` on, and gravity hold after the reset.
fn reset_is_harmless<const N: usize>(
    config: Config<N>,
    speed: &Vector<N>,
    after: u32,
    hold_too: bool,
) -> Outcome {
    let (mut rig, mut plant) = struck(config, speed);
    let start_j = energy_j(&plant);
    let mut accepted = false;
    for k in 0..600 {
        let request = match (k >= after, accepted) {
            (true, false) => Some(Request::Reset),
            (true, true) if hold_too => Some(Request::GravityHold),
            _ => None,
        };
        let output = rig.drive(&mut plant, request, nothing);
        accepted |= request == Some(Request::Reset) && output.refusal.is_none();
        let now_j = energy_j(&plant);
        prop_assert!(
            now_j <= 1.02 * start_j + 1e-4,
            "{now_j} J from {start_j} J, {k} cycles after the fault, reset {accepted}"
        );
        prop_assert!(
            !output.torque_off,
            "the arm has no defect: it must not brake"
        );
    }
    prop_assert!(accepted, "a reset of a resting arm is accepted");
    prop_assert!(
        energy_j(&plant) < 0.05 * start_j + 1e-4,
        "the arm comes to rest"
    );
    Ok(())
}

#[test]
fn a_reset_never_sets_the_arm_in_motion() {
    let case = (
        prop::collection::vec(-1.2..1.2, 4),
        0..200_u32,
        any::<bool>(),
    );
    check(200, case, |(speed, after, hold_too)| {
        reset_is_harmless::<3>(
            three(),
            &Vector::from_column_slice(&speed[..3]),
            after,
            hold_too,
        )?;
        reset_is_harmless::<4>(
            four(),
            &Vector::from([speed[0], speed[1], 0.0, speed[3]]),
            after,
            hold_too,
        )
    });
}

#[test]
fn a_reset_of_a_moving_arm_is_refused_with_its_speed() {
    let (mut rig, mut plant) = struck(three(), &Vector::from([0.0, 1.0, 0.0]));
    let output = rig.drive(&mut plant, Some(Request::Reset), nothing);
    assert!(
        matches!(output.refusal, Some(Refusal::Value { value, limit, .. }) if value > limit),
        "{:?}",
        output.refusal
    );
    assert_eq!(output.mode, Mode::Fault);
}

/// The torque of a loaded spring must be gone after five times `handover_s` although the same request comes in every cycle.
/// An arm that falls with idle drives is not caught at speed: neither by gravity hold nor by a reset of a fault that brakes. It is
/// held again when it is as slow as an arm that sinks on shorted motors.
#[test]
fn an_arm_is_not_held_while_it_falls() {
    let config = four();
    let limit = 0.25 * config.limits.joint_speed_rad_per_s[1];
    for faulty in [false, true] {
        let (mut rig, mut plant) = struck(config, &Vector::zeros());
        let first = match faulty {
            false => Request::Reset,
            true => Request::Idle,
        };
        let output = rig.drive(&mut plant, Some(first), nothing);
        assert_eq!(output.refusal, None);
        if !faulty {
            rig.drive(&mut plant, Some(Request::Idle), nothing);
        }
        let hold = match faulty {
            false => Request::GravityHold,
            true => Request::Reset,
        };
        for (speed, accepted) in [(1.2 * limit, false), (0.8 * limit, true)] {
            for _ in 0..60 {
                plant.qd = Vector::from([0.0, speed, 0.0, 0.0]);
                rig.run(&mut plant);
            }
            plant.qd = Vector::from([0.0, speed, 0.0, 0.0]);
            let output = rig.drive(&mut plant, Some(hold), nothing);
            match output.refusal {
                None => assert!(accepted, "held at {speed} rad/s"),
                Some(Refusal::Value {
                    value,
                    limit: bound,
                    ..
                }) => {
                    assert!(
                        !accepted && value > bound && bound == limit,
                        "{value}, {bound}"
                    );
                }
                other => panic!("{other:?}"),
            }
        }
    }
}

#[test]
fn repeated_requests_do_not_keep_the_last_torque() {
    let requests: [fn(&Rig<3>) -> Request<3>; 4] = [
        |_| Request::GravityHold,
        |_| Request::Float,
        |rig| rig.joint_impedance_request(),
        |rig| Request::Move {
            target_rad: rig.q,
            duration_s: 0.5,
        },
    ];
    for every in [1, 2, 3, 7, 40] {
        for request in requests {
            let config = three();
            let mut rig = Rig::holding(config, bent());
            let tip = rig.tip() + Vector3::new(0.04, 0.0, -0.02);
            rig.accept(Request::Gains {
                gains: Gains::isotropic(600.0, 20.0),
                ramp_s: 0.0,
            });
            rig.accept(Request::Track(Trajectory::Hold(tip)));
            let loaded = rig.rest();
            let spring_nm = size(&(loaded.torque_nm - loaded.torques.gravity));
            assert!(spring_nm > 5.0, "{spring_nm}");
            let mut output = loaded;
            let cycles = (5.0 * config.handover_s / config.period_s) as usize;
            for k in 0..cycles {
                output = match k % every {
                    0 => rig.accept(request(&rig)),
                    _ => rig.cycle(),
                };
            }
            let left_nm = size(&(output.torque_nm - output.torques.gravity));
            assert!(
                left_nm < 0.02 * spring_nm,
                "{left_nm} of {spring_nm} N m left after {cycles} requests of {:?}",
                output.mode
            );
        }
    }
}

/// Mode changes in faster succession than the blending of torques cause no torque step.
#[test]
fn changes_during_a_handover_cause_no_torque_step() {
    let config = three();
    let mut rig = Rig::holding(config, bent());
    let tip = rig.tip() + Vector3::new(0.04, 0.0, -0.02);
    rig.accept(Request::Track(Trajectory::Hold(tip)));
    let mut last = rig.rest();
    let whole_nm = size(&(last.torque_nm - last.torques.gravity));
    for k in 0..60 {
        let request = match (k % 20, k / 20 % 2) {
            (0, 0) => Some(Request::GravityHold),
            (0, _) => Some(Request::Track(Trajectory::Hold(tip))),
            _ => None,
        };
        let output = match request {
            Some(request) => rig.accept(request),
            None => rig.cycle(),
        };
        let step_nm = size(&(output.torque_nm - last.torque_nm));
        // Two remainders decay at once: one at its peak rate of 1.875, one exponentially, per handover.
        let allowed_nm = (1.875 + 2.0) * whole_nm * config.period_s / config.handover_s;
        assert!(
            step_nm <= allowed_nm,
            "{step_nm} N m of {allowed_nm} in cycle {k}"
        );
        last = output;
    }
}

/// The check includes the present gains of a ramp, not only its final gains.
#[test]
fn damping_that_is_being_ramped_down_is_checked() {
    let mut config = three();
    config.limits.damping_n_s_per_m = 1e4;
    let damping = |value| Request::Gains {
        gains: Gains::isotropic(10.0, value),
        ramp_s: 0.0,
    };
    // The greatest damping that the delay allows in a pose.
    let max = |pose: Vector<3>| match Rig::holding(config, pose).request(damping(9e3)).refusal {
        Some(Refusal::Value { limit, .. }) => limit,
        other => panic!("{other:?}"),
    };
    let poses: Vec<Vector<3>> = (1..8)
        .map(|k| Vector::from([0.0, 0.9, 0.35 * f64::from(k)]))
        .collect();
    let by = |a: &&Vector<3>, b: &&Vector<3>| max(**a).total_cmp(&max(**b));
    let heavy = *poses.iter().max_by(by).expect("poses");
    let light = *poses.iter().min_by(by).expect("poses");
    let (most, less) = (max(heavy), max(light));
    assert!(less < 0.9 * most, "{less} of {most}");
    let mut rig = {
        let mut moved = Rig::holding(config, heavy);
        moved.accept(damping(0.99 * most));
        moved.accept(Request::Gains {
            gains: Gains::isotropic(10.0, 1.0),
            ramp_s: 3600.0,
        });
        let steps = 4000;
        for k in 1..=steps {
            moved.q = heavy + (light - heavy) * (f64::from(k) / f64::from(steps));
            moved.cycle();
        }
        moved.rest();
        moved
    };
    let output = rig.request(Request::Track(Trajectory::Hold(rig.tip())));
    assert!(
        matches!(output.refusal, Some(Refusal::Value { .. })),
        "{:?}",
        output.refusal
    );
}

/// A fast motion of short duration within a long excitation: 128 samples of the whole would fall on its reversals.
#[test]
fn every_period_of_an_excitation_is_checked() {
    let mut config = three();
    config.limits.joint_speed_rad_per_s = Vector::repeat(20.0);
    let mut series = Fourier::at_rest(bent(), 8.0);
    let amplitude = 0.4;
    series.cosine_rad[0] = Vector::from([0.0, amplitude, 0.0]);
    let controller = supple_core::Controller::new(config).expect("a valid configuration");
    let periods = |count: f64| {
        let mut series = series;
        series.ramp_s = series.period_s();
        // Samples at 128 equal intervals would all be at reversals of so many half-periods.
        series.duration_s = count * series.period_s() + 2.0 * series.ramp_s;
        series
    };
    let q: Vector<3> = series.at(0.0).position_rad;
    for count in [1.0, 62.0, 63.0, 64.0, 126.0] {
        let refusal = check_motion(&controller, &q, &Request::Excite(periods(count)));
        assert!(
            matches!(refusal, Err(Refusal::Value { value, limit, .. }) if value > limit),
            "{count} periods: {refusal:?}"
        );
    }
}

#[test]
fn cycle_numbers_that_decrease_do_not_end_the_supervision_of_a_fault() {
    let config = three();
    let (mut rig, mut plant) = struck(config, &Vector::from([0.3, 0.3, 0.3]));
    rig.cycle = 0;
    // A person pushes with the force of the motors, so that the arm continues to move.
    let push = |_: &supple_core::Arm<3>, _: &Vector<3>, qd: &Vector<3>| qd.map(|v| 60.0 * v);
    for k in 0..400 {
        let output = rig.drive(&mut plant, None, push);
        if output.torque_off {
            assert!(k < 300, "{k}");
            return;
        }
    }
    panic!("an arm that moves on for 0.4 s does not brake");
}

#[test]
fn a_ramp_during_a_move_is_refused() {
    let mut rig = Rig::holding(three(), bent());
    let mut target_rad: Vector<3> = rig.q;
    target_rad[1] += 0.05;
    rig.accept(Request::Move {
        target_rad,
        duration_s: 1.0,
    });
    rig.cycles(300);
    let output = rig.request(Request::Breakaway(ramp()));
    assert!(output.refusal.is_some(), "the set-points still move");
    assert_eq!(output.mode, Mode::Move);
}

/// The model lacks a fifth of the weight; position loops hold it, then ramps on the same and on another joint begin.
#[test]
fn consecutive_ramps_hold_the_torque_that_the_model_lacks() {
    let config = three();
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    let heavy = |arm: &supple_core::Arm<3>, q: &Vector<3>, qd: &Vector<3>| {
        supple_core::dynamics::gravity(arm, q) * -0.2 - qd * 4.0
    };
    let target_rad: Vector<3> = rig.q;
    rig.drive(
        &mut plant,
        Some(Request::Move {
            target_rad,
            duration_s: 0.5,
        }),
        heavy,
    );
    for _ in 0..2000 {
        rig.drive(&mut plant, None, heavy);
    }
    let start = plant.q;
    let slow = |joint, rate_nm_per_s| {
        Request::Breakaway(supple_core::controller::Breakaway {
            joint,
            rate_nm_per_s,
            ..ramp()
        })
    };
    for request in [slow(1, 0.05), slow(1, -0.05), slow(2, 0.05), slow(1, 0.05)] {
        let output = rig.drive(&mut plant, Some(request), heavy);
        assert_eq!((output.refusal, output.fault), (None, None));
        for _ in 0..20 {
            let output = rig.drive(&mut plant, None, heavy);
            assert_eq!(output.mode, Mode::Breakaway);
        }
        let moved = size(&(plant.q - start));
        assert!(moved < 2e-3, "{moved} rad after {request:?}");
    }
}

/// Runs a breakaway ramp whose encoder measures a combination (`shown`) of true and initial angle; returns the first fault, the
/// largest speed of the tip \[m/s\], and the mode at the end of the ramp or of the fault.
fn ramped(shown: impl Fn(f64, f64) -> f64) -> (Option<Fault>, f64, Mode) {
    let mut config = three();
    let dry_nm = 1.0;
    config.friction[1] = Friction::coulomb(0.0, dry_nm);
    config.plausible.stuck_rad = 0.1;
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    // Smoothed dry friction holds the joint up to about `dry_nm`.
    let friction = |_: &supple_core::Arm<3>, _: &Vector<3>, qd: &Vector<3>| {
        Vector::from([-4.0 * qd[0], -dry_nm * (qd[1] / 0.002).tanh(), -4.0 * qd[2]])
    };
    let start: Vector<3> = plant.q;
    // The encoder has resolved presliding before.
    rig.q[1] += 5e-5;
    rig.cycle();
    rig.q[1] -= 5e-5;
    rig.rest();
    let mut speed_m_per_s = 0.0_f64;
    let mut request = Some(Request::Breakaway(ramp()));
    for _ in 0..9000 {
        rig.q = plant.q;
        rig.q[1] = shown(plant.q[1], start[1]);
        let output = rig.step(&supple_core::Input {
            request: request.take(),
            ..rig.input()
        });
        assert_eq!(output.refusal, None);
        plant.advance(&output.torque_nm, friction, config.period_s, 4);
        let jacobian = supple_core::dynamics::jacobian(&plant.arm, &plant.q);
        speed_m_per_s = speed_m_per_s.max(size(&(jacobian.fixed_rows::<3>(0) * plant.qd)));
        if output.mode != Mode::Breakaway {
            return (output.fault, speed_m_per_s, output.mode);
        }
    }
    panic!("the ramp does not end");
}

/// Fixed before the run: an encoder that no longer changes, or has the wrong sign, ends the ramp with its fault before the
/// tip is faster than 0.25 m/s; with a correct encoder the ramp ends without a fault.
#[test]
fn a_ramp_ends_with_a_wrong_encoder() {
    let (fault, speed, _) = ramped(|_, start| start);
    assert!(
        matches!(fault, Some(Fault::EncoderStuck { joint: 1, .. })),
        "{fault:?}"
    );
    assert!(speed < 0.25, "{speed} m/s");
    let (fault, speed, _) = ramped(|true_rad, start| 2.0 * start - true_rad);
    assert!(
        matches!(fault, Some(Fault::MotionAgainstTorque { joint: 1, .. })),
        "{fault:?}"
    );
    assert!(speed < 0.25, "{speed} m/s");
    let (fault, _, mode) = ramped(|true_rad, _| true_rad);
    assert_eq!((fault, mode), (None, Mode::GravityHold));
}

/// If a joint moves against a ramp of less than half of its breakaway torque, it is pushed, or its gravity torque is wrong; if it
/// moves against more torque, its encoder has the wrong sign.
#[test]
fn a_push_against_a_weak_ramp_ends_it_without_a_fault() {
    for (share, is_fault) in [(0.3, false), (0.7, true)] {
        let mut config = four();
        (
            config.friction[1].coulomb_nm,
            config.friction[1].breakaway_nm,
        ) = (2.0, 2.0);
        let mut rig = Rig::holding(config, bent());
        let rate_nm_per_s = 1.0;
        rig.accept(Request::Breakaway(Breakaway {
            joint: 1,
            rate_nm_per_s,
            stop_rad: 0.035,
            limit_nm: 4.0,
        }));
        let cycles = (1e3 * share * 2.0 / rate_nm_per_s) as u32;
        let fault = (0..cycles + 200).find_map(|cycle| {
            rig.q[1] -= if cycle > cycles { 4e-4 } else { 0.0 };
            rig.cycle().fault
        });
        assert_eq!(fault.is_some(), is_fault, "{share}: {fault:?}");
        let expected = if is_fault {
            Mode::Fault
        } else {
            Mode::GravityHold
        };
        assert_eq!(rig.cycle().mode, expected);
    }
}
