//! Joint friction: the LuGre bristle model with Stribeck effect.
//!
//! ```text
//! z' = v - s0 |v| z / g(v)      tau = s0 z + s1 z' + V v + offset
//! g(v) = (S + (S_0 - S) exp(-(v / v_s)^2)) (1 + f l (2 + d) / 3)
//! ```
//!
//! `z` is the bristle's deflection, `l` in 0..1 the joint's load, `d` in -1..1 the direction of motion,
//! `f` the load fraction. In steady sliding the torque is `V v + offset + sign(v) g(v)`. Canudas de
//! Wit, Olsson, Astrom, Lischinsky 1995, "A new model for control of systems with friction". The
//! bristle state is integrated exactly for constant velocity over the step, so it cannot exceed its steady-state
//! deflection. Known limitation: under an oscillating load below breakaway the model drifts.

use crate::error::{PlantError, entry};
use crate::friction_variation::FrictionScale;
use supple_core::Friction;

/// Breakaway torque over Coulomb torque if the given friction has no Stribeck effect.
pub const BREAKAWAY_FACTOR: f64 = 1.1;
/// Deflection of a bristle about to slide at the Coulomb torque \[rad\].
pub const BRISTLE_DEFLECTION_RAD: f64 = 5e-4;
/// Bristle damping over bristle stiffness \[s\].
pub const BRISTLE_TIME_S: f64 = 2e-3;
/// Fraction of the dry friction that depends on load and direction.
pub const LOAD_FRACTION: f64 = 0.02;

/// Friction of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LuGre {
    /// `V` \[N m s/rad\], zero or more.
    pub viscous_nm_s_per_rad: f64,
    /// Half of the difference between the viscous friction of the positive and the negative direction \[N m s/rad\], at most
    /// `viscous_nm_s_per_rad` in magnitude.
    pub viscous_asymmetry_nm_s_per_rad: f64,
    /// `S`, dry torque in fast sliding \[N m\], zero or more.
    pub coulomb_nm: f64,
    /// `S_0`, limit of the dry torque at zero sliding speed \[N m\], at least `coulomb_nm`.
    pub breakaway_nm: f64,
    /// `v_s`, Stribeck speed \[rad/s\], positive.
    pub stribeck_rad_per_s: f64,
    /// Torque that does not depend on the velocity \[N m\].
    pub offset_nm: f64,
    /// Torque at rest in addition to `offset_nm`, which falls with the Stribeck effect \[N m\].
    pub stribeck_offset_nm: f64,
    /// `s0` \[N m/rad\], positive with dry friction, zero without.
    pub bristle_stiffness_nm_per_rad: f64,
    /// `s1` \[N m s/rad\], zero or more.
    pub bristle_damping_nm_s_per_rad: f64,
    /// `f`, fraction of the dry friction that depends on load and direction, 0 to 0.5.
    pub load_fraction: f64,
}

impl LuGre {
    /// No friction at all.
    pub const NONE: LuGre = LuGre {
        viscous_nm_s_per_rad: 0.0,
        viscous_asymmetry_nm_s_per_rad: 0.0,
        coulomb_nm: 0.0,
        breakaway_nm: 0.0,
        stribeck_rad_per_s: 0.05,
        offset_nm: 0.0,
        stribeck_offset_nm: 0.0,
        bristle_stiffness_nm_per_rad: 0.0,
        bristle_damping_nm_s_per_rad: 0.0,
        load_fraction: 0.0,
    };

    /// Returns the friction that equals `friction` in steady sliding outside its band: the same `V`, `S`, `v_s` and
    /// offset. Its Stribeck effect is kept; without one, breakaway is [`BREAKAWAY_FACTOR`] `S`. The load
    /// fraction is [`LOAD_FRACTION`].
    pub fn from_friction(friction: &Friction) -> LuGre {
        let coulomb_nm = friction.coulomb_nm;
        let breakaway_nm = if friction.breakaway_nm > coulomb_nm {
            friction.breakaway_nm
        } else {
            BREAKAWAY_FACTOR * coulomb_nm
        };
        let bristle_stiffness_nm_per_rad = coulomb_nm / BRISTLE_DEFLECTION_RAD;
        LuGre {
            viscous_nm_s_per_rad: friction.viscous_nm_s_per_rad,
            viscous_asymmetry_nm_s_per_rad: friction.viscous_asymmetry_nm_s_per_rad,
            coulomb_nm,
            breakaway_nm,
            stribeck_rad_per_s: friction.stribeck_rad_per_s,
            offset_nm: friction.offset_nm,
            stribeck_offset_nm: friction.stribeck_offset_nm,
            bristle_stiffness_nm_per_rad,
            bristle_damping_nm_s_per_rad: bristle_stiffness_nm_per_rad * BRISTLE_TIME_S,
            load_fraction: LOAD_FRACTION,
        }
    }

    /// Returns the same friction without the part that depends on load and direction.
    pub fn without_load(self) -> LuGre {
        LuGre {
            load_fraction: 0.0,
            ..self
        }
    }

    /// Returns the torque of steady sliding at `velocity_rad_per_s` under `load` in 0..1 \[N m\], positive against
    /// positive motion. At rest only the offset.
    pub fn steady_torque_nm(&self, velocity_rad_per_s: f64, load: f64) -> f64 {
        let v = velocity_rad_per_s;
        let sign = if v == 0.0 { 0.0 } else { 1.0_f64.copysign(v) };
        self.viscous_nm(v) + self.constant_nm(v) + sign * self.sliding_nm(v, load)
    }

    /// Returns the viscous friction, which may be greater in one direction than in the other.
    fn viscous_nm(&self, v: f64) -> f64 {
        let coefficient = match v < 0.0 {
            true => self.viscous_nm_s_per_rad - self.viscous_asymmetry_nm_s_per_rad,
            false => self.viscous_nm_s_per_rad + self.viscous_asymmetry_nm_s_per_rad,
        };
        coefficient * v
    }

    /// Returns the torque that does not depend on the direction of motion.
    fn constant_nm(&self, v: f64) -> f64 {
        let s = v / self.stribeck_rad_per_s;
        self.offset_nm + self.stribeck_offset_nm * libm::exp(-s * s)
    }

    /// Returns `g(v)`.
    fn sliding_nm(&self, v: f64, load: f64) -> f64 {
        let s = v / self.stribeck_rad_per_s;
        let dip = (self.breakaway_nm - self.coulomb_nm) * libm::exp(-s * s);
        let direction = s.clamp(-1.0, 1.0);
        let share = self.load_fraction * load * (2.0 + direction) / 3.0;
        (self.coulomb_nm + dip) * (1.0 + share)
    }

    /// Advances the bristle `deflection_rad` over `dt_s` at constant velocity and returns the friction torque
    /// at the end \[N m\], positive against positive motion. `load` in 0..1, `dt_s` positive.
    pub fn advance(
        &self,
        deflection_rad: &mut f64,
        velocity_rad_per_s: f64,
        load: f64,
        dt_s: f64,
    ) -> f64 {
        let scale = FrictionScale::ONE;
        self.advance_scaled(deflection_rad, velocity_rad_per_s, load, scale, dt_s)
    }

    /// Does the same as [`LuGre::advance`], with dry and viscous friction multiplied by `scale`; stiffness and damping of the
    /// bristle are unchanged.
    pub fn advance_scaled(
        &self,
        deflection_rad: &mut f64,
        velocity_rad_per_s: f64,
        load: f64,
        scale: FrictionScale,
        dt_s: f64,
    ) -> f64 {
        let v = velocity_rad_per_s;
        let smooth = scale.viscous * self.viscous_nm(v) + self.constant_nm(v);
        if self.bristle_stiffness_nm_per_rad == 0.0 {
            return smooth;
        }
        let z = *deflection_rad;
        let sliding_nm = scale.dry * self.sliding_nm(v, load);
        let rate = self.bristle_stiffness_nm_per_rad * v.abs() / sliding_nm;
        // (1 - exp(-rate dt)) / rate, whose limit at rest is dt.
        let reach = if rate > 0.0 {
            -libm::expm1(-rate * dt_s) / rate
        } else {
            dt_s
        };
        let next = z + (v - rate * z) * reach;
        *deflection_rad = next;
        self.bristle_stiffness_nm_per_rad * next
            + self.bristle_damping_nm_s_per_rad * (next - z) / dt_s
            + smooth
    }

    /// Rejects invalid friction parameters; errors name the `part` (joint or motor) and its index.
    pub(crate) fn validate(&self, part: &str, index: usize) -> Result<(), PlantError> {
        let name = |field: &str| format!("friction of {part} {index}: {field}");
        let check = |field, value: f64, valid: bool, must| {
            entry(valid && value.is_finite(), name(field), value, must)
        };
        let must_not_be_negative = "finite and not negative";
        let (v, s) = (self.viscous_nm_s_per_rad, self.coulomb_nm);
        check("viscous_nm_s_per_rad", v, v >= 0.0, must_not_be_negative)?;
        let a = self.viscous_asymmetry_nm_s_per_rad;
        let must = "finite and at most viscous_nm_s_per_rad in magnitude";
        check("viscous_asymmetry_nm_s_per_rad", a, a.abs() <= v, must)?;
        check("coulomb_nm", s, s >= 0.0, must_not_be_negative)?;
        let s0 = self.breakaway_nm;
        check(
            "breakaway_nm",
            s0,
            s0 >= s,
            "finite and at least coulomb_nm",
        )?;
        let vs = self.stribeck_rad_per_s;
        check("stribeck_rad_per_s", vs, vs > 0.0, "finite and positive")?;
        check("offset_nm", self.offset_nm, true, "finite")?;
        check(
            "stribeck_offset_nm",
            self.stribeck_offset_nm,
            true,
            "finite",
        )?;
        let k = self.bristle_stiffness_nm_per_rad;
        let valid = if s0 > 0.0 { k > 0.0 } else { k == 0.0 };
        let must = "positive with dry friction, 0 without";
        check("bristle_stiffness_nm_per_rad", k, valid, must)?;
        let c = self.bristle_damping_nm_s_per_rad;
        check(
            "bristle_damping_nm_s_per_rad",
            c,
            c >= 0.0,
            must_not_be_negative,
        )?;
        let f = self.load_fraction;
        let must = "from 0 to 0.5";
        check("load_fraction", f, (0.0..=0.5).contains(&f), must)
    }
}
