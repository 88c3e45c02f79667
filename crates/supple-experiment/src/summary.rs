//! Numerical results of a demo, as in `summary.json`.

use crate::adapted::Adapted;
use crate::calibrated_runs::CalibratedRuns;
use crate::metrics::LineFit;
use crate::probing::Stroke;
use crate::quadrant::SegmentPass;
use crate::run::FaultEnd;
use crate::trace::JointTorque;
use serde::Serialize;
use supple_model::Paths;
use supple_plant::PlantOptions;

/// Tracking error of a run in free space.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackingError {
    /// Root mean square distance of the tip from its reference \[m\].
    pub rms_error_m: f64,
    /// Maximum distance \[m\].
    pub max_error_m: f64,
    /// Set if a fault ended the run.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub ended: Option<FaultEnd>,
}

/// Tracking error at one speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackingAtSpeed {
    /// Speed relative to the paper's.
    pub speed: f64,
    /// Tracking error at this speed.
    #[serde(flatten)]
    pub tracking: TrackingError,
}

/// RMS torque of each term on the two joints of figure 4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TorqueRms {
    /// The paper's joint 2 \[N m\].
    pub shoulder_pitch: JointTorque,
    /// The paper's joint 3 \[N m\].
    pub elbow: JointTorque,
}

/// Results of the quadrant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuadrantSummary {
    /// Speed on every segment of the path \[m/s\].
    pub speed_m_per_s: f64,
    /// Tracking error of the whole run.
    #[serde(flatten)]
    pub tracking: TrackingError,
    /// Tracking error on each segment.
    pub edges: Vec<SegmentPass>,
}

/// Probing at one stiffness: medians over the strokes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProbingSummary {
    /// `K` \[N/m\].
    pub stiffness_n_per_m: f64,
    /// `B` \[N s/m\].
    pub damping_n_s_per_m: f64,
    /// Effective mass of the plant's tip at the pose of the first touch, with all joints free
    /// \[kg\]; zero at a singular pose.
    pub effective_mass_kg: f64,
    /// `m v (1 + e)`: impulse of an impact of that mass at `approach_m_per_s` with `restitution` \[N s\].
    pub impact_theory_newton_s: f64,
    /// Contact: each value is the median over the strokes.
    #[serde(flatten)]
    pub contact: Stroke,
    /// Root mean square error during the descent, before contact \[m\].
    pub free_rms_m: f64,
    /// Set if a fault ended the run.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub ended: Option<FaultEnd>,
}

/// Impulse between two neighbouring stiffnesses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ImpulseSlope {
    /// Lower stiffness \[N/m\].
    pub from_n_per_m: f64,
    /// Higher stiffness \[N/m\].
    pub to_n_per_m: f64,
    /// Change of the impulse over that of the stiffness \[N s per N/m\].
    pub slope: f64,
}

/// Statistics over the probing runs with K of at least 5 N/m.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactStatistics {
    /// Line of impulse against stiffness \[N s per N/m; N s\]; `None` if the runs do not determine a line. The
    /// impulse is not linear in the stiffness, so the intercept is neither the impact nor the impulse at low stiffness;
    /// for these see the single runs.
    pub impulse_fit: Option<LineFit>,
    /// The curve: slope of the impulse from each stiffness to the next, over all runs.
    pub impulse_slopes: Vec<ImpulseSlope>,
    /// (max - min) / median of the peak force of the first transient.
    pub peak_spread: Option<f64>,
    /// (max - min) / median of that peak force divided by the approach speed.
    pub peak_per_approach_speed_spread: Option<f64>,
}

/// Sinusoid with an exact model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExactModel {
    /// With Coulomb friction in the feed-forward, (3.2).
    pub coulomb: TrackingError,
    /// With the Stribeck effect in the feed-forward.
    pub stribeck: TrackingError,
}

/// All results of the demo.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Version of supple.
    pub version: &'static str,
    /// Name of the arm.
    pub arm: String,
    /// Place and size of the trajectories; the speeds below are those of the paper's size.
    pub paths: Paths,
    /// Seed of the demo.
    pub seed: u64,
    /// Source of the controllers' model if it is not the arm's own parameters; that model is unperturbed in
    /// every run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Effects of a real arm in the plant of every run but `realistic`; empty without any.
    pub plant: PlantOptions,
    /// Sinusoid and arc on the realistic plant, or on that of `plant` if it has options, with a model calibrated on the
    /// same arm; absent if these runs were left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub realistic: Option<CalibratedRuns>,
    /// The same on the plant without options; absent if another plant or a model was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ideal: Option<CalibratedRuns>,
    /// Reason why no model was identified on the arm; figures 5 and 6 then have the perturbed model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_identified: Option<String>,
    /// Figure 3a.
    pub sinusoid: TrackingError,
    /// Figure 3a at half, once and twice the paper's speed.
    pub sinusoid_by_speed: Vec<TrackingAtSpeed>,
    /// An arc about the base axis, which moves the base joint.
    pub arc: TrackingError,
    /// Figure 4.
    pub torque_rms: TorqueRms,
    /// Figure 3b, with the unperturbed model.
    pub quadrant: QuadrantSummary,
    /// Figure 3b with the perturbed model.
    pub quadrant_perturbed: QuadrantSummary,
    /// Figure 3b at the paper's maximum speed, with the unperturbed model.
    pub quadrant_at_paper_speed: QuadrantSummary,
    /// Figures 5 and 6, with a model identified on the arm.
    pub probing: Vec<ProbingSummary>,
    /// Statistics over these runs.
    #[serde(flatten)]
    pub contact: ContactStatistics,
    /// Probing with the friction feed-forward left on in contact, perturbed model.
    pub probing_fade_off: Vec<ProbingSummary>,
    /// Statistics over these runs.
    pub fade_off: ContactStatistics,
    /// Probing at 5 and 125 N/m with the plant's own parameters in the model: without the model error.
    pub probing_exact_model: Vec<ProbingSummary>,
    /// Probing at 5 and 125 N/m on a block with a sheet of rubber, identified model.
    pub probing_rubber: Vec<ProbingSummary>,
    /// Probing at 5 and 125 N/m with an apparent inertia of 1 kg by the force sensor, (3.6) whole; identified model.
    pub probing_apparent_inertia: Vec<ProbingSummary>,
    /// Figure 3a with that apparent inertia, perturbed model.
    pub sinusoid_apparent_inertia: TrackingError,
    /// Figure 3b at the paper's maximum speed with the damping raised to [`crate::scenario::CORNER_DAMPING_N_S_PER_M`].
    pub quadrant_damped: QuadrantSummary,
    /// Figure 3b at the paper's maximum speed with a speed that falls and rises in
    /// [`crate::scenario::CORNER_RAMP_S`] at each corner, unperturbed model.
    pub quadrant_corner_ramp: QuadrantSummary,
    /// Sinusoid with the plant's own parameters in the model.
    pub sinusoid_exact_model: ExactModel,
    /// Sinusoid with equation (3.6) exactly as printed.
    pub law_as_printed: TrackingError,
    /// Root mean square error of the sinusoid for ten perturbed models \[m\].
    pub perturbed_rms_m: Vec<f64>,
    /// The same runs with their maximum errors and faults.
    pub perturbed_runs: Vec<TrackingError>,
    /// Runs that the arm cannot perform at the size of its paths, with the size at which it performed them. Runs without a size
    /// were left out: their errors are `null`, and probing runs are missing in their list. Only for arms whose settings are
    /// derived from the URDF.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub adapted: Vec<Adapted>,
    /// For such an arm: its weight at the tip and the allowed error. A fault of such an arm on the realistic plant is a result
    /// and not a failure.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub derived: Option<DerivedArm>,
}

/// An arm whose settings are derived from its URDF.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DerivedArm {
    /// Root mean square, over the sinusoid, of the force at the tip that carries the gravity torques \[N\].
    pub tip_weight_n: f64,
    /// Error allowed on the sinusoid, see [`crate::scenario::allowed_error_m`] \[m\].
    pub allowed_error_m: f64,
}
