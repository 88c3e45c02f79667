//! Contact latch: detects contact at the tip and fades the friction feed-forward.
//!
//! A blocked arm keeps pushing with the friction compensation, about `S / r`, which at low
//! stiffness *is* the contact force. The latch closes when the observed force against the
//! reference's motion exceeds a threshold, fades the feed-forward, and opens when the reference
//! retreats.

use crate::config::ContactLatch;
use crate::math::{Vector3, sqrt};

/// Minimum reference speed for which a direction is defined \[m/s\].
const MIN_SPEED_M_PER_S: f64 = 1e-3;

/// State of the latch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latch {
    /// Direction of motion of the reference; the last one while the reference rests, zero before it
    /// has moved.
    direction: Vector3<f64>,
    since_reversal_s: f64,
    in_contact: bool,
    /// Fraction of the friction feed-forward that is applied, 0 to 1.
    share: f64,
    force_against_n: f64,
    threshold_n: f64,
}

impl Default for Latch {
    fn default() -> Self {
        Latch {
            direction: Vector3::zeros(),
            since_reversal_s: 0.0,
            in_contact: false,
            share: 1.0,
            force_against_n: 0.0,
            threshold_n: 0.0,
        }
    }
}

impl Latch {
    /// Whether contact is latched.
    pub fn in_contact(&self) -> bool {
        self.in_contact
    }

    /// Fraction of the friction feed-forward to apply, 0 to 1.
    pub fn friction_share(&self) -> f64 {
        self.share
    }

    /// Observed force against the reference's motion \[N\].
    pub fn force_against_n(&self) -> f64 {
        self.force_against_n
    }

    /// Current threshold of the force against the reference's motion \[N\].
    pub fn threshold_n(&self) -> f64 {
        self.threshold_n
    }

    /// Direction of motion of the reference; the last one while the reference rests, zero before it
    /// has moved.
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// First half of a cycle: updates the direction from the reference's `velocity` \[m/s\]. A
    /// reversal of the reference opens the latch.
    pub fn update_direction(&mut self, velocity: &Vector3<f64>, elapsed_s: f64) {
        self.since_reversal_s += elapsed_s;
        let speed = sqrt(velocity.dot(velocity));
        if speed <= MIN_SPEED_M_PER_S {
            return;
        }
        let direction = velocity / speed;
        if direction.dot(&self.direction) <= 0.0 {
            self.since_reversal_s = 0.0;
            self.in_contact = false;
            self.direction = direction;
        } else if !self.in_contact {
            self.direction = direction;
        }
    }

    /// Second half of a cycle: compares the observed tip force `force_n` with the threshold, which
    /// grows by the friction uncertainty `friction_uncertainty_n` along the direction.
    pub fn update_contact(
        &mut self,
        config: &ContactLatch,
        force_n: &Vector3<f64>,
        friction_uncertainty_n: f64,
        elapsed_s: f64,
    ) {
        self.force_against_n = -force_n.dot(&self.direction);
        let reversing = self.since_reversal_s < config.reversal_s;
        self.threshold_n =
            (config.threshold_n + friction_uncertainty_n) * if reversing { 2.0 } else { 1.0 };
        self.in_contact |= self.force_against_n > self.threshold_n;
        let faded = self.in_contact && config.fade;
        self.share = if faded {
            (self.share - elapsed_s / config.fade_s).max(config.contact_share.min(self.share))
        } else {
            (self.share + elapsed_s / config.restore_s).min(1.0)
        };
    }
}
