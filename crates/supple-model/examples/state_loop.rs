//! Cost per state in a plain loop: `state_loop ARM SAMPLES` prints nanoseconds by function, as JSON.
//! `python/benchmarks/native.py` compares batched calls from Python with it.

use std::hint::black_box;
use std::process::ExitCode;
use std::time::Instant;
use supple_core::config::Gains;
use supple_core::dynamics::{self, Terms};
use supple_core::impedance::{LawInput, PositionTarget, Task, impedance};
use supple_core::math::Vector3;
use supple_core::{Config, Reference, Vector};
use supple_model::{Description, ModelError, with_dof};
use supple_random::Random;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (arm, samples) = (arguments.next(), arguments.next());
    let (Some(arm), Some(Ok(samples))) = (arm, samples.map(|text| text.parse())) else {
        eprintln!("usage: state_loop ARM SAMPLES");
        return ExitCode::from(2);
    };
    match costs(&arm, samples) {
        Ok(json) => {
            println!("{json}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn costs(arm: &str, samples: usize) -> Result<String, ModelError> {
    let description = Description::find(arm)?;
    with_dof!(description.dof(), N => {
        let config = description.config::<N>()?;
        for_dof::<N>(&config, samples)
    })
}

fn for_dof<const N: usize>(config: &Config<N>, samples: usize) -> String {
    let arm = &config.arm;
    let mut random = Random::new(1);
    let [q, qd, qdd]: [Vec<Vector<N>>; 3] = core::array::from_fn(|_| {
        let mut draw = |_, _| 1.5 * random.signed();
        (0..samples).map(|_| Vector::from_fn(&mut draw)).collect()
    });
    let lines = [
        (
            "rnea",
            cost(samples, N, |k, out| {
                out.copy_from_slice(dynamics::rnea(arm, &q[k], &qd[k], &qdd[k]).as_slice());
            }),
        ),
        (
            "mass_matrix",
            cost(samples, N * N, |k, out| {
                out.copy_from_slice(dynamics::crba(arm, &q[k]).as_slice());
            }),
        ),
        (
            "forward_dynamics",
            cost(samples, N, |k, out| {
                out.copy_from_slice(dynamics::aba(arm, &q[k], &qd[k], &qdd[k]).as_slice());
            }),
        ),
        (
            "gravity",
            cost(samples, N, |k, out| {
                out.copy_from_slice(dynamics::gravity(arm, &q[k]).as_slice());
            }),
        ),
        (
            "impedance_torque",
            cost(samples, N, |k, out| {
                out.copy_from_slice(law(config, &q[k], &qd[k], &qdd[k]).as_slice());
            }),
        ),
    ];
    let entries = lines.map(|(name, ns)| format!("\"{name}\": {ns:.1}"));
    format!("{{{}}}", entries.join(", "))
}

/// Torque of the impedance law towards a position that the last argument makes differ from state to state.
fn law<const N: usize>(
    config: &Config<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    at: &Vector<N>,
) -> Vector<N> {
    let mut terms = Terms::default();
    dynamics::terms(&config.arm, q, qd, &mut terms);
    let target = PositionTarget {
        reference: &Reference::at_rest(Vector3::new(at[0], at[1], at[2])),
        gains: &Gains::isotropic(5.0, 1.5),
        spring_limit_n: f64::MAX,
    };
    // Random angles: the mass matrix is positive definite everywhere.
    Task::new(&terms, &config.roles).map_or_else(Vector::zeros, |task| {
        impedance(&config.roles, &terms, &task, &LawInput::new(target, qd)).total()
    })
}

/// Nanoseconds per state, the minimum of three passes.
fn cost(samples: usize, width: usize, mut f: impl FnMut(usize, &mut [f64])) -> f64 {
    let mut out = vec![0.0; samples * width];
    let pass = |_| {
        let start = Instant::now();
        for (k, out) in out.chunks_exact_mut(width).enumerate() {
            f(k, out);
        }
        black_box(&mut out);
        start.elapsed().as_secs_f64() * 1e9 / samples as f64
    };
    (0..3).map(pass).fold(f64::INFINITY, f64::min)
}
