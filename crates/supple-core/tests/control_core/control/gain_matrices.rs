//! Stiffness and damping of the pose mode as full matrices, about the axes of the base or of the tip.

use super::posing::{free, in_mode, pose, run, turn};
use crate::support::configs::{four, seven_active};
use crate::support::plant::{Plant, nothing, push};
use crate::support::rig::{Rig, bent_wrist};
use supple_core::config::{Config, Gains, RotationalGains};
use supple_core::controller::{GainAxes, GainMatrices, GainPart, Mode, Refusal, Request};
use supple_core::dynamics::{jacobian, kinetic_energy, tip_pose};
use supple_core::math::{Matrix3, Vector3};
use supple_core::nalgebra::Rotation3;
use supple_core::trajectory::{Rotation, Trajectory};
use supple_core::{Arm, Output, Vector};

/// Eigenvalues 2, 5 and 9, about axes that are not those of the base.
fn stiffness() -> Matrix3<f64> {
    let rotation = Rotation3::from_euler_angles(0.4, -0.7, 1.1);
    let matrix =
        rotation * Matrix3::from_diagonal(&Vector3::new(2.0, 5.0, 9.0)) * rotation.inverse();
    0.5 * (matrix + matrix.transpose())
}

/// Damping relative to the stiffness \[s\], within what the delay of the loop allows about the axes of the wrist.
const DAMPING_S: f64 = 0.015;

fn request(part: GainPart, scale: f64, axes: GainAxes, ramp_s: f64) -> Request<7> {
    damped(part, scale, DAMPING_S, axes, ramp_s)
}

fn damped(part: GainPart, scale: f64, damping_s: f64, axes: GainAxes, ramp_s: f64) -> Request<7> {
    Request::GainMatrices {
        part,
        gains: GainMatrices {
            stiffness: stiffness() * scale,
            damping: stiffness() * (damping_s * scale),
        },
        axes,
        ramp_s,
    }
}

/// Scales of both matrices relative to [`stiffness`].
const LINEAR: f64 = 10.0;
const ROTATIONAL: f64 = 0.2;

fn accepted(rig: &mut Rig<7>, plant: &mut Plant<7>, request: Request<7>) -> Output<7> {
    let output = rig.drive(plant, Some(request), nothing);
    assert_eq!((output.refusal, output.fault), (None, None));
    output
}

/// Holds the tip, turned from its start by `angle_rad`, with both matrices about `axes`.
fn holding(config: Config<7>, angle_rad: f64, axes: GainAxes) -> (Rig<7>, Plant<7>) {
    let start = tip_pose(&config.arm, &bent_wrist());
    let hold = pose(Trajectory::Hold(start.translation), turn(angle_rad, 2.5));
    let (mut rig, mut plant) = in_mode(config, bent_wrist(), hold);
    accepted(
        &mut rig,
        &mut plant,
        request(GainPart::Linear, LINEAR, axes, 0.1),
    );
    let rotational = request(GainPart::Rotational, ROTATIONAL, axes, 0.1);
    accepted(&mut rig, &mut plant, rotational);
    (rig, plant)
}

/// A force and a moment move the tip according to the matrices, about the axes in which they are given, also after a rotation of
/// the tip.
#[test]
fn the_tip_yields_according_to_the_gain_matrices() {
    for (angle_rad, axes) in [
        (0.0, GainAxes::Base),
        (-0.4, GainAxes::Base),
        (-0.4, GainAxes::Tip),
    ] {
        let config = seven_active();
        let (mut rig, mut plant) = holding(config, angle_rad, axes);
        run(&mut rig, &mut plant, 6000, nothing);
        let (force_n, moment_nm) = (
            Vector3::new(0.4, 0.7, -0.5),
            Vector3::new(0.03, -0.02, 0.04),
        );
        let hand = move |arm: &Arm<7>, q: &Vector<7>, qd: &Vector<7>| {
            push(arm, q, &force_n) + jacobian(arm, q).fixed_rows::<3>(3).tr_mul(&moment_nm)
                - qd.component_mul(&Vector::from([1.0, 1.0, 1.0, 1.0, 0.05, 0.05, 0.02]))
        };
        let output = run(&mut rig, &mut plant, 20_000, hand);
        let tip = tip_pose(&plant.arm, &plant.q);
        let wanted = output.orientation.expect("one").base_from_tip;
        let to_base = match axes {
            GainAxes::Base => Matrix3::identity(),
            GainAxes::Tip => wanted,
        };
        let in_base = to_base * stiffness() * to_base.transpose();
        let moved = tip.translation - output.reference.expect("one").position;
        let error = (in_base * moved * LINEAR - force_n).norm() / force_n.norm();
        assert!(error < 0.02, "{axes:?}, {angle_rad}: {error}");
        let turned =
            Rotation3::from_matrix_unchecked(tip.rotation * wanted.transpose()).scaled_axis();
        let error = (in_base * turned * ROTATIONAL - moment_nm).norm() / moment_nm.norm();
        assert!(error < 0.03, "{axes:?}, {angle_rad}: {error}");
        // The diagonal of the same matrix would give a clearly different displacement.
        let diagonal = Matrix3::from_diagonal(&in_base.diagonal());
        assert!((diagonal * moved * LINEAR - force_n).norm() > 0.1 * force_n.norm());
    }
}

/// The same gains, given as matrices about other axes, and the start of a ramp do not change the torque.
#[test]
fn a_change_of_matrices_or_axes_causes_no_torque_step() {
    let (mut rig, mut plant) = holding(seven_active(), 0.5, GainAxes::Tip);
    let hand = |arm: &Arm<7>, q: &Vector<7>, qd: &Vector<7>| {
        push(arm, q, &Vector3::new(0.5, -0.3, 0.4)) - qd * 0.5
    };
    let before = run(&mut rig, &mut plant, 8000, hand);
    let to_base = before.orientation.expect("one").base_from_tip;
    let turned = to_base * stiffness() * to_base.transpose();
    let turned = 0.5 * (turned + turned.transpose());
    for (part, scale) in [
        (GainPart::Linear, LINEAR),
        (GainPart::Rotational, ROTATIONAL),
    ] {
        let same = Request::GainMatrices {
            part,
            gains: GainMatrices {
                stiffness: turned * scale,
                damping: turned * (DAMPING_S * scale),
            },
            axes: GainAxes::Base,
            ramp_s: 0.0,
        };
        let output = rig.drive(&mut plant, Some(same), hand);
        assert_eq!(output.refusal, None);
        let change = (output.torques.total() - before.torques.total()).amax();
        assert!(change < 1e-3, "{part:?}: {change} N m");
    }
    let changes = [
        Request::Gains {
            gains: Gains::isotropic(20.0, 1.0),
            ramp_s: 0.5,
        },
        Request::RotationalGains {
            gains: RotationalGains::isotropic(1.0, 0.015),
            ramp_s: 0.5,
        },
        request(GainPart::Linear, 2.0 * LINEAR, GainAxes::Tip, 0.5),
        request(GainPart::Linear, LINEAR, GainAxes::Base, 0.5),
    ];
    for change in changes {
        let mut last = run(&mut rig, &mut plant, 300, hand).torques.total();
        let mut request = Some(change);
        for _ in 0..600 {
            let output = rig.drive(&mut plant, request.take(), hand);
            assert_eq!((output.refusal, output.fault), (None, None));
            let step = (output.torques.total() - last).amax();
            assert!(step < 0.02, "{step} N m in a cycle");
            last = output.torques.total();
        }
    }
}

/// Energy of the arm and of the springs of the matrices about the base axes \[J\]; gravity is compensated.
fn energy_j(plant: &Plant<7>, in_base: &Matrix3<f64>, output: &Output<7>) -> f64 {
    let tip = tip_pose(&plant.arm, &plant.q);
    let error = output.reference.expect("one").position - tip.translation;
    let wanted = output.orientation.expect("one").base_from_tip;
    let turn = Rotation3::from_matrix_unchecked(wanted * tip.rotation.transpose());
    let spring = turn.axis().map_or(0.0, |axis| {
        ROTATIONAL * (1.0 - turn.angle().cos()) * axis.dot(&(in_base * *axis))
    });
    kinetic_energy(&plant.arm, &plant.q, &plant.qd)
        + 0.5 * LINEAR * error.dot(&(in_base * error))
        + spring
}

/// With the reference at rest the energy only falls, about the axes of the base as of the tip, from any error.
#[test]
fn the_energy_of_a_resting_reference_only_falls() {
    for axes in [GainAxes::Base, GainAxes::Tip] {
        for degrees in [30.0_f64, 80.0] {
            let config = free();
            let start = tip_pose(&config.arm, &bent_wrist());
            let at = start.translation + Vector3::new(0.03, -0.03, 0.02);
            let hold = pose(Trajectory::Hold(start.translation), Rotation::NONE);
            let (mut rig, mut plant) = in_mode(config, bent_wrist(), hold);
            for (part, scale) in [
                (GainPart::Linear, LINEAR),
                (GainPart::Rotational, ROTATIONAL),
            ] {
                accepted(&mut rig, &mut plant, damped(part, scale, 0.2, axes, 0.0));
            }
            let far = pose(Trajectory::Hold(at), turn(degrees.to_radians(), 1e-4));
            accepted(&mut rig, &mut plant, far);
            let output = run(&mut rig, &mut plant, 1, nothing);
            let to_base = match axes {
                GainAxes::Base => Matrix3::identity(),
                GainAxes::Tip => output.orientation.expect("one").base_from_tip,
            };
            let in_base = to_base * stiffness() * to_base.transpose();
            let first = energy_j(&plant, &in_base, &output);
            let mut before = first;
            for _ in 0..200 {
                let output = run(&mut rig, &mut plant, 50, nothing);
                let now = energy_j(&plant, &in_base, &output);
                assert!(
                    now <= before + 0.01 * first,
                    "{axes:?}: {before} J, then {now} J of {first} J"
                );
                before = now;
            }
            assert!(
                before < 0.9 * first,
                "{axes:?}: {before} J of {first} J after 2 s"
            );
        }
    }
}

/// Matrices that are not passive, beyond a limit, or impossible to apply are refused with the value, and have no effect.
#[test]
fn unusable_matrices_are_refused() {
    let config = seven_active();
    let refusal = |rig: &mut Rig<7>, plant: &mut Plant<7>, part, stiffness, damping, ramp_s| {
        let request = Request::GainMatrices {
            part,
            gains: GainMatrices { stiffness, damping },
            axes: GainAxes::Tip,
            ramp_s,
        };
        rig.drive(plant, Some(request), nothing).refusal
    };
    let (mut rig, mut plant) = holding(config, 0.0, GainAxes::Base);
    let one = Matrix3::identity();
    let asymmetric = Matrix3::new(1.0, 0.5, 0.0, 0.4, 1.0, 0.0, 0.0, 0.0, 1.0);
    let indefinite = Matrix3::new(1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let max = config.limits.stiffness_n_per_m;
    let (linear, rotational) = (GainPart::Linear, GainPart::Rotational);
    let most = config.pose.max_damping_nm_s_per_rad;
    for (part, stiffness, damping, ramp_s, value, limit) in [
        (linear, asymmetric, one, 0.0, 0.1, 0.0),
        (linear, one, indefinite, 0.0, -1.0, 0.0),
        (rotational, indefinite, one * 0.01, 0.0, -1.0, 0.0),
        (linear, one * (1.01 * max), one, 0.0, 1.01 * max, max),
        (rotational, one, one * (2.0 * most), 0.0, 2.0 * most, most),
    ] {
        match refusal(&mut rig, &mut plant, part, stiffness, damping, ramp_s) {
            Some(Refusal::Value {
                value: found,
                limit: bound,
                ..
            }) => {
                assert!(
                    (found - value).abs() < 1e-9 * value.abs().max(1.0),
                    "{found}, {value}"
                );
                assert_eq!(bound, limit);
            }
            other => panic!("{other:?}"),
        }
    }
    let not_finite = one * f64::NAN;
    assert!(refusal(&mut rig, &mut plant, linear, not_finite, one, 0.0).is_some());
    assert!(refusal(&mut rig, &mut plant, linear, one, one, f64::NAN).is_some());
    // Within the limit of the arm, but not within the delay of its loop: an off-diagonal entry counts as the diagonal does.
    let coupled = Matrix3::new(1.0, 0.9, 0.0, 0.9, 1.0, 0.0, 0.0, 0.0, 1.0);
    let damping = coupled * (0.5 * config.limits.damping_n_s_per_m);
    assert!(refusal(&mut rig, &mut plant, linear, one, damping, 0.0).is_some());
    let output = run(&mut rig, &mut plant, 1, nothing);
    assert_eq!(output.mode, Mode::TrackPose);
    let mut rig = Rig::holding(four(), Vector::zeros());
    let mut plant = Plant::at_rest(four().arm, Vector::zeros());
    let request = Request::GainMatrices {
        part: linear,
        gains: GainMatrices {
            stiffness: one,
            damping: one,
        },
        axes: GainAxes::Base,
        ramp_s: 0.0,
    };
    let refused = rig.drive(&mut plant, Some(request), nothing).refusal;
    assert!(matches!(refused, Some(Refusal::Value { limit, .. }) if limit == 6.0));
}
