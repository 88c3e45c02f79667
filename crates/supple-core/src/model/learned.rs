//! Changes of the model that are learned while the arm moves: changes of its parameters, and for each joint a map of the torque
//! that the parameters leave unexplained.
//!
//! With `v` the joint's velocity, `p` the direction of its motion ([`Friction::direction`]), `phi_k` splines over its
//! angle and `model` the torque of the model, the torque of joint `i` grows by
//!
//! ```text
//! learned = payload + tilt + offset + sum_k e_k phi_k(q) + V' v + (S' + sum_k o_k phi_k(q)) p(v)  =: change
//! learned += s (model + change)
//! ```
//!
//! `V'` and `S'` are changes of the friction, `s` is the relative error of the torque constant, `e_k` and `o_k` are the
//! map. The part `e` of the map depends on the joint's own angle alone: it is the torque of a potential and adds no
//! energy over a closed motion. The part `o` is dry friction; `S + S' + o` never falls below zero, so that the friction
//! that it compensates is dissipative.
//!
//! All changes are bounded, see [`LearnedBounds`]. The crate `supple-learning` estimates them.

use crate::math::{Vector, Vector3, abs};
use crate::model::friction::Friction;

/// Number of coefficients in each of the two parts of a joint's map.
pub const MAP_KNOTS: usize = 16;
/// Number of intervals of the joint's range; the splines are of second degree.
const INTERVALS: usize = MAP_KNOTS - 2;

/// Changes of the model's parameters; zero is the model itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedParameters<const N: usize> {
    /// Change of the viscous friction `V` \[N m s/rad\].
    pub viscous_nm_s_per_rad: Vector<N>,
    /// Change of the Coulomb friction `S` \[N m\].
    pub coulomb_nm: Vector<N>,
    /// Torque to add at every joint, independent of its motion \[N m\].
    pub offset_nm: Vector<N>,
    /// Fraction of the model's torque to add: the fraction by which a drive falls short of its command.
    pub torque_scale: Vector<N>,
    /// Mass of a payload at the tip \[kg\]; negative if the tool is lighter than its model.
    pub payload_kg: f64,
    /// First moment of the payload in the tip frame \[kg m\].
    pub payload_moment_kg_m: Vector3<f64>,
    /// Rotation vector by which gravity is rotated, base axes \[rad\]. A rotation about gravity itself has no effect.
    pub tilt_rad: Vector3<f64>,
}

impl<const N: usize> LearnedParameters<N> {
    /// The numbers of an arm with `N` joints.
    pub const COUNT: usize = 4 * N + 7;

    /// No change of the model.
    pub fn zero() -> Self {
        LearnedParameters {
            viscous_nm_s_per_rad: Vector::zeros(),
            coulomb_nm: Vector::zeros(),
            offset_nm: Vector::zeros(),
            torque_scale: Vector::zeros(),
            payload_kg: 0.0,
            payload_moment_kg_m: Vector3::zeros(),
            tilt_rad: Vector3::zeros(),
        }
    }

    /// Calls `with` for each number of these parameters and of `other`, with the entry's name and its joint.
    pub fn each(
        &mut self,
        other: &Self,
        mut with: impl FnMut(&'static str, Option<usize>, &mut f64, f64),
    ) {
        for (name, to, from) in [
            (
                "viscous_nm_s_per_rad",
                &mut self.viscous_nm_s_per_rad,
                &other.viscous_nm_s_per_rad,
            ),
            ("coulomb_nm", &mut self.coulomb_nm, &other.coulomb_nm),
            ("offset_nm", &mut self.offset_nm, &other.offset_nm),
            ("torque_scale", &mut self.torque_scale, &other.torque_scale),
        ] {
            for joint in 0..N {
                with(name, Some(joint), &mut to[joint], from[joint]);
            }
        }
        with("payload_kg", None, &mut self.payload_kg, other.payload_kg);
        for (name, to, from) in [
            (
                "payload_moment_kg_m",
                &mut self.payload_moment_kg_m,
                &other.payload_moment_kg_m,
            ),
            ("tilt_rad", &mut self.tilt_rad, &other.tilt_rad),
        ] {
            for axis in 0..3 {
                with(name, None, &mut to[axis], from[axis]);
            }
        }
    }
}

/// Torque of a joint over its angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMap {
    /// Coefficients `e` of the part that depends on the angle alone \[N m\].
    pub torque_nm: [f64; MAP_KNOTS],
    /// Coefficients `o` of the part against the motion \[N m\].
    pub dry_nm: [f64; MAP_KNOTS],
}

impl JointMap {
    /// No torque.
    pub const ZERO: JointMap = JointMap {
        torque_nm: [0.0; MAP_KNOTS],
        dry_nm: [0.0; MAP_KNOTS],
    };

    /// Returns all coefficients, `torque_nm` first.
    pub fn coefficients(&self) -> impl Iterator<Item = &f64> {
        self.torque_nm.iter().chain(&self.dry_nm)
    }

    /// Returns mutable references to the coefficients, in the order of [`JointMap::coefficients`].
    pub fn coefficients_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        self.torque_nm.iter_mut().chain(&mut self.dry_nm)
    }
}

/// The splines that are not zero at an angle: their values, and the number of the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapWeights {
    /// Index of the first coefficient, 0 to `MAP_KNOTS - 3`.
    pub first: usize,
    /// Weights of three coefficients; their sum is 1.
    pub weights: [f64; 3],
}

impl MapWeights {
    /// Evaluates the splines at `q_rad` for a joint with this range; beyond the range, at the end of the range.
    #[inline]
    pub fn new(q_rad: f64, lower_rad: f64, upper_rad: f64) -> MapWeights {
        let x = (q_rad - lower_rad) / (upper_rad - lower_rad) * INTERVALS as f64;
        // A NaN becomes zero.
        let x = x.max(0.0).min(INTERVALS as f64);
        let first = (x as usize).min(INTERVALS - 1);
        let t = x - first as f64;
        let s = 1.0 - t;
        MapWeights {
            first,
            weights: [0.5 * s * s, 0.5 + t * s, 0.5 * t * t],
        }
    }

    /// Returns the value of a part of a map.
    #[inline]
    pub fn of(&self, coefficients: &[f64; MAP_KNOTS]) -> f64 {
        let [a, b, c] = self.weights;
        a * coefficients[self.first]
            + b * coefficients[self.first + 1]
            + c * coefficients[self.first + 2]
    }
}

/// All learned changes of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedTerms<const N: usize> {
    /// Changes of the parameters.
    pub parameters: LearnedParameters<N>,
    /// Map of each joint.
    pub map: [JointMap; N],
}

impl<const N: usize> LearnedTerms<N> {
    /// No change of the model.
    pub fn zero() -> Self {
        LearnedTerms {
            parameters: LearnedParameters::zero(),
            map: [JointMap::ZERO; N],
        }
    }

    /// Calls `with` for each number of these terms and of `other`.
    pub fn each(&mut self, other: &Self, mut with: impl FnMut(&mut f64, f64)) {
        self.parameters
            .each(&other.parameters, |_, _, to, from| with(to, from));
        for (to, from) in self.map.iter_mut().zip(&other.map) {
            for (to, from) in to.coefficients_mut().zip(from.coefficients()) {
                with(to, *from);
            }
        }
    }
}

/// Relative change of a friction parameter.
const FRICTION_SHARE: f64 = 0.5;
/// Offset, and coefficient of the map, as a fraction of the joint's torque limit.
const OFFSET_SHARE: f64 = 0.02;
/// Sum of all learned torques, as a fraction of the joint's torque limit.
const TORQUE_SHARE: f64 = 0.05;
/// Relative error of a torque constant: geared motors of one type give 0.67 to 0.77 of their command, and the share differs between motors.
const TORQUE_SCALE: f64 = 0.1;
/// Mass of the payload \[kg\].
const PAYLOAD_KG: f64 = 0.25;
/// Distance of the payload's centre from the tip \[m\].
const PAYLOAD_M: f64 = 0.1;
/// Tilt about each axis \[rad\].
const TILT_RAD: f64 = 0.05;

/// Bounds of the magnitude of all learned changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedBounds<const N: usize> {
    /// Bound of each parameter.
    pub parameters: LearnedParameters<N>,
    /// Bound of each coefficient of a joint's map \[N m\].
    pub map_nm: Vector<N>,
    /// Bound of the total learned torque of a joint \[N m\].
    pub torque_nm: Vector<N>,
}

/// A number that is not within the bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutOfBounds {
    /// Name of the entry.
    pub entry: &'static str,
    /// Value found.
    pub value: f64,
    /// Bound of the magnitude.
    pub bound: f64,
}

impl<const N: usize> LearnedBounds<N> {
    /// Returns the bounds for joints with this friction and these torque limits \[N m\]: half of each friction parameter, 2 % of
    /// the torque limit as offset and in the map, 10 % of the torque constant, 0.25 kg at up to 0.1 m from the tip, 0.05 rad of
    /// tilt; in sum 5 % of the torque limit.
    pub fn new(friction: &[Friction; N], joint_torque_nm: &Vector<N>) -> Self {
        LearnedBounds {
            parameters: LearnedParameters {
                viscous_nm_s_per_rad: Vector::from_fn(|i, _| {
                    FRICTION_SHARE * friction[i].viscous_nm_s_per_rad
                }),
                coulomb_nm: Vector::from_fn(|i, _| FRICTION_SHARE * friction[i].coulomb_nm),
                offset_nm: joint_torque_nm * OFFSET_SHARE,
                torque_scale: Vector::repeat(TORQUE_SCALE),
                payload_kg: PAYLOAD_KG,
                payload_moment_kg_m: Vector3::repeat(PAYLOAD_KG * PAYLOAD_M),
                tilt_rad: Vector3::repeat(TILT_RAD),
            },
            map_nm: joint_torque_nm * OFFSET_SHARE,
            torque_nm: joint_torque_nm * TORQUE_SHARE,
        }
    }

    /// Rejects parameters that are beyond the bounds or not finite.
    ///
    /// # Errors
    /// The first such entry.
    pub fn check(&self, parameters: &LearnedParameters<N>) -> Result<(), OutOfBounds> {
        let mut wrong = None;
        let mut bounds = self.parameters;
        bounds.each(parameters, |entry, _, bound, value| {
            if wrong.is_none() && !is_within(value, *bound) {
                let bound = *bound;
                wrong = Some(OutOfBounds {
                    entry,
                    value,
                    bound,
                });
            }
        });
        wrong.map_or(Ok(()), Err)
    }

    /// Rejects a map of joint `joint`, less than `N`, with a coefficient beyond the bound.
    ///
    /// # Errors
    /// The first such coefficient.
    pub fn check_map(&self, joint: usize, map: &JointMap) -> Result<(), OutOfBounds> {
        let bound = self.map_nm[joint];
        match map.coefficients().find(|value| !is_within(**value, bound)) {
            None => Ok(()),
            Some(value) => Err(OutOfBounds {
                entry: "learned map [N m]",
                value: *value,
                bound,
            }),
        }
    }
}

fn is_within(value: f64, bound: f64) -> bool {
    abs(value) <= bound
}
