//! Joint friction, Eq. (3.2) made continuous, with the Stribeck effect and an offset.
//!
//! ```text
//! D(v) = [V + A p(v / delta)] v + O + O_s e(v) + [S + (S_0 - S) e(v)] p(v / delta)
//! e(v) = exp(-(v / v_s)^2)
//! p(x) = 2 x - sign(x) x^2  for |x| <= 1,   sign(x) beyond
//! ```
//!
//! After a reversal, real dry friction reverses over a distance `d` (presliding), independent of the velocity. If `d` is known,
//! the law replaces `p` by a state that follows the reference (Dahl 1968):
//!
//! ```text
//! p' = v (1 - p sign(v)) / d
//! ```
//!
//! `A` makes viscous friction differ by direction: `V + A` in the positive, `V - A` in the negative one. Dry friction that differs
//! by direction is `S` and the offset `O` together, breakaway torque that does so `S_0` and `O + O_s`
//! together; `|O_s| <= S_0 - S`, so that friction falls with the speed in both directions.
//!
//! Gears add dry friction in proportion to a torque, `L |tau|`: the load torque of the joint, or the torque of the motor. The
//! motor torque is `tau = g +- S` at a load `g`; friction is then greater if the motor drives the load than if the load drives
//! the motor. The stiffness of what yields in presliding does not depend on the load, so that `d` is in proportion to the dry friction.
//!
//! As printed, the inner branch of (3.2) is `S/delta (sign(v) v^2/delta + 2 v)`; at `|v| =
//! delta` it has the value `3 S`, while the outer branch has the value `S`. With the opposite sign of the parabola,
//! value and slope are continuous: `D` is continuously differentiable in `v`.

use crate::math::{abs, exp};
use core::fmt;

/// Maximum `load_coefficient`: with a greater coefficient, a torque at the output of the gear could hardly move it.
pub const MAX_LOAD_COEFFICIENT: f64 = 0.5;

/// Minimum ratio of the presliding distance at a load to the given one, so that it is positive.
const MIN_DISTANCE_RATIO: f64 = 1e-6;

/// Relative error of torques after scaling.
const ROUNDING: f64 = 1e-12;

/// The torque in proportion to which a gear adds dry friction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LoadTorque {
    /// Load torque of the joint.
    #[default]
    Joint,
    /// Torque of the motor, which also has to overcome friction.
    Motor,
}

/// Friction of one joint. [`Friction::NONE`] is a frictionless joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// `V` \[N m s/rad\], zero or more.
    pub viscous_nm_s_per_rad: f64,
    /// `A`, half of the difference between the viscous friction of both directions \[N m s/rad\], positive if that of the positive
    /// direction is greater; its magnitude is at most `viscous_nm_s_per_rad`.
    pub viscous_asymmetry_nm_s_per_rad: f64,
    /// `S`, Coulomb torque in steady sliding \[N m\], zero or more.
    pub coulomb_nm: f64,
    /// `S_0`, the torque the Stribeck curve tends to at rest \[N m\], at least `coulomb_nm`; if
    /// equal, there is no Stribeck effect and the law is (3.2).
    pub breakaway_nm: f64,
    /// `v_s`, the speed over which the Stribeck effect decays \[rad/s\], positive.
    pub stribeck_rad_per_s: f64,
    /// `O`, torque that does not depend on the velocity \[N m\].
    pub offset_nm: f64,
    /// `O_s`, torque at rest in addition to `offset_nm`, which falls with the Stribeck effect \[N m\]: breakaway torque that differs by
    /// direction in another way than the friction of steady sliding.
    pub stribeck_offset_nm: f64,
    /// `delta`, half-width of the band of (3.2) in which friction is a parabola \[rad/s\], positive.
    pub band_rad_per_s: f64,
    /// `d`, distance over which dry friction reverses after a reversal of motion \[rad\]; zero: dry friction has the direction of
    /// the velocity. Where friction depends on the load: at `coulomb_at_nm`.
    pub presliding_rad: f64,
    /// `L`, dry friction that a torque on the gear adds, per torque, 0 to 0.5; zero: friction does not depend on the load.
    pub load_coefficient: f64,
    /// The torque to which `load_coefficient` refers.
    pub load_torque: LoadTorque,
    /// Magnitude of that torque at which dry friction is `coulomb_nm` and `breakaway_nm` \[N m\], zero or more;
    /// `load_coefficient` times it is at most `coulomb_nm`.
    pub coulomb_at_nm: f64,
}

/// An entry of a [`Friction`] that is not physical, with its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionError {
    /// Name of the entry, as in [`Friction`].
    pub entry: &'static str,
    /// Value found.
    pub value: f64,
    /// Requirement.
    pub must: &'static str,
}

impl fmt::Display for FrictionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} is {}, it must be {}",
            self.entry, self.value, self.must
        )
    }
}

impl core::error::Error for FrictionError {}

impl Friction {
    /// No friction.
    pub const NONE: Friction = Friction {
        viscous_nm_s_per_rad: 0.0,
        viscous_asymmetry_nm_s_per_rad: 0.0,
        coulomb_nm: 0.0,
        breakaway_nm: 0.0,
        stribeck_rad_per_s: 0.05,
        offset_nm: 0.0,
        stribeck_offset_nm: 0.0,
        band_rad_per_s: 0.01,
        presliding_rad: 0.0,
        load_coefficient: 0.0,
        load_torque: LoadTorque::Joint,
        coulomb_at_nm: 0.0,
    };

    /// Returns viscous and Coulomb friction, the paper's `V` and `S`, with the default band and no Stribeck
    /// effect.
    pub const fn coulomb(viscous_nm_s_per_rad: f64, coulomb_nm: f64) -> Friction {
        Friction {
            viscous_nm_s_per_rad,
            coulomb_nm,
            breakaway_nm: coulomb_nm,
            ..Friction::NONE
        }
    }

    /// Rejects friction that would add energy to the joint.
    ///
    /// # Errors
    /// The first invalid entry.
    pub fn validate(&self) -> Result<(), FrictionError> {
        let at_least = |entry, value: f64, min: f64, must| {
            if value.is_finite() && value >= min {
                Ok(())
            } else {
                Err(FrictionError { entry, value, must })
            }
        };
        let not_negative = "finite and not negative";
        at_least(
            "viscous_nm_s_per_rad",
            self.viscous_nm_s_per_rad,
            0.0,
            not_negative,
        )?;
        let viscous = self.viscous_nm_s_per_rad;
        // A NaN is not within the bounds.
        if !(-viscous..=viscous).contains(&self.viscous_asymmetry_nm_s_per_rad) {
            return Err(FrictionError {
                entry: "viscous_asymmetry_nm_s_per_rad",
                value: self.viscous_asymmetry_nm_s_per_rad,
                must: "finite and at most viscous_nm_s_per_rad in magnitude",
            });
        }
        at_least("coulomb_nm", self.coulomb_nm, 0.0, not_negative)?;
        at_least(
            "breakaway_nm",
            self.breakaway_nm,
            self.coulomb_nm,
            "finite and at least coulomb_nm",
        )?;
        at_least(
            "stribeck_rad_per_s",
            self.stribeck_rad_per_s,
            f64::MIN_POSITIVE,
            "finite and positive",
        )?;
        at_least("offset_nm", self.offset_nm, f64::MIN, "finite")?;
        // One direction may have no excess: the bound then holds up to rounding.
        let excess_nm = self.breakaway_nm - self.coulomb_nm + ROUNDING * self.breakaway_nm;
        // A NaN is not within the bounds.
        if !(-excess_nm..=excess_nm).contains(&self.stribeck_offset_nm) {
            return Err(FrictionError {
                entry: "stribeck_offset_nm",
                value: self.stribeck_offset_nm,
                must: "finite and at most breakaway_nm less coulomb_nm in magnitude",
            });
        }
        at_least("presliding_rad", self.presliding_rad, 0.0, not_negative)?;
        if !(0.0..=MAX_LOAD_COEFFICIENT).contains(&self.load_coefficient) {
            return Err(FrictionError {
                entry: "load_coefficient",
                value: self.load_coefficient,
                must: "from 0 to 0.5",
            });
        }
        at_least("coulomb_at_nm", self.coulomb_at_nm, 0.0, not_negative)?;
        at_least(
            "coulomb_nm",
            self.coulomb_nm,
            self.load_coefficient * self.coulomb_at_nm,
            "finite and at least load_coefficient times coulomb_at_nm",
        )?;
        at_least(
            "band_rad_per_s",
            self.band_rad_per_s,
            f64::MIN_POSITIVE,
            "finite and positive",
        )
    }

    /// Returns the sliding friction while the joint carries `load_nm` \[N m\]: the dry part is the mean of both directions, and
    /// half of their difference is added to the offset, as for the viscous part to its asymmetry. The Stribeck effect, except for its
    /// offset, and the presliding distance are in proportion to the dry part.
    #[inline]
    pub fn at_load(&self, load_nm: f64) -> Friction {
        let (share, size_nm) = (self.load_coefficient, abs(load_nm));
        let unloaded_nm = self.coulomb_nm - share * self.coulomb_at_nm;
        let loaded_nm = unloaded_nm + share * size_nm;
        // S = S_u + L |g + S| if the motor drives the load; S = S_u + L |g - S| if the load drives the motor or,
        // if the load is small, assists it.
        let (driving_nm, driven_nm) = match self.load_torque {
            LoadTorque::Joint => (loaded_nm, loaded_nm),
            LoadTorque::Motor if size_nm > unloaded_nm => {
                (loaded_nm / (1.0 - share), loaded_nm / (1.0 + share))
            }
            LoadTorque::Motor => (
                loaded_nm / (1.0 - share),
                (unloaded_nm - share * size_nm) / (1.0 - share),
            ),
        };
        let coulomb_nm = 0.5 * (driving_nm + driven_nm);
        let offset_nm = (0.5 * (driving_nm - driven_nm)).copysign(load_nm);
        let ratio = if self.coulomb_nm > 0.0 {
            coulomb_nm / self.coulomb_nm
        } else {
            1.0
        };
        let (viscous, asymmetry) = self.viscous_at_load(load_nm, unloaded_nm);
        Friction {
            viscous_nm_s_per_rad: viscous,
            viscous_asymmetry_nm_s_per_rad: asymmetry,
            coulomb_nm,
            breakaway_nm: self.breakaway_nm * ratio,
            offset_nm: self.offset_nm + offset_nm,
            presliding_rad: self.presliding_rad * ratio.max(MIN_DISTANCE_RATIO),
            ..*self
        }
    }

    /// Returns `V` and `A` while the joint carries `load_nm`. The motor also overcomes the viscous friction, which adds dry friction
    /// by `L V |v|` if the motor drives the load, and relieves the motor by as much if the load drives it: `V / (1 - L)` and
    /// `V / (1 + L)`. A load near the dry friction `unloaded_nm` is between the two, so that the torque is continuous.
    #[inline]
    fn viscous_at_load(&self, load_nm: f64, unloaded_nm: f64) -> (f64, f64) {
        let (viscous, asymmetry) = (
            self.viscous_nm_s_per_rad,
            self.viscous_asymmetry_nm_s_per_rad,
        );
        let share = self.load_coefficient;
        if self.load_torque == LoadTorque::Joint || share == 0.0 {
            return (viscous, asymmetry);
        }
        let (driving, driven) = (1.0 / (1.0 - share), 1.0 / (1.0 + share));
        let beyond = (abs(load_nm) - unloaded_nm) / unloaded_nm.max(f64::MIN_POSITIVE);
        let by_load = driving + beyond.clamp(0.0, 1.0) * (driven - driving);
        let (positive, negative) = match load_nm < 0.0 {
            true => (by_load, driving),
            false => (driving, by_load),
        };
        let positive = (viscous + asymmetry) * positive;
        let negative = (viscous - asymmetry) * negative;
        (0.5 * (positive + negative), 0.5 * (positive - negative))
    }

    /// Returns `factor` times this friction, at `factor` times the load.
    pub fn scaled(&self, factor: f64) -> Friction {
        Friction {
            viscous_nm_s_per_rad: self.viscous_nm_s_per_rad * factor,
            viscous_asymmetry_nm_s_per_rad: self.viscous_asymmetry_nm_s_per_rad * factor,
            coulomb_nm: self.coulomb_nm * factor,
            breakaway_nm: self.breakaway_nm * factor,
            offset_nm: self.offset_nm * factor,
            stribeck_offset_nm: self.stribeck_offset_nm * factor,
            coulomb_at_nm: self.coulomb_at_nm * factor,
            ..*self
        }
    }

    /// Returns this friction with `factor` times its viscous friction; `factor` is zero or more.
    pub fn with_viscous_scaled(&self, factor: f64) -> Friction {
        Friction {
            viscous_nm_s_per_rad: self.viscous_nm_s_per_rad * factor,
            viscous_asymmetry_nm_s_per_rad: self.viscous_asymmetry_nm_s_per_rad * factor,
            ..*self
        }
    }

    /// Returns this friction with `factor` times its dry friction; `factor` is zero or more.
    pub fn with_dry_scaled(&self, factor: f64) -> Friction {
        Friction {
            coulomb_nm: self.coulomb_nm * factor,
            breakaway_nm: self.breakaway_nm * factor,
            stribeck_offset_nm: self.stribeck_offset_nm * factor,
            load_coefficient: (self.load_coefficient * factor).min(MAX_LOAD_COEFFICIENT),
            ..*self
        }
    }

    /// Returns the uncertainty of the dry friction at `velocity_rad_per_s` \[N m\]: the whole dry friction at rest, because
    /// stiction may act in either direction, and the fraction `relative_error` of it in fast sliding.
    #[inline]
    pub fn uncertainty_nm(&self, velocity_rad_per_s: f64, relative_error: f64) -> f64 {
        self.coulomb_nm * relative_error
            + self.breakaway_nm * self.stribeck_share(velocity_rad_per_s)
    }

    /// Returns `D(v)`, the torque that overcomes friction at joint velocity `velocity_rad_per_s` \[N m\].
    #[inline]
    pub fn torque_nm(&self, velocity_rad_per_s: f64) -> f64 {
        self.torque_with_dry_share_nm(velocity_rad_per_s, 1.0)
    }

    /// Returns `D(v)` with a fraction `share` of its dry part, 0 to 1 \[N m\].
    #[inline]
    pub fn torque_with_dry_share_nm(&self, velocity_rad_per_s: f64, share: f64) -> f64 {
        self.viscous_torque_nm(velocity_rad_per_s)
            + self.offset_at_nm(velocity_rad_per_s)
            + self.dry_torque_nm(velocity_rad_per_s) * share
    }

    /// Returns `O + O_s e(v)` \[N m\].
    #[inline]
    pub fn offset_at_nm(&self, velocity_rad_per_s: f64) -> f64 {
        if self.stribeck_offset_nm == 0.0 {
            return self.offset_nm;
        }
        self.offset_nm + self.stribeck_offset_nm * self.stribeck_share(velocity_rad_per_s)
    }

    /// Returns `e(v)`, the fraction of the Stribeck effect at this velocity, 0 to 1.
    #[inline]
    pub fn stribeck_share(&self, velocity_rad_per_s: f64) -> f64 {
        let s = velocity_rad_per_s / self.stribeck_rad_per_s;
        exp(-s * s)
    }

    /// Returns the viscous part of `D(v)`, `[V + A p(v / delta)] v` \[N m\].
    #[inline]
    pub fn viscous_torque_nm(&self, velocity_rad_per_s: f64) -> f64 {
        let viscous = self.viscous_nm_s_per_rad;
        let asymmetry = self.viscous_asymmetry_nm_s_per_rad;
        if asymmetry == 0.0 {
            return viscous * velocity_rad_per_s;
        }
        (viscous + asymmetry * self.direction(velocity_rad_per_s)) * velocity_rad_per_s
    }

    /// Returns `p(v / delta)`: the sign of the velocity, continuous in the band; -1 to 1.
    #[inline]
    pub fn direction(&self, velocity_rad_per_s: f64) -> f64 {
        let x = velocity_rad_per_s / self.band_rad_per_s;
        if abs(x) <= 1.0 {
            x * (2.0 - abs(x))
        } else {
            1.0_f64.copysign(x)
        }
    }

    /// Returns the dry part of `D(v)`: Coulomb torque with the Stribeck effect, parabolic in the band \[N
    /// m\].
    #[inline]
    pub fn dry_torque_nm(&self, velocity_rad_per_s: f64) -> f64 {
        self.dry_size_nm(velocity_rad_per_s) * self.direction(velocity_rad_per_s)
    }

    /// Returns the magnitude of the dry part of `D(v)`: Coulomb torque with the Stribeck effect \[N m\].
    #[inline]
    pub fn dry_size_nm(&self, velocity_rad_per_s: f64) -> f64 {
        let dip = self.breakaway_nm - self.coulomb_nm;
        let rise = if dip > 0.0 {
            dip * self.stribeck_share(velocity_rad_per_s)
        } else {
            0.0
        };
        self.coulomb_nm + rise
    }

    /// Returns `D(v)` with dry friction in the given direction, -1 to 1, multiplied by `share`, 0 to 1 \[N m\].
    #[inline]
    pub fn torque_in_direction_nm(
        &self,
        velocity_rad_per_s: f64,
        direction: f64,
        share: f64,
    ) -> f64 {
        self.viscous_torque_nm(velocity_rad_per_s)
            + self.offset_at_nm(velocity_rad_per_s)
            + self.dry_size_nm(velocity_rad_per_s) * direction * share
    }

    /// Returns the direction of the dry friction after a further motion of `travel_rad`, which is signed, from `direction`.
    /// Requires presliding.
    #[inline]
    pub fn direction_after(&self, direction: f64, travel_rad: f64) -> f64 {
        let to = 1.0_f64.copysign(travel_rad);
        to + (direction - to) * exp(-abs(travel_rad) / self.presliding_rad)
    }
}
