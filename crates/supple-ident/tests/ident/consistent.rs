//! The constrained solution compared with its optimality conditions, known solutions and random feasible
//! points.

use supple_core::math::Vector;
use supple_ident::constrained_least_squares::{Constraints, Solution, pseudo_inertia, solve};
use supple_ident::qr_reduction::ReducedSystem;
use supple_ident::regressor::JointRows;
use supple_ident::{DMatrix, DVector};
use supple_random::Random;

type Link = Vector<10>;

fn block(a: DMatrix<f64>, b: DVector<f64>) -> ReducedSystem {
    let speed = vec![1.0; b.len()];
    JointRows::new(a, b, speed).reduced(0.0, None)
}

fn ball() -> Link {
    Link::from_column_slice(&[2.0, 0.2, 0.0, -0.1, 0.05, 0.0, 0.06, 0.0, 0.0, 0.05])
}

fn objective(problem: &ReducedSystem, c: &Constraints, x: &DVector<f64>) -> Option<f64> {
    let mut value = 0.5 * problem.error_squared(x);
    for (k, prior) in c.links.iter().enumerate() {
        let p = pseudo_inertia(&x.fixed_rows::<10>(10 * k).into_owned());
        let eigenvalues = p.symmetric_eigenvalues();
        if eigenvalues.min() <= 0.0 {
            return None;
        }
        let inverse = pseudo_inertia(prior).try_inverse()?;
        let log_det: f64 = eigenvalues.iter().map(|e| e.ln()).sum();
        value += c.prior_weight * ((inverse * p).trace() - log_det);
    }
    let broken = |form: &Vec<(usize, f64)>| form.iter().map(|(i, a)| a * x[*i]).sum::<f64>() < 0.0;
    (!c.not_negative.iter().any(broken)).then_some(value)
}

/// Noisy equations of two links and four friction columns, whose unconstrained solution is physically
/// inconsistent.
fn hard(seed: u64, prior_weight: f64) -> (ReducedSystem, Constraints) {
    let mut noise = Random::new(seed);
    let a = DMatrix::from_fn(60, 24, |_, _| noise.signed());
    let b = DVector::from_fn(60, |_, _| 2.0 * noise.signed());
    let constraints = Constraints {
        links: vec![ball(), ball()],
        not_negative: vec![
            vec![(20, 1.0)],
            vec![(21, 1.0)],
            vec![(20, 1.0), (22, 1.0)],
            vec![(20, 1.0), (22, -1.0)],
        ],
        prior_weight,
        tolerance: 1e-10,
    };
    (block(a, b), constraints)
}

#[test]
fn no_feasible_neighbour_is_better_than_the_optimality_gap() {
    for seed in 1..20 {
        let (problem, constraints) = hard(seed, 1e-3);
        let found = solve(&problem, &constraints).unwrap();
        let value = objective(&problem, &constraints, &found.x).expect("feasible");
        assert!((value - found.objective).abs() < 1e-8 * value.abs().max(1.0));
        let mut noise = Random::new(seed + 100);
        let mut feasible = 0;
        for round in 0..2000 {
            let size = 10.0_f64.powi(-(round % 6));
            let step = DVector::from_fn(24, |_, _| size * noise.signed());
            // Also step towards the middle of the feasible set, since most random steps leave it.
            let middle = DVector::from_fn(24, |i, _| match i {
                0..20 => ball()[i % 10],
                20 | 21 => 1.0,
                _ => 0.0,
            });
            let inwards = size * (noise.signed() + 1.0) * 0.5;
            let rival = &found.x + step * 0.3 + (&middle - &found.x) * inwards;
            if let Some(other) = objective(&problem, &constraints, &rival) {
                feasible += 1;
                assert!(
                    other >= value - found.optimality_gap - 1e-9,
                    "{other} {value} {}",
                    found.optimality_gap
                );
            }
        }
        assert!(feasible > 100, "{feasible}");
    }
}

/// First-order conditions: the gradient is a combination of the constraints' normals with multipliers
/// that are not negative and vanish where there is slack.
#[test]
fn multipliers_are_dual_feasible_and_complementary() {
    for seed in 1..20 {
        let (problem, c) = hard(seed, 1e-3);
        let Solution {
            x,
            optimality_gap: gap,
            ..
        } = solve(&problem, &c).unwrap();
        let smooth = problem.a().tr_mul(&(problem.a() * &x - problem.b()));
        for (k, prior) in c.links.iter().enumerate() {
            let p = pseudo_inertia(&x.fixed_rows::<10>(10 * k).into_owned());
            let prior_inverse = pseudo_inertia(prior).try_inverse().unwrap();
            let own = (prior_inverse - p.try_inverse().unwrap()) * c.prior_weight;
            // The multiplier matrix Z with <E_i, Z> = gradient_i, from the ten equations.
            let basis: Vec<_> = (0..10)
                .map(|i| {
                    let mut unit = Link::zeros();
                    unit[i] = 1.0;
                    pseudo_inertia(&unit)
                })
                .collect();
            let gram = DMatrix::from_fn(10, 10, |i, j| basis[i].dot(&basis[j]));
            let gradient = DVector::from_fn(10, |i, _| smooth[10 * k + i] + own.dot(&basis[i]));
            let weights = gram.lu().solve(&gradient).unwrap();
            let z = (0..10).fold(nalgebra::Matrix4::zeros(), |z, i| z + basis[i] * weights[i]);
            assert!(
                z.symmetric_eigenvalues().min() > -1e-5,
                "{}",
                z.symmetric_eigenvalues()
            );
            assert!((z * p).trace().abs() <= gap + 1e-5, "{}", (z * p).trace());
        }
        assert!(smooth[23].abs() < 1e-5);
        assert!(smooth[21] > -1e-5 && (smooth[21] * x[21]).abs() < 1e-5);
    }
}

#[test]
fn an_unconstrained_optimum_inside_the_set_is_found_exactly() {
    let mut noise = Random::new(5);
    let truth = DVector::from_iterator(11, ball().iter().copied().chain([0.7]));
    let a = DMatrix::from_fn(400, 11, |_, _| 100.0 * noise.signed());
    let b = &a * &truth;
    let mut other = ball();
    other[0] = 3.0;
    let constraints = Constraints {
        links: vec![other],
        not_negative: vec![vec![(10, 1.0)]],
        prior_weight: 1e-9,
        tolerance: 1e-11,
    };
    let found = solve(&block(a, b), &constraints).unwrap();
    assert!((&found.x - truth).amax() < 1e-7, "{}", found.x);
}

#[test]
fn without_data_the_solution_is_the_prior() {
    let constraints = Constraints {
        links: vec![ball()],
        not_negative: vec![],
        prior_weight: 2.0,
        tolerance: 1e-12,
    };
    let nothing = block(DMatrix::zeros(3, 10), DVector::zeros(3));
    let found = solve(&nothing, &constraints).unwrap();
    for (x, p) in found.x.iter().zip(ball().iter()) {
        assert!((x - p).abs() < 1e-6, "{x} {p}");
    }
}

/// The prior is far from satisfying the equations of an arm with little noise, and the mass of the second link is only known
/// together with the first moment of the first, whose mass and inertia nothing determines.
#[test]
fn links_that_equations_leave_undetermined_stay_near_the_prior() {
    let mut noise = Random::new(8);
    let mut a = DMatrix::from_fn(400, 20, |_, _| 1e6 * noise.signed());
    for undetermined in [0, 4, 5, 6, 7, 8, 9] {
        a.column_mut(undetermined).fill(0.0);
    }
    let together = a.column(1).into_owned();
    a.set_column(10, &together);
    let truth = DVector::from_iterator(20, ball().iter().chain(&(ball() * 1.5)).copied());
    let b = &a * &truth;
    let constraints = Constraints {
        links: vec![ball(), ball()],
        not_negative: vec![],
        prior_weight: 1e-3,
        tolerance: 1e-9,
    };
    let found = solve(&block(a, b), &constraints).unwrap();
    let determined = found.x[1] + found.x[10] - truth[1] - truth[10];
    assert!(determined.abs() < 1e-6, "{}", found.x);
    assert!(found.x.amax() < 10.0, "{}", found.x);
}

/// One unknown, solved by hand: a mass whose unconstrained estimate is negative stays positive, friction ends
/// at its bound.
#[test]
fn an_estimate_below_zero_stops_at_the_bound() {
    let mut a = DMatrix::zeros(1, 11);
    a[(0, 10)] = 1.0;
    let constraints = Constraints {
        links: vec![ball()],
        not_negative: vec![vec![(10, 1.0)]],
        prior_weight: 1.0,
        tolerance: 1e-10,
    };
    let found = solve(&block(a, DVector::from_element(1, -3.0)), &constraints).unwrap();
    assert!(found.x[10] > 0.0 && found.x[10] < 1e-8, "{}", found.x[10]);
}

#[test]
fn rejects_an_inconsistent_prior_and_invalid_weights() {
    let (problem, good) = hard(1, 1.0);
    let mut bad = good.clone();
    bad.links[1][4] = 1.0;
    assert!(solve(&problem, &bad).is_err());
    let bad = Constraints {
        prior_weight: 0.0,
        ..good
    };
    assert!(solve(&problem, &bad).is_err());
}
