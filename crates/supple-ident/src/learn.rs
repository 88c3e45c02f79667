//! Updates friction and payload from the prediction error of a repeated motion.
//!
//! The torque residual in free motion away from rest is fitted by a change of each joint's viscous and dry
//! friction and, if requested, by a payload. The change is regularised by a zero-mean Gaussian prior with
//! the expected changes as standard deviations, so that joints that did not move keep their values. The tracking error
//! is not used: at low gain, adapting to it makes tracking worse.

use crate::error::{IdentError, positive};
use crate::feedforward::effects_nm;
use crate::filter::LowPass;
use crate::motion::Motion;
use crate::save::SaveError;
use nalgebra::{DMatrix, DVector, Vector4};
use supple_core::dynamics::{gravity, regressor, rnea};
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, Config, Friction, Vector};
use supple_model::{Description, IdentifiedModel};

/// Options of [`learn`]: parameters that may change, and their expected changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learning {
    /// Samples at which a joint is slower than this are excluded from its rows \[rad/s\].
    pub slow_rad_per_s: f64,
    /// Expected relative change of friction.
    pub friction_change: f64,
    /// Expected payload \[kg\]; `None`: no payload.
    pub payload_kg: Option<f64>,
    /// Standard deviation of the torque noise \[N m\].
    pub noise_nm: f64,
}

impl Default for Learning {
    /// Returns default options: samples above 0.08 rad/s, friction change of 20 %, no payload, noise of 0.05 N m.
    fn default() -> Self {
        Learning {
            slow_rad_per_s: 0.08,
            friction_change: 0.2,
            payload_kg: None,
            noise_nm: 0.05,
        }
    }
}

/// Result of [`learn`].
#[derive(Clone, Debug, PartialEq)]
pub struct Learned<const N: usize> {
    /// Friction of each joint.
    pub friction: [Friction; N],
    /// Mass \[kg\] and first moment \[kg m\] of the payload in the last link's frame, relative to the model.
    pub payload: Option<Vector4<f64>>,
    /// RMS prediction error of each joint before learning \[N m\].
    pub before_nm: [f64; N],
    /// RMS prediction error of each joint after learning \[N m\].
    pub after_nm: [f64; N],
}

impl<const N: usize> Learned<N> {
    /// Returns the description `of` with the learned friction and payload; its configuration must be the one given to [`learn`].
    /// Compliance, springs and other `[learned]` terms are kept, because [`learn`] has taken them into account.
    ///
    /// # Errors
    /// [`SaveError`].
    pub fn description(&self, of: &Description) -> Result<Description, SaveError> {
        let config = of.config::<N>()?;
        let source = "friction learnt from repeated motion";
        let described = of.with_model(&IdentifiedModel {
            arm: &with_payload(&config.arm, self.payload.as_ref())?,
            friction: &self.friction,
            ripple: None,
            source,
        })?;
        match &of.settings().learned {
            None => Ok(described),
            Some(learned) => {
                let source = learned.source.as_deref().unwrap_or(source);
                Ok(described.with_learned(&config.learned, source)?)
            }
        }
    }
}

/// Learns from `motions` of the joints `identified_joints`; the others are at rest.
///
/// # Errors
/// Options out of range; no sample fast enough.
pub fn learn<const N: usize>(
    config: &Config<N>,
    motions: &[Motion],
    identified_joints: &[usize],
    learning: &Learning,
) -> Result<Learned<N>, IdentError> {
    let friction = &config.friction;
    positive("slow_rad_per_s", learning.slow_rad_per_s)?;
    positive("friction_change", learning.friction_change)?;
    positive("noise_nm", learning.noise_nm)?;
    crate::log::check_joint_list(N, identified_joints)?;
    let payload_unknowns = if learning.payload_kg.is_some() { 4 } else { 0 };
    let unknowns = 2 * identified_joints.len() + payload_unknowns;
    let mut gram = DMatrix::zeros(unknowns, unknowns);
    let mut right_hand_side = DVector::zeros(unknowns);
    let mut all_rows: Vec<Row> = Vec::new();
    for motion in motions {
        for (joint, a, residual_nm) in rows(config, motion, identified_joints, learning, unknowns)?
        {
            // Filtered samples are correlated.
            let weight = motion.independent_fraction / learning.noise_nm.powi(2);
            gram.ger(weight, &a, &a, 1.0);
            right_hand_side.axpy(weight * residual_nm, &a, 1.0);
            all_rows.push((joint, a, residual_nm));
        }
    }
    if all_rows.is_empty() {
        return Err(IdentError::Singular {
            problem: format!(
                "no joint moved faster than {} rad/s",
                learning.slow_rad_per_s
            ),
            remedy: "record the repeated motion at its normal speed",
        });
    }
    for i in 0..unknowns {
        gram[(i, i)] += expected(learning, identified_joints.len(), i).powi(-2);
    }
    let change = nalgebra::Cholesky::new(gram)
        .ok_or_else(|| IdentError::Singular {
            problem: "the torques are not finite".to_owned(),
            remedy: "remove the samples that are not finite",
        })?
        .solve(&right_hand_side);
    let mut learned = Learned {
        friction: *friction,
        payload: learning.payload_kg.map(|_| {
            let payload_start = 2 * identified_joints.len();
            Vector4::from_fn(|i, _| change[payload_start + i])
        }),
        before_nm: [0.0; N],
        after_nm: [0.0; N],
    };
    for (index, &joint) in identified_joints.iter().enumerate() {
        let old = friction[joint];
        let scale = |relative_change: f64| (1.0 + relative_change).max(0.0);
        learned.friction[joint] = old
            .with_viscous_scaled(scale(change[2 * index]))
            .with_dry_scaled(scale(change[2 * index + 1]));
    }
    let mut counts = [0_u32; N];
    for (joint, a, residual_nm) in &all_rows {
        counts[*joint] += 1;
        learned.before_nm[*joint] += residual_nm.powi(2);
        learned.after_nm[*joint] += (residual_nm - a.dot(&change)).powi(2);
    }
    for (j, count) in counts.iter().enumerate() {
        for sum in [&mut learned.before_nm[j], &mut learned.after_nm[j]] {
            *sum = (*sum / f64::from(*count.max(&1))).sqrt();
        }
    }
    Ok(learned)
}

/// Returns the expected size of unknown `i`: relative friction change, payload mass, or first moment of that mass at 0.1 m.
fn expected(learning: &Learning, joint_count: usize, i: usize) -> f64 {
    let payload_kg = learning.payload_kg.unwrap_or(1.0);
    match i.checked_sub(2 * joint_count) {
        None => learning.friction_change,
        Some(0) => payload_kg,
        Some(_) => 0.1 * payload_kg,
    }
}

type Row = (usize, DVector<f64>, f64);

/// Returns joint, columns and torque residual of every sample in use.
fn rows<const N: usize>(
    config: &Config<N>,
    motion: &Motion,
    identified_joints: &[usize],
    learning: &Learning,
    unknowns: usize,
) -> Result<Vec<Row>, IdentError> {
    let (arm, friction) = (&config.arm, &config.friction);
    let effects_nm = effects_nm(config, motion);
    let samples = motion.samples();
    let low_pass = motion
        .cutoff_hz
        .map(|cutoff_hz| LowPass::butterworth4(cutoff_hz, motion.rate_hz))
        .transpose()?;
    // Dry friction changes sign faster than the filter can follow, so its columns are filtered like the
    // torques.
    let load_nm: Vec<Vector<N>> = (0..samples)
        .map(|i| gravity(arm, &Vector::from_fn(|j, _| motion.q[(i, j)])))
        .collect();
    let dry: Vec<Vec<f64>> = identified_joints
        .iter()
        .map(|&j| {
            let at_load = |i: usize| friction[j].at_load(load_nm[i][j]);
            let raw: Vec<f64> = (0..samples)
                .map(|i| at_load(i).dry_torque_nm(motion.qd[(i, j)]))
                .collect();
            low_pass.map_or(Ok(raw.clone()), |filter| filter.zero_phase(&raw))
        })
        .collect::<Result<_, _>>()?;
    let mut all = Vec::new();
    for i in 0..samples {
        let at = |m: &DMatrix<f64>| Vector::<N>::from_fn(|j, _| m[(i, j)]);
        let with_held_at_rest = |m: &DMatrix<f64>| {
            Vector::<N>::from_fn(|j, _| {
                if identified_joints.contains(&j) {
                    m[(i, j)]
                } else {
                    0.0
                }
            })
        };
        let (q, qd, qdd) = (
            at(&motion.q),
            with_held_at_rest(&motion.qd),
            with_held_at_rest(&motion.qdd),
        );
        let model = rnea(arm, &q, &qd, &qdd);
        let link_regressor =
            (unknowns > 2 * identified_joints.len()).then(|| regressor(arm, &q, &qd, &qdd));
        for (index, &joint) in identified_joints.iter().enumerate() {
            if qd[joint].abs() < learning.slow_rad_per_s {
                continue;
            }
            let viscous = friction[joint].viscous_torque_nm(qd[joint]);
            let known = model[joint]
                + viscous
                + friction[joint].offset_at_nm(qd[joint])
                + dry[index][i]
                + effects_nm[(i, joint)];
            let mut a = DVector::zeros(unknowns);
            a[2 * index] = viscous;
            a[2 * index + 1] = dry[index][i];
            if let Some(link_regressor) = &link_regressor {
                for k in 0..4 {
                    a[2 * identified_joints.len() + k] = link_regressor[joint][N - 1][k];
                }
            }
            all.push((joint, a, motion.tau[(i, joint)] - known));
        }
    }
    Ok(all)
}

/// Returns `arm` with a point-mass payload of given mass and first moment in the last link's frame.
///
/// # Errors
/// [`IdentError::NotPhysical`] if the result is physically inconsistent.
pub fn with_payload<const N: usize>(
    arm: &Arm<N>,
    payload: Option<&Vector4<f64>>,
) -> Result<Arm<N>, IdentError> {
    let Some(payload) = payload else {
        return Ok(*arm);
    };
    let mut links = *arm.links();
    let last = &mut links[N - 1];
    let mass = payload[0];
    let moment = last
        .link_from_joint
        .tr_mul(&Vector3::new(payload[1], payload[2], payload[3]));
    last.mass += mass;
    last.first_moment += moment;
    if mass != 0.0 {
        let square = Matrix3::identity() * moment.dot(&moment) - moment * moment.transpose();
        last.inertia += square / mass;
    }
    Arm::from_links(links, arm.armature(), arm.joint_from_tip(), arm.gravity())
        .map_err(IdentError::NotPhysical)
}
