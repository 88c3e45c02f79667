//! Settings that a TOML leaves out, derived from the arm.
//!
//! [`Description::completed`] adds them to the TOML's text, each with the reason as a comment, so that a log, a copy and
//! another process have the same numbers. What the TOML gives stays. Built-in arms give all of these settings.
//!
//! | setting | from |
//! |---|---|
//! | rotor inertia | limits of torque and speed ([`inertia`]); its comment marks it as an estimate |
//! | roles, home pose, paths | search for a bent pose from which the paths are reached ([`place`]) |
//! | gains, damping, rates | mass matrix over the workspace, torque limits, delay of the loop ([`gains`]) |
//! | thresholds of force | weight of the arm as felt at the tip, torque limits ([`thresholds`]) |

mod derived;
mod gains;
mod inertia;
mod place;
mod thresholds;
mod write;

pub use derived::Derived;

use crate::description::Description;
use crate::error::ModelError;
use crate::reach;
use crate::with_dof;
use place::Placed;
use write::Writer;

/// An arm with everything that a controller needs.
#[derive(Clone, Debug)]
pub struct Completed {
    /// The arm; its TOML gives every setting that was derived.
    pub description: Description,
    /// What was derived, in the order of the TOML; empty if the TOML gave everything.
    pub derived: Vec<Derived>,
}

/// Keys of a joint that are derived if they are missing.
const JOINT_KEYS: [&str; 7] = [
    "armature_kg_m2",
    "torque_rate_nm_per_s",
    "soft_stiffness_nm_per_rad",
    "soft_damping_nm_s_per_rad",
    "move_stiffness_nm_per_rad",
    "move_damping_nm_s_per_rad",
    "hold_damping_nm_s_per_rad",
];

impl Description {
    /// Returns the arm with the settings that its TOML leaves out derived from the arm: rotor inertias (an estimate), gains,
    /// damping, rates, thresholds, home pose and the place of the paper's trajectories. If no `[[joints]]` are given, all but
    /// three joints are held. An arm whose TOML gives gains and home pose is returned as it is, unless it does not reach the
    /// paper's sinusoid: then the paths are placed.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for damping of gravity hold or of held joints that the delay of the loop does not allow in
    /// every pose; [`ModelError`] if no pose allows even small paths; as [`Description::config`].
    pub fn completed(&self) -> Result<Completed, ModelError> {
        with_dof!(self.dof(), N => complete::<N>(self))?
    }

    /// Returns whether the TOML still has settings that [`Description::completed`] derived and marked so.
    pub fn has_derived_settings(&self) -> bool {
        self.toml().contains(write::MARK)
    }

    /// Returns whether gains, inertias and home pose are given for every joint.
    fn is_complete(&self, writer: &Writer) -> bool {
        let given = |name: &String| JOINT_KEYS.iter().all(|key| writer.has_joint(name, key));
        self.settings().home_rad.is_some() && self.joint_names().iter().all(given)
    }

    fn reaches_paths<const N: usize>(&self) -> Result<bool, ModelError> {
        let (trajectory, duration_s) = self.paths().sinusoid(1.0);
        let config = self.config::<N>()?;
        Ok(reach::start_pose(&config, &trajectory, duration_s).is_ok())
    }
}

fn complete<const N: usize>(given: &Description) -> Result<Completed, ModelError> {
    let mut writer = Writer::new(given)?;
    let is_complete = given.is_complete(&writer);
    if is_complete && (given.settings().paths.is_some() || given.reaches_paths::<N>()?) {
        given.check_damping::<N>()?;
        return Ok(Completed {
            description: given.clone(),
            derived: Vec::new(),
        });
    }
    let mut description = given.clone();
    if !is_complete {
        // A TOML that lists joints freezes none on the way to the tip by itself.
        for (joint, position) in given.frozen() {
            let why = "no controller here moves it, or it does not carry the tip";
            writer.set("fixed_joints_rad", joint, *position, why);
        }
        inertia::add(&mut writer, &description.config::<N>()?);
        description = writer.read(&description)?;
    }
    let placed = Placed::<N>::find(&description, !writer.has_given_joints())?;
    placed.add(&mut writer);
    if !is_complete {
        let gains = gains::Gains::of(&description.config::<N>()?);
        placed.hold(&mut writer, &gains);
        gains.add(&mut writer);
        description = writer.read(&description)?;
        let config = description.config::<N>()?;
        thresholds::add_damping(&mut writer, &config, &description.home::<N>()?);
        thresholds::add(&mut writer, &config, &description);
    }
    let description = writer.read(&description)?;
    description.check_damping::<N>()?;
    Ok(Completed {
        description,
        derived: writer.finish(),
    })
}

/// Returns the root mean square, over the sinusoid, of the force at the tip that carries the gravity torques of the active joints
/// \[N\]: the scale of the error that a wrong gravity model makes at a given stiffness. Zero if the sinusoid is out of
/// reach.
///
/// # Errors
/// As [`Description::config`].
pub fn tip_weight_n<const N: usize>(description: &Description) -> Result<f64, ModelError> {
    const POINTS: u32 = 64;
    let config = description.config::<N>()?;
    let (trajectory, duration_s) = description.paths().sinusoid(1.0);
    let Ok(mut q) = reach::start_pose(&config, &trajectory, duration_s) else {
        return Ok(0.0);
    };
    let squares = (1..=POINTS).map(|k| {
        let time_s = duration_s * f64::from(k) / f64::from(POINTS);
        q = reach::solve(&config, &q, &trajectory.at(time_s).position).position_rad;
        place::tip_weight_n(&config, &q).powi(2)
    });
    Ok(supple_core::math::sqrt(
        squares.sum::<f64>() / f64::from(POINTS),
    ))
}
