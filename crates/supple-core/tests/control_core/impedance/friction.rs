//! The friction feed-forward has no stiffness; its dry part fades, the other parts stay.

use crate::support::arms::{wam3, wam4};
use crate::support::configs::{four, friction};
use crate::support::property::{check, vector3};
use crate::support::states::{Scene, scene};
use proptest::prelude::*;
use supple_core::config::{FrictionVelocity, Gains, Law, Role};
use supple_core::impedance::{HeldFriction, LawInput, PositionTarget, SINGULAR_BELOW_M, impedance};
use supple_core::{Friction, Vector};

fn law(friction_velocity: FrictionVelocity) -> Law {
    Law {
        friction_velocity,
        ..Law::as_published(Gains::isotropic(5.0, 1.5))
    }
}

fn feedforward(scene: &Scene<4>, velocity: FrictionVelocity) -> Vector<4> {
    let config = four();
    scene
        .torques(
            &law(velocity),
            &friction(),
            &config.arm,
            &config.roles,
            None,
        )
        .friction
}

/// The torques are bit-identical; any stiffness in the friction term would change them.
#[test]
fn friction_feedforward_is_independent_of_the_position_error() {
    check(300, (scene::<4>(), vector3(2.0)), |(scene, position)| {
        for velocity in [FrictionVelocity::Reference, FrictionVelocity::Measured] {
            let mut elsewhere = scene.clone();
            elsewhere.reference.position = position;
            prop_assert_eq!(
                feedforward(&scene, velocity),
                feedforward(&elsewhere, velocity)
            );
        }
        Ok(())
    });
}

#[test]
fn friction_at_the_reference_velocity_does_not_depend_on_the_measured_velocity() {
    check(300, (scene::<4>(), vector3(2.0)), |(scene, other)| {
        let mut moving = scene.clone();
        moving.qd = Vector::<4>::new(other.x, other.y, 0.3, other.z);
        let reference = FrictionVelocity::Reference;
        prop_assert_eq!(
            feedforward(&scene, reference),
            feedforward(&moving, reference)
        );
        let measured = FrictionVelocity::Measured;
        prop_assert_ne!(
            feedforward(&scene, measured),
            feedforward(&moving, measured)
        );
        Ok(())
    });
}

#[test]
fn friction_feedforward_equals_the_model() {
    let (arm, roles) = (wam3(), [Role::Active; 3]);
    check(300, scene::<3>(), |mut scene| {
        scene.friction_share = 1.0;
        let task = scene.task(&arm, &roles);
        let model: [Friction; 3] = friction();
        let joint_velocity = task.inverse * scene.reference.velocity;
        for (kind, velocity) in [
            (FrictionVelocity::Reference, joint_velocity),
            (FrictionVelocity::Measured, scene.qd),
        ] {
            let found = scene
                .torques(&law(kind), &model, &arm, &roles, None)
                .friction;
            for i in 0..3 {
                let expected = model[i].torque_nm(velocity[i]);
                prop_assert!((found[i] - expected).abs() < 1e-13 * (1.0 + expected.abs()));
            }
        }
        Ok(())
    });
}

/// Fading scales the dry part of all joints equally; the other parts stay.
#[test]
fn fading_keeps_offset_and_viscous_friction() {
    let config = four();
    let wet: [Friction; 4] = friction().map(|friction| Friction {
        coulomb_nm: 0.0,
        breakaway_nm: 0.0,
        ..friction
    });
    check(300, scene::<4>(), |scene| {
        let at = |model: &[Friction; 4], share: f64| {
            let faded = Scene {
                friction_share: share,
                ..scene.clone()
            };
            let law = law(FrictionVelocity::Reference);
            faded
                .torques(&law, model, &config.arm, &config.roles, None)
                .friction
        };
        let model = friction();
        let (none, half, whole) = (at(&model, 0.0), at(&model, 0.5), at(&model, 1.0));
        let tolerance = 1e-13 * (1.0 + whole.norm());
        prop_assert!((none - at(&wet, 1.0)).norm() < tolerance);
        prop_assert!((half * 2.0 - whole - none).norm() < tolerance);
        Ok(())
    });
}

/// A held joint has no moving reference: its feed-forward is the offset only.
#[test]
fn held_joints_get_only_their_friction_offset() {
    check(200, scene::<4>(), |scene| {
        for velocity in [FrictionVelocity::Reference, FrictionVelocity::Measured] {
            let found = feedforward(&scene, velocity)[2];
            prop_assert_eq!(found, friction::<4>()[2].offset_nm);
        }
        Ok(())
    });
}

/// Reason for using the reference's velocity: with an exact monotone model, the remaining friction
/// removes energy from the motion of the error for any motion of the arm.
#[test]
fn the_residual_friction_damps_the_error() {
    let (arm, roles) = (
        wam4(),
        [Role::Active, Role::Active, four().roles[2], Role::Active],
    );
    let model = [Friction::coulomb(1.0, 1.5); 4];
    check(300, scene::<4>(), |mut scene| {
        scene.friction_share = 1.0;
        scene.qd[2] = 0.0;
        let task = scene.task(&arm, &roles);
        if task.min_singular_value_m < SINGULAR_BELOW_M {
            return Ok(());
        }
        let found = scene
            .torques(
                &law(FrictionVelocity::Reference),
                &model,
                &arm,
                &roles,
                None,
            )
            .friction;
        let real = Vector::<4>::from_fn(|i, _| model[i].torque_nm(scene.qd[i]));
        let error_velocity = scene.qd - task.inverse * scene.reference.velocity;
        let power = (found - real).dot(&error_velocity);
        prop_assert!(power <= 1e-12, "{power} W");
        Ok(())
    });
}

/// With a Stribeck effect at another velocity, the feed-forward has the friction of that speed in the direction of the reference: it falls
/// while the joint moves faster and gains no more than the breakaway torque while it rests. At the same velocity, it has the same bits.
#[test]
fn the_stribeck_effect_may_follow_another_velocity() {
    let config = four();
    let model: [Friction; 4] = friction().map(|friction| Friction {
        breakaway_nm: friction.coulomb_nm + 0.3,
        stribeck_offset_nm: -0.05,
        ..friction
    });
    check(
        300,
        (scene::<4>(), 0.0..0.5, 0.0..0.5),
        |(scene, slow, more)| {
            let task = scene.task(&config.arm, &config.roles);
            if task.min_singular_value_m < SINGULAR_BELOW_M {
                return Ok(());
            }
            let reference = task.inverse * scene.reference.velocity;
            let at = |velocity: &Vector<4>| {
                let target = PositionTarget {
                    reference: &scene.reference,
                    gains: &scene.gains,
                    spring_limit_n: f64::INFINITY,
                };
                let input = LawInput {
                    friction: Some((&model, FrictionVelocity::Reference)),
                    stribeck_velocity_rad_per_s: Some(velocity),
                    ..LawInput::new(target, &scene.qd)
                };
                impedance(&config.roles, &scene.terms(&config.arm), &task, &input).friction
            };
            let whole: Vec<f64> = (0..4).map(|i| model[i].torque_nm(reference[i])).collect();
            prop_assert_eq!(at(&reference), Vector::<4>::from_column_slice(&whole));
            let (rest, slower, faster) = (
                at(&Vector::zeros()),
                at(&Vector::repeat(slow)),
                at(&Vector::repeat(slow + more)),
            );
            for i in (0..4).filter(|i| config.roles[*i] == Role::Active) {
                let direction = model[i].direction(reference[i]);
                // The offset that falls has the same sign for both directions of motion.
                let dry = |torque: &Vector<4>, velocity: f64| {
                    (torque[i] - model[i].offset_at_nm(velocity)) * direction.signum()
                };
                let (rest, slower, faster) = (
                    dry(&rest, 0.0),
                    dry(&slower, slow),
                    dry(&faster, slow + more),
                );
                prop_assert!(
                    rest >= slower && slower >= faster,
                    "{rest} {slower} {faster}"
                );
                prop_assert!(rest - faster <= 0.3 + 1e-12);
            }
            Ok(())
        },
    );
}

/// In contact a joint that moves faster than its reference did keeps no more friction than that of its own speed; one that moves slower
/// keeps that of its reference, not the breakaway torque of a joint at rest.
#[test]
fn friction_in_contact_does_not_drive_a_joint() {
    let config = four();
    let model: [Friction; 4] = friction().map(|friction| Friction {
        breakaway_nm: friction.coulomb_nm + 0.3,
        presliding_rad: 1e-3,
        ..friction
    });
    check(
        300,
        (scene::<4>(), 0.0..0.5, 0.0..0.5, -1.0..1.0),
        |(scene, kept, measured, direction)| {
            let task = scene.task(&config.arm, &config.roles);
            let directions = Vector::repeat(direction);
            let kept_velocity = Vector::repeat(kept);
            let at = |measured: f64| {
                let measured = Vector::repeat(measured);
                let target = PositionTarget {
                    reference: &scene.reference,
                    gains: &scene.gains,
                    spring_limit_n: f64::INFINITY,
                };
                let input = LawInput {
                    friction: Some((&model, FrictionVelocity::Reference)),
                    stribeck_velocity_rad_per_s: Some(&measured),
                    dry_direction: Some(&directions),
                    held_friction: Some(HeldFriction {
                        velocity_rad_per_s: &kept_velocity,
                        weight: 1.0,
                        viscous_share: 0.0,
                    }),
                    ..LawInput::new(target, &scene.qd)
                };
                impedance(&config.roles, &scene.terms(&config.arm), &task, &input).friction
            };
            let (forward, backward) = (at(measured), at(-measured));
            prop_assert_eq!(forward, backward);
            for i in (0..4).filter(|i| config.roles[*i] == Role::Active) {
                let dry_nm = (forward[i] - model[i].offset_nm) * direction.signum();
                let size_nm = model[i].dry_size_nm(measured.max(kept)) * direction.abs();
                prop_assert!((dry_nm - size_nm).abs() < 1e-12, "joint {}", i + 1);
            }
            Ok(())
        },
    );
}
