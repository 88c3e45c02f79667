//! The plant: one control cycle of physics at a time.

use crate::config::PlantConfig;
use crate::drive::DriveState;
use crate::error::{PlantError, entry};
use crate::filter::Butterworth;
use crate::noise::Noise;
use crate::record::{Measurement, StepRecord, Truth};
use crate::world::{Object, TipForce, TipMotion, World};
use core::array;
use supple_core::dynamics::{gravity, joint_poses, kinetic_energy};
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, ArmError, Body, Pose, Vector};

/// Penetration at which a tip may be put \[m\]; a tip at rest is in by hundredths of a millimetre.
const GREATEST_START_DEPTH_M: f64 = 1e-3;

/// The simulated arm in its scene.
pub struct Plant<const N: usize> {
    config: PlantConfig<N>,
    world: World<N>,
    drive: DriveState<N>,
    filter: Butterworth,
    encoder_noise: Noise,
    force_noise: Noise,
    bristles_rad: [f64; N],
    load_bound_nm: Vector<N>,
    steps: Vec<StepRecord>,
    steps_per_cycle: usize,
    measurement: Measurement<N>,
    truth: Truth<N>,
    poses: [Pose; N],
    greatest_force_n: Vector3<f64>,
}

impl<const N: usize> Plant<N> {
    /// Builds the plant with the arm at `q0` \[rad\], `qd0` \[rad/s\]. Until the first delayed command
    /// acts, the motors hold the arm against gravity at `q0`.
    ///
    /// # Errors
    /// [`PlantError`] names the entry that is not sound, its value and what it must be, or the object
    /// that the tip starts more than a millimetre inside.
    pub fn new(
        config: PlantConfig<N>,
        q0: Vector<N>,
        qd0: Vector<N>,
    ) -> Result<Plant<N>, PlantError> {
        let steps_per_cycle = config.validate()?;
        finite("q0", &q0)?;
        finite("qd0", &qd0)?;
        let held = gravity(&config.arm, &q0);
        let world = World::new(&config, &q0, &qd0)?;
        let drive = DriveState::new(config.drive.clone(), &held)?;
        let filter = Butterworth::new(config.force_sensor.cutoff_hz, config.step_s)?;
        let mut plant = Plant {
            world,
            drive,
            filter,
            encoder_noise: Noise::new(config.seed, 1),
            force_noise: Noise::new(config.seed, 2),
            bristles_rad: [0.0; N],
            load_bound_nm: load_bound(&config.arm),
            steps: Vec::with_capacity(steps_per_cycle),
            steps_per_cycle,
            measurement: Measurement {
                cycle: 0,
                time_s: 0.0,
                position_rad: q0,
                force_n: Vector3::zeros(),
            },
            truth: Truth {
                time_s: 0.0,
                position_rad: q0,
                velocity_rad_per_s: qd0,
                tip_position_m: Vector3::zeros(),
                tip_velocity_m_per_s: Vector3::zeros(),
                contact_force_n: Vector3::zeros(),
                friction_torque_nm: Vector::zeros(),
                motor_torque_nm: held,
            },
            poses: [Pose::IDENTITY; N],
            greatest_force_n: Vector3::zeros(),
            config,
        };
        plant.read_state();
        plant.refuse_buried()?;
        plant.measure(Vector3::zeros());
        Ok(plant)
    }

    /// Advances one control cycle. `torque_nm` is the joint torque commanded in it, positive along
    /// positive motion; it acts after the drive's delay. A command that is not finite is not taken
    /// over.
    pub fn cycle(&mut self, torque_nm: &Vector<N>) -> Measurement<N> {
        let applied = self.drive.command(torque_nm);
        let start_s = self.measurement.cycle as f64 * self.config.cycle_s;
        self.steps.clear();
        let mut filtered = Vector3::zeros();
        for step in 1..=self.steps_per_cycle {
            let touch = self.step(&applied);
            filtered = self.filter.step(&touch.force_n);
            self.truth.time_s = start_s + step as f64 * self.config.step_s;
            self.steps.push(StepRecord {
                time_s: self.truth.time_s,
                force_n: touch.force_n,
                filtered_force_n: filtered,
                depth_m: touch.depth_m,
            });
        }
        self.measurement.cycle += 1;
        self.truth.time_s = self.measurement.cycle as f64 * self.config.cycle_s;
        self.measure(filtered);
        self.measurement
    }

    /// Shorts these motors from now on and no others: they brake, beside whatever torque is commanded. None is
    /// at the start.
    pub fn short(&mut self, motors: [bool; N]) {
        self.drive.short(motors);
    }

    /// Adds to the joint velocities \[rad/s\]: a blow that is over at once.
    ///
    /// # Errors
    /// An entry that is not finite.
    pub fn push(&mut self, change: &Vector<N>) -> Result<(), PlantError> {
        finite("velocity change", change)?;
        self.world.push(change);
        self.read_state();
        Ok(())
    }

    /// Gravity turns round, as if the arm were mounted upside down.
    pub fn reverse_gravity(&mut self) {
        let arm = &self.config.arm;
        // The arm was sound, and is so with the opposite of a finite vector.
        if let Ok(arm) = with_load(arm, arm.body(N - 1), -arm.gravity()) {
            self.load_bound_nm = load_bound(&arm);
            self.world.replace_load(&arm);
            self.config.arm = arm;
        }
    }

    /// Fixes a ball of this mass \[kg\] to the tip, as large as the tip's own; it touches nothing. It is part of
    /// the arm from now on, and of [`Plant::config`].
    ///
    /// # Errors
    /// A mass that is not finite and positive.
    pub fn add_payload(&mut self, mass_kg: f64) -> Result<(), PlantError> {
        let sound = mass_kg > 0.0 && mass_kg.is_finite();
        entry(sound, "payload mass_kg", mass_kg, "finite and positive")?;
        let arm = &self.config.arm;
        let at_m = arm.joint_from_tip().translation;
        let payload = Body::ball(mass_kg, self.config.tip_radius_m, at_m);
        let loaded = with_load(arm, arm.body(N - 1).merged(&payload), arm.gravity());
        let must = "such that the last link stays a physical body";
        let arm = loaded.or(Err(PlantError::Entry {
            entry: "payload mass_kg".to_owned(),
            value: mass_kg,
            must,
        }))?;
        self.load_bound_nm = load_bound(&arm);
        self.world.replace_load(&arm);
        self.config.arm = arm;
        Ok(())
    }

    /// Kinetic energy of the arm with its rotors and payload \[J\].
    pub fn kinetic_energy_j(&self) -> f64 {
        let truth = &self.truth;
        kinetic_energy(
            &self.config.arm,
            &truth.position_rad,
            &truth.velocity_rad_per_s,
        )
    }

    /// The greatest contact force on the tip since this was last asked, over all steps, base axes \[N\].
    pub fn take_greatest_force_n(&mut self) -> Vector3<f64> {
        core::mem::take(&mut self.greatest_force_n)
    }

    /// The measurement at the end of the last cycle, or at the start.
    pub fn measurement(&self) -> &Measurement<N> {
        &self.measurement
    }

    /// What is really so at the end of the last cycle, or at the start.
    pub fn truth(&self) -> &Truth<N> {
        &self.truth
    }

    /// Every step of the last cycle.
    pub fn steps(&self) -> &[StepRecord] {
        &self.steps
    }

    /// What it was built from, with the load that was added.
    pub fn config(&self) -> &PlantConfig<N> {
        &self.config
    }

    /// Frames of the joints as they stand now, `base_from_joint`.
    pub fn joint_poses(&self) -> &[Pose; N] {
        &self.poses
    }

    /// Everything around the arm as it stands now.
    pub fn objects(&self) -> impl Iterator<Item = Object> {
        self.world.objects()
    }

    /// Load of each joint, 0 to 1: the moment that gravity puts on it, drive and bearing together,
    /// over the moment of the arm stretched out level.
    pub fn load(&self) -> Vector<N> {
        let mut load = Vector::zeros();
        let (mut mass, mut moment) = (0.0, Vector3::zeros());
        for j in (0..N).rev() {
            let body = self.config.arm.body(j);
            mass += body.mass_kg;
            moment += self.poses[j].transform_point(&body.com_m) * body.mass_kg;
            let carried = moment - self.poses[j].translation * mass;
            let carried = carried.cross(&self.config.arm.gravity());
            if self.load_bound_nm[j] > 0.0 {
                load[j] = libm::sqrt(carried.dot(&carried)) / self.load_bound_nm[j];
            }
        }
        load
    }

    /// Puts the arm at `q` \[rad\], `qd` \[rad/s\], bristles relaxed, filter empty, motors holding it
    /// against gravity. Time and scene go on.
    ///
    /// # Errors
    /// An entry that is not finite, or a tip more than a millimetre inside something; the arm is there
    /// all the same.
    pub fn set_state(&mut self, q: Vector<N>, qd: Vector<N>) -> Result<(), PlantError> {
        finite("q", &q)?;
        finite("qd", &qd)?;
        self.world.set_state(&q, &qd);
        self.drive.restart(&gravity(&self.config.arm, &q));
        self.filter.reset();
        self.bristles_rad = [0.0; N];
        self.steps.clear();
        self.truth.contact_force_n = Vector3::zeros();
        self.truth.friction_torque_nm = Vector::zeros();
        self.read_state();
        self.measure(Vector3::zeros());
        self.refuse_buried()
    }

    /// A tip that starts deep in something would be shot out of it.
    fn refuse_buried(&self) -> Result<(), PlantError> {
        match self.world.deepest(&self.tip_motion()) {
            Some((object, depth_m)) if depth_m > GREATEST_START_DEPTH_M => {
                Err(PlantError::Buried { object, depth_m })
            }
            _ => Ok(()),
        }
    }

    /// One step of the physics under the joint torque `applied`, ripple apart.
    fn step(&mut self, applied: &Vector<N>) -> TipForce {
        let dt_s = self.config.step_s;
        let (q, qd) = (self.truth.position_rad, self.truth.velocity_rad_per_s);
        let motor = applied + self.drive.ripple(&q) + self.drive.braking(&qd);
        let friction = self.friction(&qd, dt_s);
        let mut torque = motor - friction;
        if let Some(stops) = &self.config.stops {
            for i in 0..N {
                torque[i] += stops.torque_nm(i, q[i], qd[i]);
            }
        }
        let tip = self.tip_motion();
        let touch = self.world.touch(&tip, dt_s);
        let about_axis: [Vector3<f64>; N] =
            array::from_fn(|i| self.poses[i].rotation.column(2) * torque[i]);
        let link_torque = array::from_fn(|i| match about_axis.get(i + 1) {
            Some(reaction) => about_axis[i] - reaction,
            None => about_axis[i],
        });
        self.world.step(&link_torque, &touch, &tip.center_m, dt_s);
        if touch.force_n.norm_squared() > self.greatest_force_n.norm_squared() {
            self.greatest_force_n = touch.force_n;
        }
        self.truth.contact_force_n = touch.force_n;
        self.truth.friction_torque_nm = friction;
        self.truth.motor_torque_nm = motor;
        self.read_state();
        touch
    }

    fn friction(&mut self, qd: &Vector<N>, dt_s: f64) -> Vector<N> {
        let loaded = self.config.friction.iter().any(|f| f.load_fraction > 0.0);
        let load = if loaded { self.load() } else { Vector::zeros() };
        Vector::from_fn(|i, _| {
            let bristle = &mut self.bristles_rad[i];
            self.config.friction[i].advance(bristle, qd[i], load[i], dt_s)
        })
    }

    fn tip_motion(&self) -> TipMotion {
        let qd = &self.truth.velocity_rad_per_s;
        let center_m = self.truth.tip_position_m;
        let angular = |i: usize| self.poses[i].rotation.column(2) * qd[i];
        TipMotion {
            center_m,
            linear_m_per_s: self.truth.tip_velocity_m_per_s,
            angular_rad_per_s: (0..N).map(angular).sum(),
        }
    }

    fn read_state(&mut self) {
        let (q, qd) = self.world.state();
        self.poses = joint_poses(&self.config.arm, &q);
        let tip = self.poses[N - 1] * self.config.arm.joint_from_tip();
        self.truth.position_rad = q;
        self.truth.velocity_rad_per_s = qd;
        self.truth.tip_position_m = tip.translation;
        // J qd: the engine's own link velocities are one step old.
        let moved = |pose: &Pose, rate: f64| {
            let axis: Vector3<f64> = pose.rotation.column(2).into();
            axis.cross(&(tip.translation - pose.translation)) * rate
        };
        let rates = self.poses.iter().zip(qd.iter());
        self.truth.tip_velocity_m_per_s = rates.map(|(pose, rate)| moved(pose, *rate)).sum();
    }

    fn measure(&mut self, filtered_n: Vector3<f64>) {
        let (q, noise_n) = (self.truth.position_rad, self.config.force_sensor.noise_n);
        let mut noise = || {
            if noise_n > 0.0 {
                noise_n * self.force_noise.normal()
            } else {
                0.0
            }
        };
        let noise = Vector3::new(noise(), noise(), noise());
        self.measurement = Measurement {
            cycle: self.measurement.cycle,
            time_s: self.truth.time_s,
            position_rad: self.drive.measure(&q, &mut self.encoder_noise),
            force_n: filtered_n + noise,
        };
    }
}

fn finite<const N: usize>(name: &str, values: &Vector<N>) -> Result<(), PlantError> {
    let mut values = values.iter().enumerate();
    match values.find(|(_, value)| !value.is_finite()) {
        Some((joint, value)) => entry(false, format!("{name} of joint {joint}"), *value, "finite"),
        None => Ok(()),
    }
}

/// The same arm with another last link and another gravity.
fn with_load<const N: usize>(
    arm: &Arm<N>,
    last: Body,
    gravity_m_per_s2: Vector3<f64>,
) -> Result<Arm<N>, ArmError> {
    let mut links = *arm.links();
    let link = &mut links[N - 1];
    link.mass = last.mass_kg;
    link.first_moment = last.com_m * last.mass_kg;
    link.inertia = last.inertia_about_origin();
    Arm::from_links(
        links,
        arm.armature(),
        arm.joint_from_tip(),
        gravity_m_per_s2,
    )
}

/// Moment on each joint if everything beyond it lay in a level line: mass times gravity times the
/// length of the chain.
fn load_bound<const N: usize>(arm: &Arm<N>) -> Vector<N> {
    let gravity = libm::sqrt(arm.gravity().dot(&arm.gravity()));
    Vector::from_fn(|j, _| {
        let (mut length, mut moment) = (0.0, 0.0);
        for k in j..N {
            if k > j {
                length += arm.parent_from_joint(k).translation.norm();
            }
            let body = arm.body(k);
            moment += body.mass_kg * gravity * (length + body.com_m.norm());
        }
        moment
    })
}
