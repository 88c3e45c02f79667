//! The numbers of a demo, as `summary.json` gives them.

use crate::metrics::LineFit;
use crate::probing::Stroke;
use crate::quadrant::Edge;
use crate::run::Ended;
use crate::trace::JointTorque;
use serde::Serialize;

/// Error of a run in free space.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tracking {
    /// Root mean square distance of the tip from its reference \[m\].
    pub rms_error_m: f64,
    /// Greatest distance \[m\].
    pub max_error_m: f64,
    /// Set where a fault ended the run.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub ended: Option<Ended>,
}

/// The same at a pace.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AtSpeed {
    /// Times the paper's pace, or the speed of the quadrant over the paper's greatest.
    pub speed: f64,
    /// Error.
    #[serde(flatten)]
    pub tracking: Tracking,
}

/// Torque terms of the two joints of figure 4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TorqueRms {
    /// The paper's joint 2 \[N m\].
    pub shoulder_pitch: JointTorque,
    /// The paper's joint 3 \[N m\].
    pub elbow: JointTorque,
}

/// The quadrant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuadrantSummary {
    /// Speed on every piece \[m/s\].
    pub speed_m_per_s: f64,
    /// Error.
    #[serde(flatten)]
    pub tracking: Tracking,
    /// Piece by piece.
    pub edges: Vec<Edge>,
}

/// Probing at one stiffness: middle values over the strokes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Exploration {
    /// `K` \[N/m\].
    pub stiffness_n_per_m: f64,
    /// `B` \[N s/m\].
    pub damping_n_s_per_m: f64,
    /// Contact.
    #[serde(flatten)]
    pub contact: Stroke,
    /// Root mean square error on the way down, before contact \[m\].
    pub free_rms_m: f64,
    /// Set where a fault ended the run.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub ended: Option<Ended>,
}

/// What the probing runs say together, over K from 5 N/m on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contact {
    /// Impulse over stiffness \[N s per N/m; N s\]; `None` where the runs do not determine a line.
    pub impulse_fit: Option<LineFit>,
    /// (max - min) / median of the first transient.
    pub peak_spread: Option<f64>,
    /// The same of the transient over the approach speed.
    pub peak_over_speed_spread: Option<f64>,
}

/// Sinusoid with a model without error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExactModel {
    /// Coulomb friction in the feed-forward, (3.2).
    pub coulomb: Tracking,
    /// With the Stribeck dip.
    pub stribeck: Tracking,
}

/// All of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Version of supple.
    pub version: &'static str,
    /// The arm.
    pub arm: String,
    /// Seed of the demo.
    pub seed: u64,
    /// Where the controllers' model comes from, if it is not the arm's own parameters: it is then
    /// unperturbed in every run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// Figure 3a.
    pub sinusoid: Tracking,
    /// At half, the same and twice the pace.
    pub sinusoid_by_speed: Vec<AtSpeed>,
    /// An arc that moves the base.
    pub arc: Tracking,
    /// Figure 4.
    pub torque_rms: TorqueRms,
    /// Figure 3b, with the unperturbed model.
    pub quadrant: QuadrantSummary,
    /// The same with the perturbed model.
    pub quadrant_perturbed: QuadrantSummary,
    /// The same at the paper's greatest speed.
    pub quadrant_at_paper_speed: QuadrantSummary,
    /// Figures 5 and 6.
    pub exploration: Vec<Exploration>,
    /// What they say together.
    #[serde(flatten)]
    pub contact: Contact,
    /// Probing with the friction feed-forward left on in contact.
    pub exploration_fade_off: Vec<Exploration>,
    /// What they say together.
    pub fade_off: Contact,
    /// With the plant's own parameters in the model.
    pub sinusoid_exact_model: ExactModel,
    /// (3.6) to the letter.
    pub paper_letter: Tracking,
    /// Root mean square error of the sinusoid for ten perturbed models \[m\].
    pub seeds: Vec<f64>,
    /// The same runs with their greatest error, and the fault where one ended a run.
    pub seed_runs: Vec<Tracking>,
}
