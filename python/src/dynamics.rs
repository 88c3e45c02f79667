//! The functions of [`supple_core::dynamics`] over batches, for any number of joints.
//!
//! [`Dynamics`] dispatches on the number of joints once per call, not once per state. Results are stored by
//! rows, as in NumPy.

use crate::arrays::States;
use crate::law::BatchedLaw;
use supple_core::{Arm, Matrix, Vector, dynamics};

/// Quantity to compute for a state.
#[derive(Clone, Copy, Debug)]
pub enum Quantity {
    /// Torques from `q`, `qd`, `qdd`.
    Rnea,
    /// Mass matrix from `q`.
    MassMatrix,
    /// Gravity torques from `q`.
    Gravity,
    /// Accelerations from `q`, `qd`, `tau`.
    ForwardDynamics,
    /// Velocity products from `q`, `qd`.
    Coriolis,
    /// Christoffel matrix from `q`, `qd`.
    CoriolisMatrix,
    /// Homogeneous pose from `q`.
    TipPose,
    /// Jacobian from `q`.
    Jacobian,
    /// Velocity-product acceleration of the tip from `q`, `qd`.
    JacobianDotQd,
    /// Regressor from `q`, `qd`, `qdd`.
    Regressor,
}

impl Quantity {
    /// Shape of one state's result.
    pub fn shape(self, dof: usize) -> Vec<usize> {
        match self {
            Quantity::Rnea | Quantity::Gravity => vec![dof],
            Quantity::ForwardDynamics | Quantity::Coriolis => vec![dof],
            Quantity::MassMatrix | Quantity::CoriolisMatrix => vec![dof, dof],
            Quantity::TipPose => vec![4, 4],
            Quantity::Jacobian => vec![6, dof],
            Quantity::JacobianDotQd => vec![6],
            Quantity::Regressor => vec![dof, 10 * dof],
        }
    }
}

/// An arm with any number of joints.
pub trait Dynamics: BatchedLaw {
    /// Writes the results to `out`, one after the other. `states` are the arguments of the quantity, in its
    /// order.
    fn evaluate(&self, quantity: Quantity, states: &[States<'_>], out: &mut [f64]);

    /// Returns ten parameters for each link.
    fn parameters(&self) -> Vec<f64>;

    /// Returns the rotor inertia of each joint \[kg m^2\].
    fn armature(&self) -> Vec<f64>;

    /// Returns the gravitational acceleration \[m/s^2\].
    fn gravity_m_per_s2(&self) -> [f64; 3];
}

impl<const N: usize> Dynamics for Arm<N> {
    fn evaluate(&self, quantity: Quantity, states: &[States<'_>], out: &mut [f64]) {
        let width = quantity.shape(N).iter().product();
        let each = Each { states, width };
        match quantity {
            Quantity::Rnea => each.run(out, |[q, qd, qdd]: [Vector<N>; 3], out| {
                put(&dynamics::rnea(self, &q, &qd, &qdd), out);
            }),
            Quantity::MassMatrix => each.run(out, |[q]: [Vector<N>; 1], out| {
                by_rows(&dynamics::crba(self, &q), out);
            }),
            Quantity::Gravity => each.run(out, |[q]: [Vector<N>; 1], out| {
                put(&dynamics::gravity(self, &q), out);
            }),
            Quantity::ForwardDynamics => each.run(out, |[q, qd, tau]: [Vector<N>; 3], out| {
                put(&dynamics::aba(self, &q, &qd, &tau), out);
            }),
            Quantity::Coriolis => each.run(out, |[q, qd]: [Vector<N>; 2], out| {
                put(&dynamics::coriolis(self, &q, &qd), out);
            }),
            Quantity::CoriolisMatrix => each.run(out, |[q, qd]: [Vector<N>; 2], out| {
                by_rows(&dynamics::coriolis_matrix(self, &q, &qd), out);
            }),
            Quantity::TipPose => each.run(out, |[q]: [Vector<N>; 1], out| {
                let pose = dynamics::tip_pose(self, &q);
                let mut homogeneous = Matrix::<4, 4>::identity();
                homogeneous
                    .fixed_view_mut::<3, 3>(0, 0)
                    .copy_from(&pose.rotation);
                homogeneous
                    .fixed_view_mut::<3, 1>(0, 3)
                    .copy_from(&pose.translation);
                by_rows(&homogeneous, out);
            }),
            Quantity::Jacobian => each.run(out, |[q]: [Vector<N>; 1], out| {
                by_rows(&dynamics::jacobian(self, &q), out);
            }),
            Quantity::JacobianDotQd => each.run(out, |[q, qd]: [Vector<N>; 2], out| {
                put(&dynamics::jacobian_dot_qd(self, &q, &qd), out);
            }),
            Quantity::Regressor => each.run_in_chunks(out, |[q, qd, qdd]: [Vector<N>; 3], out| {
                dynamics::regressor_rows(self, &q, &qd, &qdd, |joint, link, row| {
                    out[10 * (N * joint + link)..][..10].copy_from_slice(&row);
                });
            }),
        }
    }

    fn parameters(&self) -> Vec<f64> {
        let links = dynamics::parameters(self);
        links.iter().flat_map(|link| link.iter().copied()).collect()
    }

    fn armature(&self) -> Vec<f64> {
        Arm::armature(self).as_slice().to_vec()
    }

    fn gravity_m_per_s2(&self) -> [f64; 3] {
        self.gravity().into()
    }
}

/// Number of states whose results are copied together.
const CHUNK: usize = 16;

/// A batch of states and the width of their results.
struct Each<'a> {
    states: &'a [States<'a>],
    width: usize,
}

impl Each<'_> {
    /// Calls `f` for every state with its `K` arguments and the slice for its result.
    #[inline]
    fn run<const N: usize, const K: usize>(
        &self,
        out: &mut [f64],
        f: impl Fn([Vector<N>; K], &mut [f64]),
    ) {
        for (k, out) in out.chunks_exact_mut(self.width).enumerate() {
            f(self.arguments(k), out);
        }
    }

    /// Like [`Each::run`], for wide results with zeros that `f` need not write. Results are computed in a
    /// cache-resident buffer and copied in large blocks, so that the copy does not read the destination first.
    #[inline]
    fn run_in_chunks<const N: usize, const K: usize>(
        &self,
        out: &mut [f64],
        f: impl Fn([Vector<N>; K], &mut [f64]),
    ) {
        let chunk = out.len().min(CHUNK * self.width);
        let mut buffer = vec![0.0; chunk];
        let mut k = 0;
        for out in out.chunks_mut(chunk.max(1)) {
            let buffer = &mut buffer[..out.len()];
            for result in buffer.chunks_exact_mut(self.width) {
                f(self.arguments(k), result);
                k += 1;
            }
            out.copy_from_slice(buffer);
        }
    }

    #[inline(always)]
    fn arguments<const N: usize, const K: usize>(&self, k: usize) -> [Vector<N>; K] {
        // A loop, since a closure might not be inlined.
        let mut arguments = [Vector::zeros(); K];
        for (argument, states) in arguments.iter_mut().zip(self.states) {
            *argument = states.vector(k);
        }
        arguments
    }
}

/// A copy of known length compiles to a few moves.
#[inline(always)]
fn put<const N: usize>(result: &Vector<N>, out: &mut [f64]) {
    if let Some(out) = out.first_chunk_mut() {
        *out = (*result).into();
    }
}

#[inline]
fn by_rows<const R: usize, const C: usize>(matrix: &Matrix<R, C>, out: &mut [f64]) {
    out.copy_from_slice(matrix.transpose().as_slice());
}
