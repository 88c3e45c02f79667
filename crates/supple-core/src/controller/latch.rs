//! Contact latch: detects contact at the tip and fades the friction feed-forward.
//!
//! A blocked arm keeps pushing with the friction compensation, a tip force of about `S / r` (dry friction over lever arm), which
//! at low stiffness is most of the contact force. The latch closes when the observed force against the
//! reference's motion exceeds a threshold, fades the feed-forward, and opens when the reference
//! retreats.
//!
//! A latch that closed by mistake opens by itself, in two cases. If the tip moves at more than half of the
//! reference's speed for 10 ms, without a force above the threshold, nothing blocks it. And a contact is
//! confirmed only if the tip is slower than that at some time before the feed-forward fades; without it
//! the latch opens after `release_s`, and if the force exceeds the threshold again soon, the contact counts
//! as confirmed.

use super::residual::ResidualScale;
use crate::config::ContactLatch;
use crate::math::{Vector3, sqrt};

/// Minimum reference speed for which a direction is defined \[m/s\].
const MIN_SPEED_M_PER_S: f64 = 1e-3;
/// Fraction of the reference's speed above which the tip counts as following it.
const FOLLOWING_SHARE: f64 = 0.5;
/// Time for which the tip must follow the reference until the latch opens \[s\]. Friction takes longer to stop an arm whose
/// feed-forward has begun to fade.
const FOLLOWING_S: f64 = 0.01;
/// Minimum time after the latch closes in which a slowed tip confirms the contact, even if the feed-forward fades earlier \[s\].
const SLOWED_S: f64 = 0.005;
/// Time over which the force at rest is averaged \[s\].
const RESTING_S: f64 = 0.1;
/// Time after a release in which the next contact counts as confirmed \[s\].
const AGAIN_S: f64 = 0.5;

/// Inputs of the contact latch in one cycle.
#[derive(Clone, Copy, Debug)]
pub struct LatchInput {
    /// Observed force on the tip, base axes \[N\].
    pub force_n: Vector3<f64>,
    /// Uncertainty of the joints' friction along the reference's direction, which is added to the threshold \[N\].
    pub friction_uncertainty_n: f64,
    /// Velocity of the tip, base axes \[m/s\].
    pub tip_velocity_m_per_s: Vector3<f64>,
}

/// State of the latch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latch {
    /// Direction of motion of the reference; the last one while the reference rests, zero before it
    /// has moved.
    direction: Vector3<f64>,
    since_reversal_s: f64,
    reference_m_per_s: f64,
    in_contact: bool,
    /// Whether the tip's motion has confirmed the contact, or the force has exceeded the threshold twice.
    confirmed: bool,
    latched_s: f64,
    following_s: f64,
    /// Whether the tip has followed the reference since its last reversal.
    has_followed: bool,
    /// Time since the latch opened by itself \[s\].
    since_release_s: f64,
    residual: ResidualScale,
    /// Mean observed force at rest, which static friction holds \[N\].
    resting_force_n: Vector3<f64>,
    /// Fraction of the friction feed-forward that is applied, 0 to 1.
    share: f64,
    held: f64,
    force_against_n: f64,
    threshold_n: f64,
}

impl Latch {
    /// Returns an open latch before any motion; `estimator_rad_per_s` is the bandwidth of the velocity estimate.
    pub fn new(config: &ContactLatch, estimator_rad_per_s: f64) -> Self {
        let residual = ResidualScale::new(config.false_alarms_per_hour, estimator_rad_per_s);
        Latch::open(residual, Vector3::zeros())
    }

    /// Returns an open latch before any motion that keeps the residual statistics of this one.
    pub fn restarted(&self) -> Self {
        Latch::open(self.residual, self.resting_force_n)
    }

    fn open(residual: ResidualScale, resting_force_n: Vector3<f64>) -> Self {
        Latch {
            direction: Vector3::zeros(),
            since_reversal_s: 0.0,
            reference_m_per_s: 0.0,
            in_contact: false,
            confirmed: false,
            latched_s: 0.0,
            following_s: 0.0,
            has_followed: false,
            since_release_s: f64::MAX,
            residual,
            resting_force_n,
            share: 1.0,
            held: 0.0,
            force_against_n: 0.0,
            threshold_n: 0.0,
        }
    }

    /// Returns whether contact is latched.
    pub fn in_contact(&self) -> bool {
        self.in_contact
    }

    /// Returns the fraction of the friction feed-forward to apply, 0 to 1.
    pub fn friction_share(&self) -> f64 {
        self.share
    }

    /// Returns the fraction of the dry friction feed-forward that keeps its value at the start of the contact, 0 to 1: one in
    /// contact, decreasing to zero after release.
    pub fn held(&self) -> f64 {
        self.held
    }

    /// Returns the fraction of the viscous friction feed-forward to apply, 0 to 1; zero while the arm is blocked.
    pub fn viscous_share(&self, config: &ContactLatch) -> f64 {
        let fades = 1.0 - config.contact_share;
        if fades > 0.0 {
            ((self.share - config.contact_share) / fades).clamp(0.0, 1.0)
        } else {
            1.0 - self.held
        }
    }

    /// Returns the observed force against the reference's motion \[N\].
    pub fn force_against_n(&self) -> f64 {
        self.force_against_n
    }

    /// Returns the current threshold of the force against the reference's motion \[N\].
    pub fn threshold_n(&self) -> f64 {
        self.threshold_n
    }

    /// Returns the direction of motion of the reference; the last one while the reference rests, zero before it
    /// has moved.
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// Does the first half of a cycle: updates the direction from the reference's `velocity` \[m/s\]. A
    /// reversal of the reference opens the latch.
    #[inline]
    pub fn update_direction(&mut self, velocity: &Vector3<f64>, elapsed_s: f64) {
        self.since_reversal_s += elapsed_s;
        let speed = sqrt(velocity.dot(velocity));
        self.reference_m_per_s = speed;
        if speed <= MIN_SPEED_M_PER_S {
            return;
        }
        let direction = velocity / speed;
        if direction.dot(&self.direction) <= 0.0 {
            self.since_reversal_s = 0.0;
            self.in_contact = false;
            self.has_followed = false;
            self.direction = direction;
        } else if !self.in_contact {
            self.direction = direction;
        }
    }

    /// Adds the observed force of an arm that is expected to be at rest \[N\]. Its changes are noise; its mean is the force that
    /// static friction holds.
    #[inline]
    pub fn observe_at_rest(
        &mut self,
        config: &ContactLatch,
        force_n: &Vector3<f64>,
        elapsed_s: f64,
    ) {
        let noise_n = force_n - self.resting_force_n;
        self.resting_force_n += noise_n * (elapsed_s / RESTING_S).min(1.0);
        let size_n = sqrt(noise_n.dot(&noise_n));
        self.residual.add(size_n / config.threshold_n, elapsed_s);
    }

    /// Does the second half of a cycle: compares the observed tip force with the threshold.
    #[inline]
    pub fn update_contact(&mut self, config: &ContactLatch, input: &LatchInput, elapsed_s: f64) {
        self.force_against_n = -input.force_n.dot(&self.direction);
        let reversing = self.since_reversal_s < config.reversal_s;
        let configured_n = config.threshold_n + input.friction_uncertainty_n;
        let factor = self.residual.factor() * if reversing { 2.0 } else { 1.0 };
        self.threshold_n = configured_n * factor;
        let pushed = self.force_against_n > self.threshold_n;
        let tip_m_per_s = input.tip_velocity_m_per_s.dot(&self.direction);
        let follows = self.reference_m_per_s > MIN_SPEED_M_PER_S
            && tip_m_per_s >= FOLLOWING_SHARE * self.reference_m_per_s;
        self.since_release_s += elapsed_s;
        if self.in_contact {
            self.latched_s += elapsed_s;
            self.confirmed |= !follows && self.latched_s <= config.settle_s.max(SLOWED_S);
            self.following_s = match follows && !pushed {
                true => self.following_s + elapsed_s,
                false => 0.0,
            };
            if self.is_false(config) {
                (self.in_contact, self.since_release_s) = (false, 0.0);
            }
        } else if pushed {
            self.in_contact = true;
            self.confirmed = !follows || self.since_release_s < AGAIN_S;
            (self.latched_s, self.following_s) = (0.0, 0.0);
        } else if self.share >= 1.0 && !reversing && (follows || !self.has_followed) {
            // A tip that followed and then stopped may be blocked; the force is then no residual.
            self.has_followed |= follows;
            self.residual
                .add(self.force_against_n / configured_n, elapsed_s);
        }
        if self.in_contact && config.fade {
            self.held = 1.0;
            if self.latched_s >= config.settle_s {
                let faded = self.share - elapsed_s / config.fade_s;
                self.share = faded.max(config.contact_share.min(self.share));
            }
        } else {
            let restored = elapsed_s / config.restore_s;
            self.share = (self.share + restored).min(1.0);
            self.held = (self.held - restored).max(0.0);
        }
    }

    /// Returns whether the latch closed by mistake: the tip follows the reference, or nothing has confirmed the contact in time.
    #[inline]
    fn is_false(&self, config: &ContactLatch) -> bool {
        config.release_s.is_finite()
            && (self.following_s >= FOLLOWING_S
                || !self.confirmed && self.latched_s >= config.release_s)
    }
}
