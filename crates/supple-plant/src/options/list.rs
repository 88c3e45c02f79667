//! The options, each declared once: name, unit, range, what it is, where its usual size is from.

use crate::hand::Hand;
use serde::{Deserialize, Serialize};

/// An option, for lists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantOption {
    /// Key in the file.
    pub name: &'static str,
    /// Unit; "1" for a pure number.
    pub unit: &'static str,
    /// Minimum.
    pub min: f64,
    /// Maximum.
    pub max: f64,
    /// Whether only whole numbers are valid.
    pub whole: bool,
    /// What the plant does.
    pub effect: &'static str,
    /// Source of the effect and of its size.
    pub source: &'static str,
}

impl PlantOption {
    /// Returns the valid values in words, as in "from 0 to 0.5 rad".
    pub fn range(&self) -> String {
        let number = if self.whole { "a whole number " } else { "" };
        let unit = match self.unit {
            "1" => String::new(),
            unit => format!(" {unit}"),
        };
        format!("{number}from {} to {}{unit}", self.min, self.max)
    }
}

macro_rules! plant_options {
    ($($name:ident: $unit:literal, $min:literal..=$max:literal $($whole:ident)?,
        $effect:literal, $source:literal;)*) => {
        /// Options of a simulated arm beyond its description; an option that is not set leaves its effect out.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct PlantOptions {
            /// Seed of the signs, directions and phases. Default: the seed of the run, 0 for a process.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub seed: Option<u32>,
            $(
                #[doc = concat!($effect, " Unit: ", $unit, ". Source: ", $source)]
                #[serde(skip_serializing_if = "Option::is_none")]
                #[schemars(range(min = $min, max = $max))]
                pub $name: Option<f64>,
            )*
            /// A hand that guides the tip.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub hand: Option<Hand>,
        }

        /// All options that are numbers, except the seed, in the order of the file.
        pub const OPTIONS: &[PlantOption] = &[$(PlantOption {
            name: stringify!($name),
            unit: $unit,
            min: $min,
            max: $max,
            whole: plant_options!(@whole $($whole)?),
            effect: $effect,
            source: $source,
        }),*];

        impl PlantOptions {
            /// Returns all options with their values, in the order of [`OPTIONS`].
            pub fn values(&self) -> impl Iterator<Item = (&'static PlantOption, Option<f64>)> {
                OPTIONS.iter().zip([$(self.$name),*])
            }

            /// Returns the option of this name, to change it.
            pub fn value_mut(&mut self, name: &str) -> Option<&mut Option<f64>> {
                match name {
                    $(stringify!($name) => Some(&mut self.$name),)*
                    _ => None,
                }
            }
        }
    };
    (@whole whole) => { true };
    (@whole) => { false };
}

plant_options! {
    cable_stiffness_nm_per_rad: "N m/rad", 10.0..=1e7,
        "Stiffness of the cables or gears of each joint with the motors held; encoders and rotors are on the motor side.",
        "Spong 1987 for the model; size assumed (Barrett publishes none; cable-driven arms: 1000 to 10000).";
    cable_damping_ratio: "1", 0.0..=1.0,
        "Damping ratio of each rotor on its cable.",
        "assumption: a few per cent, as of steel structures.";
    backlash_rad: "rad", 0.0..=0.1,
        "Play of each joint with the motors held.",
        "assumption; cables have none, gears 0.1 to 1 mrad.";
    ripple_nm: "N m", 0.0..=100.0,
        "Cogging of each motor, seen at its joint: harmonics 2 and 6 of the motor angle, two and three fifths of the size.",
        "assumption; harmonics as of the pole pairs of a brushless motor.";
    torque_ripple_fraction: "1", 0.0..=0.3,
        "Torque ripple of each motor as a fraction of its torque: harmonic 6 of the motor angle.",
        "assumption; 1 to 5 % for sinusoidal commutation.";
    dry_friction_change: "1", -0.9..=5.0,
        "Change of the dry friction of all joints from the description, as a fraction.",
        "assumption: drift between identification and use.";
    warm_up_dry_fraction: "1", -0.5..=5.0,
        "Excess of the dry friction of a cold arm, as a fraction.",
        "assumption; Bittencourt and Axelsson 2014 measured tens of per cent on a geared arm.";
    warm_up_viscous_fraction: "1", -0.5..=5.0,
        "Excess of the viscous friction of a cold arm, as a fraction.",
        "assumption; Bittencourt and Axelsson 2014 measured more than for dry friction.";
    warm_up_s: "s", 1.0..=1e6,
        "Time constant of the warm-up; 600 s if not set.",
        "assumption: minutes.";
    warmed_s: "s", 0.0..=1e9,
        "Time for which the arm has already warmed up at the start; 0 if not set: cold.",
        "choice of the experiment.";
    friction_load_fraction: "1", 0.0..=0.5,
        "Fraction of the friction that grows with the gravity load of the joint, more against it than with it; if not set, \
         0.02 of the dry friction alone.",
        "Hamon, Gautier and Garrec 2010 for the model of dry friction; size, and the same for viscous friction, assumed.";
    gear_friction_fraction: "1", 0.0..=0.5,
        "Dry friction that each gear adds under load, as a share of the torque that its motor transmits.",
        "one user's bench of geared motors: breakaway rises by about a tenth of the load.";
    friction_direction_fraction: "1", 0.0..=0.5,
        "Difference of the friction between the directions of motion, as a fraction; sign by joint.",
        "assumption.";
    friction_angle_fraction: "1", 0.0..=0.5,
        "Variation of the friction over the joint angle, as a fraction: four periods per revolution, phase by joint.",
        "assumption: eccentric drums and pulleys.";
    motor_friction_share: "1", 0.0..=1.0,
        "Share of dry and viscous friction that acts at the motors instead of at the joints; motion of one joint alone \
         has the same friction. Joints that share motors, as in a differential, are then coupled.",
        "assumption: bearings and cables of the first stage turn with the motors.";
    bristle_stiffness_factor: "1", 0.02..=50.0,
        "Factor of the bristle stiffness of dry friction.",
        "assumption: presliding is rarely identified.";
    dead_zone_nm: "N m at the motor", 0.0..=1.0,
        "Dead zone of each amplifier.",
        "assumption; current loops have offsets and friction of their own below 1 % of the range.";
    amplifier_offset_nm: "N m at the motor", 0.0..=1.0,
        "Torque of each motor without command; sign by motor.",
        "assumption.";
    torque_constant_fraction: "1", 0.0..=0.5,
        "Error of the torque constant of each motor, as a fraction; sign by motor.",
        "assumption; data sheets give 5 to 10 % between motors, Barrett calibrates each.";
    torque_shortfall_fraction: "1", 0.0..=0.6,
        "Share by which the torque of every motor falls short of the commanded one, in the mean over the motors.",
        "users of geared motors find the commanded torque divided by 1.3 to 1.5: 0.28 with a spread of 0.05.";
    torque_shortfall_spread: "1", 0.0..=0.3,
        "Largest deviation of a motor's shortfall from the mean, uniform by motor.",
        "users of geared motors: the commanded torque divided by 1.3 to 1.5.";
    base_tilt_rad: "rad", 0.0..=0.5,
        "Angle between the base axis and the vertical; direction by seed.",
        "assumption; 0.2 degrees are 3.5 mrad.";
    encoder_bias_rad: "rad", 0.0..=0.1,
        "Error of the zero of each joint; sign by joint.",
        "assumption; the WAM's zero is a pose set by hand.";
    encoder_noise_rad: "rad at the motor", 0.0..=0.1,
        "Standard deviation of the noise of each motor angle before rounding.",
        "a third of a count of 4096 is 0.5 mrad; assumption.";
    hose_stiffness_nm_per_rad: "N m/rad", 0.0..=100.0,
        "Hoses and wires along the arm: a spring over each joint angle, relaxed at the joint's zero.",
        "assumption.";
    hose_preload_nm: "N m", 0.0..=100.0,
        "Preload of that spring; sign by joint.",
        "assumption.";
    small_joint_fraction: "1", 0.0..=1.0,
        "Bound of ripple_nm, hose_preload_nm and the hose's torque per radian at each joint, as a fraction of the joint's torque limit: small joints have small motors and thin wires.",
        "assumption; cogging of brushless motors is some per cent of their rated torque or less.";
    tool_extra_kg: "kg", 0.0..=100.0,
        "Mass at the tip that the description lacks.",
        "assumption: a tool that was weighed badly, or its cable.";
    extra_delay_cycles: "cycles", 0.0..=50.0 whole,
        "Further cycles after which a commanded torque acts.",
        "assumption: a driver or filter between controller and amplifier.";
    cycle_jitter_fraction: "of a cycle", 0.0..=0.4,
        "Deviation of the start of a cycle from its schedule, uniform. No effect on the emulated bus, which has its own.",
        "assumption; a Linux host without realtime kernel.";
}
