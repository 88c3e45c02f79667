//! Variation of the joints' friction with angle, direction, load and temperature.
//!
//! ```text
//! varied   = (1 + a sin(n q + phase)) (1 + d sign(v))
//! dry     *= (varied + g |tau| / S) (1 + c_S exp(-t / T))
//! viscous *= varied (1 + f l (2 + sign(v)) / 3) (1 + c_V exp(-t / T))
//! ```
//!
//! `sign` is continuous: `v / v_s`, limited to -1..1. `t` is the time since the cold start. Temperature is not modelled;
//! the exponential is the response of one thermal mass to constant heating. `tau` is the torque that the motor transmits,
//! `S` the Coulomb torque: gears under load have more friction. `l` is the gravity load of the joint; the variation of the
//! dry friction with it is part of [`crate::LuGre`].

use crate::error::{PlantError, entry};
use supple_core::Vector;

/// Factors of dry and viscous friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionScale {
    /// Factor of the dry friction, positive.
    pub dry: f64,
    /// Factor of the viscous friction, zero or more.
    pub viscous: f64,
}

impl FrictionScale {
    /// No change.
    pub const ONE: FrictionScale = FrictionScale {
        dry: 1.0,
        viscous: 1.0,
    };
}

/// Variation of the friction with angle, direction and time.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionVariation<const N: usize> {
    /// `a`, 0 to 0.5.
    pub angle_fraction: f64,
    /// `n`, periods per revolution of the joint.
    pub periods_per_revolution: f64,
    /// Phase of each joint \[rad\].
    pub phase_rad: Vector<N>,
    /// `d` of each joint, -0.5 to 0.5: positive if motion in the positive direction has more friction.
    pub direction_fraction: Vector<N>,
    /// `f`, 0 to 0.5.
    pub viscous_load_fraction: f64,
    /// `g`, 0 to 0.5.
    pub gear_fraction: f64,
    /// `c_S`, excess of the dry friction when cold, -0.9 to 10.
    pub cold_dry_fraction: f64,
    /// `c_V`, excess of the viscous friction when cold, -0.9 to 10.
    pub cold_viscous_fraction: f64,
    /// `T` \[s\], positive.
    pub warm_up_s: f64,
    /// `t` at the start of the plant \[s\], zero or more.
    pub warmed_s: f64,
}

impl<const N: usize> FrictionVariation<N> {
    /// Returns the constant friction.
    pub fn none() -> FrictionVariation<N> {
        FrictionVariation {
            angle_fraction: 0.0,
            periods_per_revolution: 1.0,
            phase_rad: Vector::zeros(),
            direction_fraction: Vector::zeros(),
            viscous_load_fraction: 0.0,
            gear_fraction: 0.0,
            cold_dry_fraction: 0.0,
            cold_viscous_fraction: 0.0,
            warm_up_s: 600.0,
            warmed_s: 0.0,
        }
    }

    /// Factors from the warm-up alone at `time_s` after the start.
    pub fn warm_up(&self, time_s: f64) -> FrictionScale {
        if self.cold_dry_fraction == 0.0 && self.cold_viscous_fraction == 0.0 {
            return FrictionScale::ONE;
        }
        let cold = libm::exp(-(self.warmed_s + time_s) / self.warm_up_s);
        FrictionScale {
            dry: 1.0 + self.cold_dry_fraction * cold,
            viscous: 1.0 + self.cold_viscous_fraction * cold,
        }
    }

    /// Returns the factor of dry and viscous friction of `joint` from its angle `angle_rad` and its direction of motion, at
    /// `speed` in units of its Stribeck speed.
    pub fn factor(&self, joint: usize, angle_rad: f64, speed: f64) -> f64 {
        let mut factor = 1.0;
        if self.angle_fraction != 0.0 {
            let phase = self.periods_per_revolution * angle_rad + self.phase_rad[joint];
            factor *= 1.0 + self.angle_fraction * libm::sin(phase);
        }
        if self.direction_fraction[joint] != 0.0 {
            factor *= 1.0 + self.direction_fraction[joint] * speed.clamp(-1.0, 1.0);
        }
        factor
    }

    /// Returns the factor of the viscous friction of a joint with this load, 0 to 1, at `speed` in units of its Stribeck speed.
    pub fn viscous_load_factor(&self, load: f64, speed: f64) -> f64 {
        1.0 + self.viscous_load_fraction * load * (2.0 + speed.clamp(-1.0, 1.0)) / 3.0
    }

    pub(crate) fn validate(&self) -> Result<(), PlantError> {
        let check = |field: &str, value: f64, valid: bool, must| {
            let name = format!("friction_variation.{field}");
            entry(valid && value.is_finite(), name, value, must)
        };
        let a = self.angle_fraction;
        let must = "from 0 to 0.5";
        check("angle_fraction", a, (0.0..=0.5).contains(&a), must)?;
        let n = self.periods_per_revolution;
        check(
            "periods_per_revolution",
            n,
            n >= 0.0,
            "finite and not negative",
        )?;
        for i in 0..N {
            check("phase_rad", self.phase_rad[i], true, "finite")?;
            let d = self.direction_fraction[i];
            let must = "from -0.5 to 0.5";
            check("direction_fraction", d, (-0.5..=0.5).contains(&d), must)?;
        }
        let f = self.viscous_load_fraction;
        check(
            "viscous_load_fraction",
            f,
            (0.0..=0.5).contains(&f),
            "from 0 to 0.5",
        )?;
        let g = self.gear_fraction;
        check(
            "gear_fraction",
            g,
            (0.0..=0.5).contains(&g),
            "from 0 to 0.5",
        )?;
        let must = "from -0.9 to 10";
        let range = -0.9..=10.0;
        let c = self.cold_dry_fraction;
        check("cold_dry_fraction", c, range.contains(&c), must)?;
        let c = self.cold_viscous_fraction;
        check("cold_viscous_fraction", c, range.contains(&c), must)?;
        let t = self.warm_up_s;
        check("warm_up_s", t, t > 0.0, "finite and positive")?;
        let t = self.warmed_s;
        check("warmed_s", t, t >= 0.0, "finite and not negative")
    }
}
