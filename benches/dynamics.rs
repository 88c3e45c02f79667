//! Wall-clock time of the core functions on the built-in arms: independent calls, and calls that each depend on
//! the previous result.
//!
//! `cargo bench -p supple-benches --bench dynamics`. `peers` compares with other libraries.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use supple_benches::{LawBench, Rig, State, config, gains, pool, pose_gains, regular_pool};
use supple_core::Matrix;
use supple_core::dynamics::{self, Terms};

/// Measures `function` over the pool, with independent and with dependent calls.
fn bench<const N: usize, T>(
    criterion: &mut Criterion,
    name: &str,
    states: &[State<N>],
    mut function: impl FnMut(&State<N>) -> T,
    first: impl Fn(&T) -> f64,
) {
    let mut group = criterion.benchmark_group(format!("{name}/{N}"));
    group.bench_function("independent", |b| {
        let mut turn = states.iter().cycle();
        b.iter(|| turn.next().map(|state| function(black_box(state))));
    });
    group.bench_function("dependent", |b| {
        let mut turn = states.iter().cycle();
        let mut before = 0.0;
        b.iter(|| {
            let mut state = turn.next().copied();
            if let Some(state) = &mut state {
                // The summand is too small to change the angle, but the compiler cannot infer this.
                state.q[0] += before * 1e-200;
                let result = function(state);
                before = first(&result);
                black_box(result);
            }
        });
    });
    group.finish();
}

fn functions<const N: usize>(criterion: &mut Criterion, asset: &str) {
    let arm = config::<N>(asset).arm;
    let states = pool(&arm);
    fn entry<const R: usize, const C: usize>(m: &Matrix<R, C>) -> f64 {
        m[(0, 0)]
    }
    let c = criterion;
    bench(
        c,
        "rnea",
        &states,
        |s| dynamics::rnea(&arm, &s.q, &s.qd, &s.qdd),
        entry,
    );
    bench(c, "crba", &states, |s| dynamics::crba(&arm, &s.q), entry);
    bench(
        c,
        "aba",
        &states,
        |s| dynamics::aba(&arm, &s.q, &s.qd, &s.tau),
        entry,
    );
    bench(
        c,
        "gravity",
        &states,
        |s| dynamics::gravity(&arm, &s.q),
        entry,
    );
    bench(
        c,
        "jacobian",
        &states,
        |s| dynamics::jacobian(&arm, &s.q),
        entry,
    );
    bench(
        c,
        "jdot_qd",
        &states,
        |s| dynamics::jacobian_dot_qd(&arm, &s.q, &s.qd),
        entry,
    );
    bench(
        c,
        "regressor",
        &states,
        |s| dynamics::regressor(&arm, &s.q, &s.qd, &s.qdd),
        |rows| rows[0][0][0],
    );
    let mut filled = Terms::default();
    bench(
        c,
        "terms",
        &states,
        |s| {
            dynamics::terms(&arm, &s.q, &s.qd, &mut filled);
            filled.mass_matrix[(0, 0)]
        },
        |x| *x,
    );
}

/// Measures both forms of the law: one sum, and separate terms as in the controller.
fn position_law<const N: usize>(criterion: &mut Criterion, asset: &str) {
    let law = LawBench::<N, _>::new(config::<N>(asset).arm, gains());
    let states = regular_pool(&law.arm, &law.roles);
    bench(
        criterion,
        "law",
        &states,
        |s| law.sum(s),
        |tau| tau.map_or(0.0, |tau| tau[0]),
    );
    bench(
        criterion,
        "law_apart",
        &states,
        |s| law.terms(s),
        |tau| tau.map_or(0.0, |tau| tau.stiffness[0]),
    );
}

fn pose_law<const N: usize>(criterion: &mut Criterion, asset: &str) {
    let law = LawBench::<N, _>::new(config::<N>(asset).arm, pose_gains());
    let states = regular_pool(&law.arm, &law.roles);
    bench(
        criterion,
        "law",
        &states,
        |s| law.sum(s),
        |tau| tau.map_or(0.0, |tau| tau[0]),
    );
    bench(
        criterion,
        "law_apart",
        &states,
        |s| law.terms(s),
        |tau| tau.map_or(0.0, |tau| tau.stiffness[0]),
    );
}

/// Measures the complete cycle while the law holds the tip and the arm moves within 0.1 mrad.
fn step<const N: usize>(criterion: &mut Criterion, asset: &str) {
    let mut rig = Rig::<N>::tracking(asset);
    criterion.bench_function(&format!("step/{N}"), |b| b.iter(|| rig.step()));
}

fn all(criterion: &mut Criterion) {
    functions::<3>(criterion, "wam3");
    functions::<4>(criterion, "wam4");
    functions::<7>(criterion, "wam7");
    position_law::<3>(criterion, "wam3");
    position_law::<4>(criterion, "wam4");
    pose_law::<7>(criterion, "wam7");
    step::<3>(criterion, "wam3");
    step::<4>(criterion, "wam4");
    step::<7>(criterion, "wam7");
}

criterion_group!(benches, all);
criterion_main!(benches);
