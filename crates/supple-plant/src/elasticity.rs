//! Elastic cables or gears between motors and joints; the encoders are on the motors.
//!
//! ```text
//! M(q) q'' + h(q, q') = s - friction + contact        A w' = tau - motor friction - s
//! s = K slack(theta - q) + D (w - q')                  theta' = w
//! ```
//!
//! `theta = m2jp p` are the motor angles `p` seen at the joints. These equations also hold for motors that share joints, as in a
//! differential: the rotors' inertia seen at the joints, the diagonal `A`, equals the matrix
//! `m2jp^T A m2jp` at the motors. `slack` is the identity, or subtracts the backlash. `A` acts on the motors instead of
//! the joints, so `M` is the mass matrix of the links alone. Spong 1987, "Modeling and control of elastic joint robots".
//!
//! The engine integrates by semi-implicit Euler. For a spring of angular frequency `w` that is the symplectic Euler
//! method, whose energy error stays bounded for `w dt < 2`. A spring with `(w dt)^2 > 0.25` (a stiff cable on a light
//! link) is integrated by the implicit Euler method instead, which is stable for any step and damps the spring's
//! own vibration. Damping is always implicit. In both cases motor and joint receive exactly opposite torques, so
//! momentum is conserved. First-order accurate, as the engine.

use crate::error::{PlantError, entry};
use supple_core::Vector;

/// `(w dt)^2` above which a spring is integrated implicitly.
const IMPLICIT_FROM: f64 = 0.25;

/// Elasticity of the transmission.
#[derive(Clone, Debug, PartialEq)]
pub struct Elasticity<const N: usize> {
    /// `K`, stiffness seen at each joint with the motors held \[N m/rad\], positive. A joint without rotor inertia stays
    /// rigid.
    pub stiffness_nm_per_rad: Vector<N>,
    /// Damping ratio of each rotor on its spring, zero or more: `D = 2 ratio sqrt(K A)`.
    pub damping_ratio: f64,
    /// Play of each joint with the motors held \[rad\], zero or more.
    pub backlash_rad: f64,
}

impl<const N: usize> Elasticity<N> {
    pub(crate) fn validate(&self) -> Result<(), PlantError> {
        for (joint, stiffness) in self.stiffness_nm_per_rad.iter().enumerate() {
            let valid = *stiffness > 0.0 && stiffness.is_finite();
            let name = format!("elasticity.stiffness_nm_per_rad of joint {joint}");
            entry(valid, name, *stiffness, "finite and positive")?;
        }
        for (field, value) in [
            ("elasticity.damping_ratio", self.damping_ratio),
            ("elasticity.backlash_rad", self.backlash_rad),
        ] {
            let valid = value >= 0.0 && value.is_finite();
            entry(valid, field, value, "finite and not negative")?;
        }
        Ok(())
    }
}

/// Torques of the transmission on the joints over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LinkTorque<const N: usize> {
    /// Part known at the start of the step \[N m\].
    pub torque_nm: Vector<N>,
    /// Factor of the joint velocity at the end of the step, which it opposes \[N m s/rad\].
    pub damping_nm_s_per_rad: Vector<N>,
}

/// One elastic joint.
#[derive(Clone, Copy, Debug)]
struct Spring {
    stiffness_nm_per_rad: f64,
    damping_nm_s_per_rad: f64,
    half_backlash_rad: f64,
    rotor_kg_m2: f64,
    implicit: bool,
    /// Rotor velocity at the end of the step for a joint at rest \[rad/s\], and its derivative with respect to the joint's
    /// velocity at that time.
    rotor_next: (f64, f64),
}

/// Rotors behind elastic transmissions, seen at the joints.
#[derive(Clone, Debug)]
pub(crate) struct Rotors<const N: usize> {
    joints: [Option<Spring>; N],
    position_rad: Vector<N>,
    velocity_rad_per_s: Vector<N>,
}

impl<const N: usize> Rotors<N> {
    /// Rotors of `rotor_kg_m2` at the joints; `link_inverse_inertia` is the diagonal of the inverse mass matrix of the
    /// links alone \[1/(kg m^2)\].
    pub fn new(
        elasticity: &Elasticity<N>,
        rotor_kg_m2: &Vector<N>,
        link_inverse_inertia: &Vector<N>,
        step_s: f64,
    ) -> Rotors<N> {
        let joints = core::array::from_fn(|i| {
            let (k, inertia) = (elasticity.stiffness_nm_per_rad[i], rotor_kg_m2[i]);
            let square = step_s * step_s * k * (1.0 / inertia + link_inverse_inertia[i]);
            (inertia > 0.0).then_some(Spring {
                stiffness_nm_per_rad: k,
                damping_nm_s_per_rad: 2.0 * elasticity.damping_ratio * libm::sqrt(k * inertia),
                half_backlash_rad: 0.5 * elasticity.backlash_rad,
                rotor_kg_m2: inertia,
                implicit: square > IMPLICIT_FROM,
                rotor_next: (0.0, 0.0),
            })
        });
        Rotors {
            joints,
            position_rad: Vector::zeros(),
            velocity_rad_per_s: Vector::zeros(),
        }
    }

    /// Sets the rotors such that their springs exert `torque_nm` on joints at `q`, and that they move with the joints.
    pub fn set_state(&mut self, q: &Vector<N>, qd: &Vector<N>, torque_nm: &Vector<N>) {
        self.velocity_rad_per_s = *qd;
        self.position_rad = Vector::from_fn(|i, _| match &self.joints[i] {
            None => q[i],
            Some(spring) => {
                let play = if torque_nm[i] == 0.0 {
                    0.0
                } else {
                    spring.half_backlash_rad.copysign(torque_nm[i])
                };
                q[i] + torque_nm[i] / spring.stiffness_nm_per_rad + play
            }
        });
    }

    /// Returns the motor angles and velocities, seen at the joints.
    pub fn state(&self) -> (Vector<N>, Vector<N>) {
        (self.position_rad, self.velocity_rad_per_s)
    }

    /// Returns the torques on the joints over a step from `q`, `qd`, in which `motor_nm` acts on the rotors.
    pub fn torque(
        &mut self,
        (q, qd): (&Vector<N>, &Vector<N>),
        motor_nm: &Vector<N>,
        dt_s: f64,
    ) -> LinkTorque<N> {
        let mut on_links = LinkTorque {
            torque_nm: *motor_nm,
            damping_nm_s_per_rad: Vector::zeros(),
        };
        for i in 0..N {
            let Some(spring) = &mut self.joints[i] else {
                self.velocity_rad_per_s[i] = qd[i];
                continue;
            };
            let stretch = self.position_rad[i] - q[i];
            let engaged = stretch.abs() > spring.half_backlash_rad;
            let (elastic, damping) = if engaged {
                let beyond = stretch - spring.half_backlash_rad.copysign(stretch);
                let implicit = if spring.implicit { dt_s } else { 0.0 };
                (
                    spring.stiffness_nm_per_rad * beyond,
                    spring.damping_nm_s_per_rad + spring.stiffness_nm_per_rad * implicit,
                )
            } else {
                (0.0, 0.0)
            };
            let inertia = spring.rotor_kg_m2;
            let with_damping = inertia + dt_s * damping;
            let momentum = inertia * self.velocity_rad_per_s[i] + dt_s * (motor_nm[i] - elastic);
            spring.rotor_next = (momentum / with_damping, dt_s * damping / with_damping);
            on_links.torque_nm[i] = elastic + damping * spring.rotor_next.0;
            on_links.damping_nm_s_per_rad[i] = damping * inertia / with_damping;
        }
        on_links
    }

    /// Completes the step with the joint angles `q` and velocities `qd` at its end.
    pub fn advance(&mut self, (q, qd): (&Vector<N>, &Vector<N>), dt_s: f64) {
        for i in 0..N {
            let Some(spring) = &self.joints[i] else {
                self.position_rad[i] = q[i];
                self.velocity_rad_per_s[i] = qd[i];
                continue;
            };
            let velocity = spring.rotor_next.0 + spring.rotor_next.1 * qd[i];
            self.velocity_rad_per_s[i] = velocity;
            self.position_rad[i] += dt_s * velocity;
        }
    }

    /// Returns the potential energy of the springs with joints at `q`, and kinetic energy of the rotors \[J\].
    pub fn energy_j(&self, q: &Vector<N>) -> (f64, f64) {
        let (mut potential, mut kinetic) = (0.0, 0.0);
        for (i, spring) in self.joints.iter().enumerate() {
            let Some(spring) = spring else { continue };
            let stretch = (self.position_rad[i] - q[i]).abs() - spring.half_backlash_rad;
            let stretch = stretch.max(0.0);
            potential += 0.5 * spring.stiffness_nm_per_rad * stretch * stretch;
            let speed = self.velocity_rad_per_s[i];
            kinetic += 0.5 * spring.rotor_kg_m2 * speed * speed;
        }
        (potential, kinetic)
    }

    /// Returns whether the joint has a spring.
    pub fn is_elastic(&self, joint: usize) -> bool {
        self.joints[joint].is_some()
    }
}
