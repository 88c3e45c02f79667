//! Cost per state in a plain loop: `state_loop ARM SAMPLES` prints nanoseconds by function, as JSON.
//! `python/benchmarks/regressor.py` compares batched calls from Python with it.

use std::hint::black_box;
use std::process::ExitCode;
use std::time::Instant;
use supple_core::{Arm, Vector, dynamics};
use supple_model::{Description, ModelError, with_dof};

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
        let arm = description.arm::<N>()?;
        for_dof::<N>(&arm, samples)
    })
}

fn for_dof<const N: usize>(arm: &Arm<N>, samples: usize) -> String {
    let mut state = 1_u64;
    let [q, qd, qdd]: [Vec<Vector<N>>; 3] = core::array::from_fn(|_| {
        let random = |_, _| 1.5 * uniform(&mut state);
        let mut random = random;
        (0..samples).map(|_| Vector::from_fn(&mut random)).collect()
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
    ];
    let entries = lines.map(|(name, ns)| format!("\"{name}\": {ns:.1}"));
    format!("{{{}}}", entries.join(", "))
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

/// Uniform in (-1, 1), splitmix64.
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) as f64 / (1_u64 << 63) as f64 - 1.0
}
