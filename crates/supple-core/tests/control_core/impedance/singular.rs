//! Near singular poses the inverse is damped by the documented amount, and no torque grows without
//! bound.

use crate::support::arms::{wam3, wam4};
use crate::support::configs::{four, friction};
use crate::support::property::check;
use crate::support::states::{Scene, scene};
use crate::support::{assert_close, inverse};
use proptest::prelude::*;
use supple_core::config::{ApparentInertia, Gains, Law, Role};
use supple_core::dynamics::crba;
use supple_core::impedance::{MAX_TASK_MASS_KG, SINGULAR_BELOW_M, singularity_damping_per_kg};
use supple_core::linalg::symmetric_eigenvalues;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, Vector};

#[test]
fn damping_is_a_smooth_function_of_the_min_singular_value() {
    let f = singularity_damping_per_kg;
    assert_eq!(SINGULAR_BELOW_M, 0.18);
    for sigma in [0.18, 0.180_001, 0.3, 1.0, 1e9] {
        assert_eq!(f(sigma), 0.0, "at {sigma}");
    }
    assert_eq!(f(0.0), 1.0 / MAX_TASK_MASS_KG);
    let h = 1e-6;
    let mut last = f(0.0);
    for k in 1..180_000 {
        let value = f(f64::from(k) * h);
        assert!(value < last, "it only falls");
        assert!(last - value < 1e-5 * h / 1e-6, "no jump");
        last = value;
    }
    assert!(last < 1e-10, "it arrives at zero, {last}");
    // The slope is zero at both ends.
    assert!((f(0.0) - f(h)) / h < 1e-5);
    assert!((f(SINGULAR_BELOW_M - h) - f(SINGULAR_BELOW_M)) / h < 1e-4);
}

#[test]
fn the_papers_sinusoid_needs_no_singularity_damping() {
    let config = four();
    for k in 0..=100 {
        let x = 0.4 + 0.4 * f64::from(k) / 100.0;
        let seed = Vector::<4>::new(0.0, 0.5, 0.0, 1.8);
        let place = supple_core::inverse_kinematics::inverse_kinematics(
            &config.arm,
            &config.roles,
            &config.limits,
            &seed,
            &Vector3::new(x, 0.0, 0.0),
        );
        assert!(
            place.reached(),
            "{x} m is {} m out of reach",
            place.distance_m
        );
        let mut terms = supple_core::dynamics::Terms::default();
        let rest = Vector::zeros();
        supple_core::dynamics::terms(&config.arm, &place.position_rad, &rest, &mut terms);
        let task = supple_core::impedance::Task::new(&terms, &config.roles).expect("a task");
        let sigma = task.min_singular_value_m;
        assert!(sigma > SINGULAR_BELOW_M - 0.01, "{sigma} at {x} m");
    }
}

/// Every term is finite, and no acceleration of the tip needs more force than with the maximum task
/// mass.
fn bounded<const N: usize>(scene: &Scene<N>, arm: &Arm<N>, roles: &[Role; N]) {
    let mass = Matrix3::from_diagonal_element(2.0);
    for inertia in [ApparentInertia::Own, ApparentInertia::Chosen(mass)] {
        let law = Law {
            inertia,
            inertial_feedforward: true,
            nullspace_damping_nm_s_per_rad: 2.0,
            ..Law::as_published(Gains::isotropic(0.0, 0.0))
        };
        let torques = scene.torques(&law, &friction(), arm, roles, Some(scene.force_n));
        for (name, torque) in torques.named() {
            let size = torque.norm();
            assert!(size < 1e3, "{name} is {size} N m at {}", scene.q);
        }
    }
    let task = scene.task(arm, roles);
    assert!(task.inverse.iter().all(|x| x.is_finite()));
}

/// Straight out, straight up (where yaw does not move the tip either), and folded back.
#[test]
fn terms_are_bounded_in_singular_poses() {
    let still = Scene {
        q: Vector::<3>::zeros(),
        qd: Vector::<3>::new(0.5, -0.4, 0.3),
        reference: supple_core::Reference {
            position: Vector3::new(0.5, 0.1, 0.2),
            velocity: Vector3::new(0.3, -0.2, 0.1),
            acceleration: Vector3::new(1.0, 1.0, 1.0),
        },
        gains: Gains::isotropic(100.0, 10.0),
        force_n: Vector3::new(5.0, 5.0, 5.0),
        friction_share: 1.0,
    };
    for q in [
        [0.0, 0.0, 0.0],
        [0.4, std::f64::consts::FRAC_PI_2, 0.0],
        [0.4, 0.9, 0.0],
        [0.0, 0.3, std::f64::consts::PI],
    ] {
        let scene = Scene {
            q: Vector::from(q),
            ..still.clone()
        };
        let task = scene.task(&wam3(), &[Role::Active; 3]);
        assert!(task.min_singular_value_m < 1e-6, "{q:?} is singular");
        bounded(&scene, &wam3(), &[Role::Active; 3]);
        let with_roll = Scene {
            q: Vector::from([q[0], q[1], 0.0, q[2]]),
            qd: Vector::<4>::new(0.5, -0.4, 0.1, 0.3),
            reference: still.reference,
            gains: still.gains,
            force_n: still.force_n,
            friction_share: 1.0,
        };
        bounded(&with_roll, &wam4(), &four().roles);
        bounded(&with_roll, &wam4(), &[Role::Active; 4]);
    }
}

#[test]
fn terms_are_bounded_near_singular_poses() {
    check(500, (scene::<3>(), -7.0..-1.0), |(mut scene, power)| {
        scene.q[2] = 10.0_f64.powf(power);
        bounded(&scene, &wam3(), &[Role::Active; 3]);
        Ok(())
    });
}

/// Torques are continuous at the onset of the damping: a step of the elbow across the threshold
/// that is a thousandth as long changes them by a thousandth.
#[test]
fn torques_are_continuous_at_the_onset_of_damping() {
    let (arm, roles) = (wam3(), [Role::Active; 3]);
    let law = Law {
        inertial_feedforward: true,
        ..Law::as_published(Gains::isotropic(0.0, 0.0))
    };
    check(100, scene::<3>(), |mut scene| {
        scene.q[1] = 0.8;
        let sigma = |elbow: f64, scene: &mut Scene<3>| {
            scene.q[2] = elbow;
            scene.task(&arm, &roles).min_singular_value_m
        };
        let (mut below, mut above) = (0.0, 1.2);
        prop_assert!(sigma(above, &mut scene) > SINGULAR_BELOW_M);
        for _ in 0..60 {
            let mid = 0.5 * (below + above);
            if sigma(mid, &mut scene) > SINGULAR_BELOW_M {
                above = mid;
            } else {
                below = mid;
            }
        }
        let mut at = |elbow: f64| {
            scene.q[2] = elbow;
            scene.torques(&law, &friction(), &arm, &roles, None).total()
        };
        let change =
            |h: f64, at: &mut dyn FnMut(f64) -> Vector<3>| (at(above + h) - at(above - h)).norm();
        let (coarse, fine) = (change(1e-4, &mut at), change(1e-7, &mut at));
        prop_assert!(fine < 2e-3 * coarse + 1e-7, "{coarse} and {fine}");
        Ok(())
    });
}

/// The mass that the inertial terms command at the tip: `F = (A + f)^-1 a` with `J^T F = H Jb a`.
fn commanded_mass(scene: &Scene<3>, arm: &Arm<3>) -> Matrix3<f64> {
    let roles = [Role::Active; 3];
    let task = scene.task(arm, &roles);
    let damping = singularity_damping_per_kg(task.min_singular_value_m);
    let h = crba(arm, &scene.q);
    let mobility = task.jacobian * inverse(&h) * task.jacobian.transpose();
    let mass = inverse(&(mobility + Matrix3::from_diagonal_element(damping)));
    let (joints, tip) = (h * task.inverse, task.jacobian.tr_mul(&mass));
    assert_close(&joints, &tip, 1e-9);
    mass
}

fn still(q: Vector<3>) -> Scene<3> {
    Scene {
        q,
        qd: Vector::zeros(),
        reference: supple_core::Reference::at_rest(Vector3::zeros()),
        gains: Gains::isotropic(0.0, 0.0),
        force_n: Vector3::zeros(),
        friction_share: 1.0,
    }
}

#[test]
fn a_singular_direction_gets_the_max_task_mass() {
    let arm = wam3();
    for pitch in [-1.0, 0.3, 0.8, 1.4] {
        let mass = commanded_mass(&still(Vector::<3>::new(0.4, pitch, 0.0)), &arm);
        let [.., max] = symmetric_eigenvalues(&mass);
        assert!((max - MAX_TASK_MASS_KG).abs() < 1e-6, "{max} kg");
    }
}

/// On the way to a singular pose the mass may exceed the maximum, but is bounded: about twice for
/// the WAM.
#[test]
fn no_direction_gets_more_than_about_twice_the_max_task_mass() {
    let arm = wam3();
    let mut heaviest: f64 = 0.0;
    for i in 0..60 {
        for k in 0..400 {
            let q = Vector::<3>::new(0.0, 0.05 * f64::from(i) - 1.5, 0.01 * f64::from(k) - 0.9);
            let [.., max] = symmetric_eigenvalues(&commanded_mass(&still(q), &arm));
            heaviest = heaviest.max(max);
        }
    }
    let times = heaviest / MAX_TASK_MASS_KG;
    assert!((1.0..2.5).contains(&times), "{times} times");
}
