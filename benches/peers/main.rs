//! This project's side of the comparison with other libraries of rigid-body dynamics (the peers), the counterpart of
//! `harness.hpp`.
//!
//! `peers case.txt outputs.bin` prints `function mode median_ns minimum_ns` lines.

mod case;

use case::Case;
use std::fs::File;
use std::hint::black_box;
use std::io::{self, BufWriter, Write};
use std::process::ExitCode;
use std::time::Instant;
use supple_benches::{LawBench, Rig, State};
use supple_core::config::Role;
use supple_core::dynamics::{self, Regressor};
use supple_core::torques::Torques;
use supple_core::{Matrix, Vector};

const BATCHES: usize = 101;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [case, outputs] = arguments.as_slice() else {
        eprintln!("usage: peers case.txt outputs.bin");
        return ExitCode::from(2);
    };
    match run(case, outputs) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(case: &str, outputs: &str) -> Result<(), case::CaseError> {
    let numbers = case::numbers(case)?;
    let mut out = BufWriter::new(File::create(outputs)?);
    macro_rules! of_joints {
        ($($n:literal)*) => {
            match numbers.first() {
                $(Some(&n) if n == f64::from($n) => all::<$n>(&numbers, &mut out)?,)*
                _ => return Err(case::CaseError::Joints),
            }
        };
    }
    of_joints!(2 3 4 5 6 7 8 9 10 11 12);
    match numbers[..] {
        [3.0, 3.0, ..] => position_law::<3>("wam3", &numbers, &mut out)?,
        [4.0, 3.0, ..] => position_law::<4>("wam4", &numbers, &mut out)?,
        [7.0, 6.0, ..] => pose_law::<7>("wam7", &numbers, &mut out)?,
        _ => {}
    }
    out.flush()?;
    Ok(())
}

fn all<const N: usize>(numbers: &[f64], out: &mut impl Write) -> Result<(), case::CaseError> {
    let mut case = Case::<N>::new(numbers)?;
    let arm = case.arm;
    let mut bench = Bench {
        states: &mut case.states,
        out,
    };
    bench.run("rnea", |s| dynamics::rnea(&arm, &s.q, &s.qd, &s.qdd))?;
    bench.run("crba", |s| dynamics::crba(&arm, &s.q))?;
    bench.run("aba", |s| dynamics::aba(&arm, &s.q, &s.qd, &s.tau))?;
    bench.run("jacobian", |s| dynamics::jacobian(&arm, &s.q))?;
    bench.run("jdot_qd", |s| dynamics::jacobian_dot_qd(&arm, &s.q, &s.qd))?;
    bench.run("regressor", |s| {
        dynamics::regressor(&arm, &s.q, &s.qd, &s.qdd)
    })?;
    Ok(())
}

/// The law of the position: as one sum, with every term apart, and within a step of the controller.
fn position_law<const N: usize>(
    asset: &str,
    numbers: &[f64],
    out: &mut impl Write,
) -> Result<(), case::CaseError> {
    let mut case = Case::<N>::new(numbers)?;
    let law = LawBench {
        arm: case.arm,
        roles: [Role::Active; N],
        gains: case.gains,
        nullspace_damping: case.nullspace_damping,
    };
    let states = &mut case.states;
    let mut bench = Bench { states, out };
    bench.run("law", |s| law.sum(s).unwrap_or(Vector::zeros()))?;
    bench.run("law_apart", |s| law.terms(s).unwrap_or(Torques::zeros()))?;
    step(asset, bench)
}

/// The pose law in the same three ways, except that the controller's step still runs the position law.
fn pose_law<const N: usize>(
    asset: &str,
    numbers: &[f64],
    out: &mut impl Write,
) -> Result<(), case::CaseError> {
    let mut case = Case::<N>::new(numbers)?;
    let law = LawBench {
        arm: case.arm,
        roles: [Role::Active; N],
        gains: case.pose_gains,
        nullspace_damping: case.nullspace_damping,
    };
    let states = &mut case.states;
    let mut bench = Bench { states, out };
    bench.run("law", |s| law.sum(s).unwrap_or(Vector::zeros()))?;
    bench.run("law_apart", |s| law.terms(s).unwrap_or(Torques::zeros()))?;
    step(asset, bench)
}

/// A whole `controller::step`; its measured joint angles are those of each state in turn.
fn step<const N: usize, W: Write>(
    asset: &str,
    mut bench: Bench<'_, N, W>,
) -> Result<(), case::CaseError> {
    let mut rig = Rig::<N>::anywhere(asset);
    bench.run("step", |s| rig.step_at(&s.q).torque_nm)?;
    Ok(())
}

/// A result as numbers, in the order in which the peers store them.
trait Numbers: Copy {
    fn first(&self) -> f64;
    fn write(&self, out: &mut impl Write) -> io::Result<()>;
}

impl<const R: usize, const C: usize> Numbers for Matrix<R, C> {
    #[inline]
    fn first(&self) -> f64 {
        self[(0, 0)]
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        self.iter()
            .try_for_each(|x| out.write_all(&x.to_le_bytes()))
    }
}

/// Their sum is written.
impl<const N: usize> Numbers for Torques<N> {
    #[inline]
    fn first(&self) -> f64 {
        self.stiffness[0]
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        self.total().write(out)
    }
}

/// By columns, as the peers store it.
impl<const N: usize> Numbers for Regressor<N> {
    #[inline]
    fn first(&self) -> f64 {
        self[0][0][0]
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        for (link, parameter) in (0..N).flat_map(|link| (0..10).map(move |p| (link, p))) {
            for row in self {
                out.write_all(&row[link][parameter].to_le_bytes())?;
            }
        }
        Ok(())
    }
}

struct Bench<'a, const N: usize, W: Write> {
    states: &'a mut [State<N>],
    out: &'a mut W,
}

impl<const N: usize, W: Write> Bench<'_, N, W> {
    fn run<T: Numbers>(
        &mut self,
        name: &str,
        mut call: impl FnMut(&State<N>) -> T,
    ) -> io::Result<()> {
        for state in self.states.iter() {
            call(state).write(self.out)?;
        }
        time(name, "independent", self.states, |state, _| {
            black_box(&call(state));
            0.0
        });
        time(name, "dependent", self.states, |state, before| {
            // Makes this call depend on the result of the last; the product is too small to change the angle, which the
            // compiler cannot infer.
            let angle = state.q[0];
            state.q[0] += before * 1e-200;
            let result = call(state);
            black_box(&result);
            state.q[0] = angle;
            result.first()
        });
        Ok(())
    }
}

fn time<const N: usize>(
    name: &str,
    mode: &str,
    states: &mut [State<N>],
    mut call: impl FnMut(&mut State<N>, f64) -> f64,
) {
    let mut ns = Vec::with_capacity(BATCHES);
    let mut carry = 0.0;
    for batch in 0..=BATCHES {
        let begin = Instant::now();
        for state in states.iter_mut() {
            carry = call(state, carry);
        }
        let spent = begin.elapsed().as_nanos() as f64;
        if batch > 0 {
            ns.push(spent / states.len() as f64);
        }
    }
    ns.sort_by(f64::total_cmp);
    println!("{name} {mode} {:.3} {:.3}", ns[BATCHES / 2], ns[0]);
}
