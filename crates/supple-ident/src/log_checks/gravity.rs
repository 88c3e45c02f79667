//! Comparison of the gravity torques fitted to a log with those of the given arm: unit of the torques, zeros of the angles,
//! payload.

use super::equal_values::median;
use super::finding::{Consequence, Finding, Problem};
use super::weighted_fit::{FitContext, FitResult};
use crate::motion::Motion;
use nalgebra::{Matrix2, Vector2};
use supple_core::Vector;
use supple_core::dynamics::{regressor, regressor_times};

/// Maximum ratio of fitted to given gravity torques, or its reciprocal; beyond it the torques have another unit.
const MAX_RATIO: f64 = 3.0;
/// Minimum ratio of the sums of squares of gravity and measured torque at which a joint is compared.
const MIN_GRAVITY_RATIO: f64 = 0.04;
/// Minimum correlation of the fitted gravity torques with the given ones; below it a zero of an angle may be wrong.
const MIN_CORRELATION: f64 = 0.985;
/// Minimum zero offset that is reported \[rad\].
const MIN_OFFSET_RAD: f64 = 0.08;
/// Minimum payload that is reported, as a fraction of the arm's mass.
const MIN_PAYLOAD: f64 = 0.11;

/// Fitted and given gravity torques of the identified joints at the poses of a log.
pub(super) struct GravityComparison<'a, const N: usize> {
    context: &'a FitContext<'a, N>,
    poses: Vec<Vector<N>>,
    found: Vec<Vector<N>>,
    given: Vec<Vector<N>>,
    /// Joints with enough gravity torque to be compared.
    heavy: Vec<usize>,
}

/// Returns the sum over poses of the product of two torques at a joint.
fn product<const N: usize>(a: &[Vector<N>], b: &[Vector<N>], joint: usize) -> f64 {
    a.iter().zip(b).map(|(a, b)| a[joint] * b[joint]).sum()
}

fn correlation<const N: usize>(a: &[Vector<N>], b: &[Vector<N>], joint: usize) -> f64 {
    let squares = product(a, a, joint) * product(b, b, joint);
    product(a, b, joint) / squares.sqrt().max(f64::MIN_POSITIVE)
}

impl<'a, const N: usize> GravityComparison<'a, N> {
    pub fn new(context: &'a FitContext<'a, N>, motion: &Motion, fit: &FitResult) -> Self {
        let every = (motion.samples() / 200).max(1);
        let rows = (0..motion.samples()).step_by(every);
        let at = |i: usize| Vector::<N>::from_fn(|j, _| motion.q[(i, j)]);
        let poses: Vec<Vector<N>> = rows.clone().map(at).collect();
        let pairs = poses.iter().map(|q| context.gravities(&fit.x, q));
        let (found, given): (Vec<_>, Vec<_>) = pairs.map(|[found, given]| (found, given)).unzip();
        let torque = |j: usize| {
            rows.clone()
                .map(|i| motion.tau[(i, j)].powi(2))
                .sum::<f64>()
        };
        let identified_joints = context.columns.identified_joints();
        let heaviest = identified_joints
            .iter()
            .map(|j| product(&given, &given, *j))
            .fold(0.0, f64::max);
        let holds = |j: &usize| {
            let weight = product(&given, &given, *j);
            weight > MIN_GRAVITY_RATIO * torque(*j) && weight > 0.01 * heaviest
        };
        let heavy = identified_joints.iter().copied().filter(holds).collect();
        GravityComparison {
            context,
            poses,
            found,
            given,
            heavy,
        }
    }

    fn ratios(&self) -> Vec<f64> {
        let ratio = |j: &usize| {
            product(&self.found, &self.given, *j) / product(&self.given, &self.given, *j)
        };
        self.heavy.iter().map(ratio).collect()
    }

    /// Reports torques in another unit: the fitted gravity torques are a small fraction, or a multiple, of the given ones.
    pub fn unit(&self) -> Option<Finding> {
        let ratios = self.ratios();
        if ratios.is_empty() {
            return None;
        }
        let middle = median(ratios.clone());
        if (1.0 / MAX_RATIO..=MAX_RATIO).contains(&middle) || middle <= 0.0 {
            return None;
        }
        let all: Vec<String> = ratios.iter().map(|r| format!("{r:.3}")).collect();
        Some(Finding::reject(
            Problem::NotJointTorques,
            &self.heavy,
            "tau",
            format!(
                "holds {} times the weight of the given arm: these are currents or torques of the motors, or have another \
                 unit",
                all.join(", ")
            ),
            "give N m at the joint: multiply currents by torque constant and gear ratio, torques of motors by the gear \
             ratio",
        ))
    }

    /// Returns the minimum correlation over the heavy joints; `change`: joint and the change of its angle \[rad\].
    fn min_correlation(&self, change: Option<(usize, f64)>) -> f64 {
        let given = match change {
            None => self.given.clone(),
            Some((joint, by)) => self.given_at(joint, by),
        };
        let all = self
            .heavy
            .iter()
            .map(|j| correlation(&self.found, &given, *j));
        all.fold(1.0, f64::min)
    }

    fn given_at(&self, joint: usize, by: f64) -> Vec<Vector<N>> {
        let moved = self.poses.iter().map(|q| {
            let mut q = *q;
            q[joint] += by;
            supple_core::dynamics::gravity(self.context.arm, &q)
        });
        moved.collect()
    }

    /// Finds a wrong zero. Returns the joint, the change of its angle \[rad\] with which the fitted gravity torques agree with
    /// the given ones, and the correlations without and with this change.
    pub fn zero(&self) -> Option<(usize, f64, f64, f64)> {
        let before = self.min_correlation(None);
        if self.heavy.is_empty() || before > MIN_CORRELATION {
            return None;
        }
        let mut best = (0, 0.0, before);
        for &joint in self.context.columns.identified_joints() {
            for k in -31..=31 {
                let by = 0.1 * f64::from(k);
                let after = self.min_correlation(Some((joint, by)));
                if after > best.2 {
                    best = (joint, by, after);
                }
            }
        }
        for k in -9..=9 {
            let by = best.1 + 0.01 * f64::from(k);
            let after = self.min_correlation(Some((best.0, by)));
            if after > best.2 {
                best = (best.0, by, after);
            }
        }
        let (joint, by, after) = best;
        let enough = after > MIN_CORRELATION && 1.0 - after < 0.5 * (1.0 - before);
        (enough && by.abs() >= MIN_OFFSET_RAD).then_some((joint, by, before, after))
    }

    /// Reports a payload: a point mass at the tip that explains the difference from the given gravity torques.
    pub fn payload(&self) -> Option<Finding> {
        let arm = self.context.arm;
        let tip = arm.link_from_joint(N - 1) * arm.joint_from_tip().translation;
        let mut point = [supple_core::nalgebra::SVector::<f64, 10>::zeros(); N];
        for (entry, value) in [1.0, tip.x, tip.y, tip.z].into_iter().enumerate() {
            point[N - 1][entry] = value;
        }
        let still = Vector::zeros();
        let tips: Vec<Vector<N>> = self
            .poses
            .iter()
            .map(|q| regressor_times(&regressor(arm, q, &still, &still), &point))
            .collect();
        // Each joint is divided by its own gravity torque; otherwise those of the wrist would have no influence.
        let (mut normal, mut right, mut alone, mut total) =
            (Matrix2::zeros(), Vector2::zeros(), [0.0; 2], 0.0);
        for &j in &self.heavy {
            let weight = 1.0 / product(&self.given, &self.given, j);
            let [gg, gt, tt] = [
                product(&self.given, &self.given, j),
                product(&self.given, &tips, j),
                product(&tips, &tips, j),
            ];
            let (fg, ft) = (
                product(&self.found, &self.given, j),
                product(&self.found, &tips, j),
            );
            normal += Matrix2::new(gg, gt, gt, tt) * weight;
            right += Vector2::new(fg, ft) * weight;
            alone[0] += gg * weight;
            alone[1] += fg * weight;
            total += product(&self.found, &self.found, j) * weight;
        }
        if self.heavy.len() < 2 {
            return None;
        }
        let both = normal.try_inverse()? * right;
        let left_without = total - alone[1] * alone[1] / alone[0];
        let left_with = total - both.dot(&right);
        let mass: f64 = (0..N).map(|k| arm.body(k).mass_kg).sum();
        let (scale, payload_kg) = (both[0], both[1]);
        let explains = left_with < 0.35 * left_without && left_without > 4e-3 * total;
        if !explains || payload_kg < MIN_PAYLOAD * mass || !(0.5..2.0).contains(&scale) {
            return None;
        }
        let finding = Finding::reject(
            Problem::Payload,
            &[],
            "tau",
            format!(
                "holds about {payload_kg:.2} kg at the tip that the given arm does not have ({:.0} % of the missing weight \
                 is explained by it)",
                100.0 * (1.0 - left_with / left_without)
            ),
            "remove the payload, add it to the arm's URDF, or take it as a part of the identified arm",
        );
        Some(finding.with(Consequence::Warn))
    }
}
