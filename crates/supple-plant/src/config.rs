//! Configuration of a plant; [`crate::Plant::new`] rejects invalid values.

use crate::actuators::ActuatorModel;
use crate::elasticity::Elasticity;
use crate::error::{PlantError, entry};
use crate::friction::LuGre;
use crate::friction_variation::FrictionVariation;
use crate::hand::Hand;
use crate::scene::Scene;
use supple_core::{Arm, Vector};

/// Joint hard stops: a unilateral spring-damper.
#[derive(Clone, Debug, PartialEq)]
pub struct HardStops<const N: usize> {
    /// Lower stops \[rad\].
    pub lower_rad: Vector<N>,
    /// Upper stops \[rad\], above the lower ones.
    pub upper_rad: Vector<N>,
    /// Stiffness of a stop \[N m/rad\], positive; 1e4 by default.
    pub stiffness_nm_per_rad: f64,
    /// Damping of a stop \[N m s/rad\], zero or more; 30 by default.
    pub damping_nm_s_per_rad: f64,
}

impl<const N: usize> HardStops<N> {
    /// Stops at these angles \[rad\] with the default stiffness and damping.
    pub fn new(lower_rad: Vector<N>, upper_rad: Vector<N>) -> HardStops<N> {
        HardStops {
            lower_rad,
            upper_rad,
            stiffness_nm_per_rad: 1e4,
            damping_nm_s_per_rad: 30.0,
        }
    }

    /// Returns the torque of the stop on joint `i` at `q` \[rad\], `qd` \[rad/s\] \[N m\].
    pub(crate) fn torque_nm(&self, i: usize, q: f64, qd: f64) -> f64 {
        let (below, above) = (self.lower_rad[i] - q, q - self.upper_rad[i]);
        let push = |depth: f64, rate: f64| {
            (self.stiffness_nm_per_rad * depth + self.damping_nm_s_per_rad * rate).max(0.0)
        };
        if below > 0.0 {
            push(below, -qd)
        } else if above > 0.0 {
            -push(above, qd)
        } else {
            0.0
        }
    }
}

/// Force sensor behind the tip. It reports only the contact force: weight and inertia of the cap, the hemisphere
/// around the tip, are part of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSensor {
    /// Cutoff of its second-order Butterworth filter \[Hz\]; 100 by default.
    pub cutoff_hz: f64,
    /// Standard deviation of the noise on each reported component \[N\], zero or more; zero by default.
    pub noise_n: f64,
}

impl Default for ForceSensor {
    fn default() -> Self {
        ForceSensor {
            cutoff_hz: 100.0,
            noise_n: 0.0,
        }
    }
}

/// Torque of hoses and wires along the arm: a spring over each joint angle, `-(k q + preload)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hose<const N: usize> {
    /// `k` of each joint \[N m/rad\], zero or more; without preload the spring is relaxed at the joint's zero.
    pub stiffness_nm_per_rad: Vector<N>,
    /// Torque against positive motion at the joint's zero \[N m\].
    pub preload_nm: Vector<N>,
}

impl<const N: usize> Hose<N> {
    /// No hose.
    pub fn none() -> Hose<N> {
        Hose {
            stiffness_nm_per_rad: Vector::zeros(),
            preload_nm: Vector::zeros(),
        }
    }
}

/// Plant configuration.
#[derive(Clone, Debug)]
pub struct PlantConfig<const N: usize> {
    /// The true arm, tool and rotors included.
    pub arm: Arm<N>,
    /// True friction of each joint.
    pub friction: [LuGre; N],
    /// True friction of each motor, in units of the motor's angle and torque, in addition to that of the joints; its
    /// load fraction has no effect.
    pub motor_friction: [LuGre; N],
    /// Variation of the friction of the joints and, with time, of the motors.
    pub friction_variation: FrictionVariation<N>,
    /// Elasticity between motors and joints; `None` for a rigid transmission.
    pub elasticity: Option<Elasticity<N>>,
    /// Hoses along the arm.
    pub hose: Hose<N>,
    /// Torque limit of each joint \[N m\], by which [`small_joint_fraction`](crate::PlantOptions::small_joint_fraction)
    /// bounds effects; the plant itself limits no torque.
    pub joint_torque_nm: Vector<N>,
    /// Motors, encoders, amplifiers.
    pub actuators: ActuatorModel<N>,
    /// Hard stops, if any.
    pub stops: Option<HardStops<N>>,
    /// Radius of the spherical tip, its centre at the arm's tip frame \[m\], positive; 0.02 by default.
    pub tip_radius_m: f64,
    /// The force sensor.
    pub force_sensor: ForceSensor,
    /// Step of the physics \[s\], positive; 0.2 ms by default, smaller for reference runs.
    ///
    /// Integration errors are of first order in the step. At 0.2 ms, an impact of 1.3 kg on wood at 0.04 m/s, 4 ms
    /// long, differs from the converged result by +0.7 % in the filtered peak, +5 % in the unfiltered peak and
    /// -0.3 % in the impulse; therefore contact needs no smaller steps.
    pub step_s: f64,
    /// Control cycle \[s\], a whole number of steps; 1 ms by default.
    pub cycle_s: f64,
    /// Deviation of a cycle's start from its schedule, as a fraction of the cycle, 0 to 0.4: uniform, seeded, without
    /// drift. The physics of a cycle lasts from its start to the next one's.
    pub cycle_jitter: f64,
    /// Environment of the arm.
    pub scene: Scene,
    /// A hand that guides the tip, if any.
    pub hand: Option<Hand>,
    /// Seed of all noise.
    pub seed: u64,
}

impl<const N: usize> PlantConfig<N> {
    /// Returns the ideal arm: no friction, scene or stops, exact encoders, exact torques without delay.
    pub fn ideal(arm: Arm<N>) -> PlantConfig<N> {
        PlantConfig {
            arm,
            friction: [LuGre::NONE; N],
            motor_friction: [LuGre::NONE; N],
            friction_variation: FrictionVariation::none(),
            elasticity: None,
            hose: Hose::none(),
            joint_torque_nm: Vector::repeat(f64::INFINITY),
            actuators: ActuatorModel::direct(),
            stops: None,
            tip_radius_m: 0.02,
            force_sensor: ForceSensor::default(),
            step_s: 2e-4,
            cycle_s: 1e-3,
            cycle_jitter: 0.0,
            scene: Scene::default(),
            hand: None,
            seed: 0,
        }
    }

    /// Checks the values that no other constructor checks; returns the number of steps per cycle.
    pub(crate) fn validate(&self) -> Result<usize, PlantError> {
        let positive = |name, value: f64| {
            let valid = value > 0.0 && value.is_finite();
            entry(valid, name, value, "finite and positive")
        };
        let not_negative = |name, value: f64| {
            let valid = value >= 0.0 && value.is_finite();
            entry(valid, name, value, "finite and not negative")
        };
        for (joint, friction) in self.friction.iter().enumerate() {
            friction.validate("joint", joint)?;
        }
        for (motor, friction) in self.motor_friction.iter().enumerate() {
            friction.validate("motor", motor)?;
        }
        self.friction_variation.validate()?;
        if let Some(elasticity) = &self.elasticity {
            elasticity.validate()?;
        }
        for stiffness in &self.hose.stiffness_nm_per_rad {
            not_negative("hose.stiffness_nm_per_rad", *stiffness)?;
        }
        for (joint, preload) in self.hose.preload_nm.iter().enumerate() {
            let name = format!("hose.preload_nm of joint {joint}");
            entry(preload.is_finite(), name, *preload, "finite")?;
        }
        let jitter = self.cycle_jitter;
        let valid = (0.0..=0.4).contains(&jitter);
        entry(valid, "cycle_jitter", jitter, "from 0 to 0.4")?;
        if let Some(stops) = &self.stops {
            positive("stops.stiffness_nm_per_rad", stops.stiffness_nm_per_rad)?;
            not_negative("stops.damping_nm_s_per_rad", stops.damping_nm_s_per_rad)?;
            for i in 0..N {
                let (lower, upper) = (stops.lower_rad[i], stops.upper_rad[i]);
                let name = format!("stops.lower_rad of joint {i}");
                entry(lower < upper, name, lower, "below stops.upper_rad")?;
            }
        }
        positive("tip_radius_m", self.tip_radius_m)?;
        not_negative("force_sensor.noise_n", self.force_sensor.noise_n)?;
        positive("step_s", self.step_s)?;
        let steps = libm::rint(self.cycle_s / self.step_s);
        let whole = (self.cycle_s - steps * self.step_s).abs() <= 1e-9 * self.cycle_s;
        let valid = whole && (1.0..=1e6).contains(&steps);
        entry(
            valid,
            "cycle_s",
            self.cycle_s,
            "a whole number of steps of step_s",
        )?;
        self.scene.validate()?;
        if let Some(hand) = &self.hand
            && let Err((name, value, _)) = hand.validate()
        {
            entry(false, name, value, "as a hand of the plant options")?;
        }
        Ok(steps as usize)
    }
}
