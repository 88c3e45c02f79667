//! Options of a fit.

use crate::cancellation::Cancellation;
use crate::columns::FrictionColumns;
use crate::effects::Effects;

/// Weights of the joints' residuals.
#[derive(Clone, Debug, PartialEq)]
pub enum Weights {
    /// Equal weights: ordinary least squares.
    Equal,
    /// Inverse variance of each joint's residual: weighted least squares.
    ByJointResidual,
    /// As `ByJointResidual`, with Huber weights against outliers.
    Huber,
    /// Given standard deviation of the torque noise of each identified joint \[N m\].
    Given(Vec<f64>),
}

/// Options of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Whether to fit a rotor inertia for each identified joint; otherwise the nominal rotors are taken as known.
    pub rotor: bool,
    /// Friction columns.
    pub friction: FrictionColumns,
    /// Pairs of joints coupled by a gear: one motor turns with the sum of their angles.
    pub couplings: Vec<(usize, usize)>,
    /// Other effects.
    pub effects: Effects,
    /// Samples of a joint slower than this are excluded from its rows \[rad/s\]. A Stribeck column is then
    /// fitted to the slow samples in a second stage.
    pub slow_rad_per_s: f64,
    /// Weights of joints and samples.
    pub weights: Weights,
    /// `Some(weight of the prior)`: physically consistent estimate, see
    /// [`crate::constrained_least_squares::Constraints::prior_weight`]; `None`: plain least squares. In a consistent estimate great offsets
    /// have a cost, of a strength that does not depend on this weight.
    pub consistent_prior_weight: Option<f64>,
    /// Prior standard deviation of each rotor inertia, relative to the inertia of the nominal arm; `None`: unknown.
    pub rotor_deviation: Option<f64>,
    /// Ends the fit early.
    pub cancellation: Cancellation,
}

impl Default for Options {
    /// Viscous and Coulomb friction with offset, rotors, samples below 0.15 rad/s excluded, weighted by joint,
    /// physically consistent.
    fn default() -> Self {
        Self {
            rotor: true,
            friction: FrictionColumns::COULOMB_AND_OFFSET,
            couplings: Vec::new(),
            effects: Effects::default(),
            slow_rad_per_s: 0.15,
            weights: Weights::ByJointResidual,
            consistent_prior_weight: Some(1.0),
            rotor_deviation: None,
            cancellation: Cancellation::default(),
        }
    }
}
