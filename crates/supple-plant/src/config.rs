//! What a plant is built from. Plain data: [`crate::Plant::new`] refuses what is not sound.

use crate::drive::Drive;
use crate::error::{PlantError, entry};
use crate::friction::LuGre;
use crate::scene::Scene;
use supple_core::{Arm, Vector};

/// Hard stops of the joints: a spring and a damper that only push back.
#[derive(Clone, Debug, PartialEq)]
pub struct Stops<const N: usize> {
    /// Lower stops \[rad\].
    pub lower_rad: Vector<N>,
    /// Upper stops \[rad\], above the lower ones.
    pub upper_rad: Vector<N>,
    /// Stiffness of a stop \[N m/rad\], positive; 1e4 by default.
    pub stiffness_nm_per_rad: f64,
    /// Damping of a stop \[N m s/rad\], zero or more; 30 by default.
    pub damping_nm_s_per_rad: f64,
}

impl<const N: usize> Stops<N> {
    /// Stops at these angles \[rad\] with the default stiffness and damping.
    pub fn new(lower_rad: Vector<N>, upper_rad: Vector<N>) -> Stops<N> {
        Stops {
            lower_rad,
            upper_rad,
            stiffness_nm_per_rad: 1e4,
            damping_nm_s_per_rad: 30.0,
        }
    }

    /// Torque of the stop on joint `i` at `q` \[rad\], `qd` \[rad/s\], that is \[N m\].
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

/// The force sensor behind the tip. It reports the contact force alone: the weight and the inertia of
/// the cap are part of the arm.
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

/// Everything a plant is told before it starts.
#[derive(Clone, Debug)]
pub struct PlantConfig<const N: usize> {
    /// The true arm, tool and rotors included.
    pub arm: Arm<N>,
    /// True friction of each joint.
    pub friction: [LuGre; N],
    /// Motors, encoders, amplifiers.
    pub drive: Drive<N>,
    /// Hard stops, if any.
    pub stops: Option<Stops<N>>,
    /// Radius of the tip's ball, its centre at the arm's tip frame \[m\], positive; 0.02 by default.
    pub tip_radius_m: f64,
    /// The force sensor.
    pub force_sensor: ForceSensor,
    /// Step of the physics \[s\], positive; 0.2 ms by default, less for reference runs.
    ///
    /// Errors are of first order. At 0.2 ms an impact of 1.3 kg on wood at 0.04 m/s, 4 ms long, has a
    /// filtered peak 0.7 % and an unfiltered one 5 % above, and an impulse 0.3 % below, what it converges
    /// to; so contact is not given shorter steps of its own.
    pub step_s: f64,
    /// Control cycle \[s\], a whole number of steps; 1 ms by default.
    pub cycle_s: f64,
    /// What stands around the arm.
    pub scene: Scene,
    /// Seed of every noise.
    pub seed: u64,
}

impl<const N: usize> PlantConfig<N> {
    /// The arm alone: no friction, no scene, no stops, exact encoders, torques exact and at once.
    pub fn ideal(arm: Arm<N>) -> PlantConfig<N> {
        PlantConfig {
            arm,
            friction: [LuGre::NONE; N],
            drive: Drive::direct(),
            stops: None,
            tip_radius_m: 0.02,
            force_sensor: ForceSensor::default(),
            step_s: 2e-4,
            cycle_s: 1e-3,
            scene: Scene::default(),
            seed: 0,
        }
    }

    /// Steps in a cycle, once all that the other parts do not check themselves is sound.
    pub(crate) fn validate(&self) -> Result<usize, PlantError> {
        let positive = |name, value: f64| {
            let sound = value > 0.0 && value.is_finite();
            entry(sound, name, value, "finite and positive")
        };
        let not_negative = |name, value: f64| {
            let sound = value >= 0.0 && value.is_finite();
            entry(sound, name, value, "finite and not negative")
        };
        for (joint, friction) in self.friction.iter().enumerate() {
            friction.validate(joint)?;
        }
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
        let sound = whole && (1.0..=1e6).contains(&steps);
        entry(sound, "cycle_s", self.cycle_s, "a whole number of step_s")?;
        self.scene.validate()?;
        Ok(steps as usize)
    }
}
