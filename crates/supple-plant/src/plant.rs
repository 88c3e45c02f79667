//! The plant: one control cycle of physics at a time.

use crate::actuators::{ActuatorState, motor_from_joint};
use crate::config::{Hose, PlantConfig};
use crate::elasticity::{LinkTorque, Rotors};
use crate::error::{PlantError, entry};
use crate::filter::Butterworth;
use crate::hand::HandState;
use crate::injection::ControllerView;
use crate::joint_frictions::{JointFrictions, Load};
use crate::noise::Noise;
use crate::record::{Measurement, StepRecord, Truth};
use crate::world::{Forces, Object, TipForce, TipMotion, World};
use supple_core::dynamics::{gravity, kinetic_energy};
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, ArmError, Body, Pose, Vector};

/// Maximum initial penetration of the tip \[m\]; at rest the penetration is some 0.01 mm.
const MAX_START_DEPTH_M: f64 = 1e-3;

/// The simulated arm in its scene.
pub struct Plant<const N: usize> {
    config: PlantConfig<N>,
    world: World<N>,
    actuators: ActuatorState<N>,
    filter: Butterworth,
    encoder_noise: Noise,
    force_noise: Noise,
    cycle_noise: Noise,
    frictions: JointFrictions<N>,
    /// Motors behind elastic transmissions.
    rotors: Option<Rotors<N>>,
    hand: Option<HandState>,
    steps: Vec<StepRecord>,
    steps_per_cycle: usize,
    /// Time from the scheduled to the actual start of the next cycle \[s\].
    late_s: f64,
    measurement: Measurement<N>,
    truth: Truth<N>,
    poses: [Pose; N],
    max_force_n: Vector3<f64>,
}

impl<const N: usize> Plant<N> {
    /// Builds the plant with the arm at `q0` \[rad\], `qd0` \[rad/s\]. Until the first delayed command
    /// acts, the motors hold the arm against gravity at `q0`.
    ///
    /// # Errors
    /// [`PlantError`] names the invalid entry, its value and the requirement, or the object that the tip penetrates
    /// by more than a millimetre at the start.
    pub fn new(
        config: PlantConfig<N>,
        q0: Vector<N>,
        qd0: Vector<N>,
    ) -> Result<Plant<N>, PlantError> {
        let steps_per_cycle = config.validate()?;
        finite("q0", &q0)?;
        finite("qd0", &qd0)?;
        let gravity_nm = gravity(&config.arm, &q0);
        let world = World::new(&config, &q0, &qd0)?;
        let transmission = motor_from_joint(&config.actuators).ok_or(PlantError::Transmission)?;
        let rotors = config.elasticity.as_ref().map(|elasticity| {
            let rotor_kg_m2 = config.arm.armature();
            let links = world.arm().inverse_inertia();
            let mut rotors = Rotors::new(elasticity, &rotor_kg_m2, &links, config.step_s);
            rotors.set_state(&q0, &qd0, &gravity_nm);
            rotors
        });
        let actuators = ActuatorState::new(config.actuators.clone(), &gravity_nm)?;
        let filter = Butterworth::new(config.force_sensor.cutoff_hz, config.step_s)?;
        let mut plant = Plant {
            world,
            actuators,
            filter,
            encoder_noise: Noise::new(config.seed, 1),
            force_noise: Noise::new(config.seed, 2),
            cycle_noise: Noise::new(config.seed, 3),
            frictions: JointFrictions::new(&config, transmission),
            rotors,
            hand: config.hand.clone().map(HandState::new),
            steps: Vec::with_capacity(steps_per_cycle),
            steps_per_cycle,
            late_s: 0.0,
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
                motor_torque_nm: gravity_nm,
                motor_position_rad: q0,
                motor_velocity_rad_per_s: qd0,
            },
            poses: [Pose::IDENTITY; N],
            max_force_n: Vector3::zeros(),
            config,
        };
        plant.read_state();
        plant.check_start_penetration()?;
        plant.measure(Vector3::zeros());
        Ok(plant)
    }

    /// Advances the simulation by one control cycle. `torque_nm` is the joint torque commanded in this cycle, positive along
    /// positive motion; it acts after the actuators' delay. A non-finite command is ignored.
    pub fn cycle(&mut self, torque_nm: &Vector<N>) -> Measurement<N> {
        let applied = self.actuators.command(torque_nm);
        let start_s = self.measurement.cycle as f64 * self.config.cycle_s + self.late_s;
        let step_s = self.jittered_step_s();
        self.steps.clear();
        let mut filtered = Vector3::zeros();
        for step in 1..=self.steps_per_cycle {
            let contact = self.step(&applied, step_s);
            filtered = self.filter.step(&contact.force_n);
            self.truth.time_s = start_s + step as f64 * step_s;
            self.steps.push(StepRecord {
                time_s: self.truth.time_s,
                force_n: contact.force_n,
                filtered_force_n: filtered,
                depth_m: contact.depth_m,
            });
        }
        self.measurement.cycle += 1;
        self.truth.time_s = self.measurement.cycle as f64 * self.config.cycle_s + self.late_s;
        self.measure(filtered);
        self.measurement
    }

    /// Returns the physics step of this cycle \[s\]; the cycle ends when the next one starts, which jitters.
    fn jittered_step_s(&mut self) -> f64 {
        let (cycle_s, jitter) = (self.config.cycle_s, self.config.cycle_jitter);
        if jitter == 0.0 {
            return self.config.step_s;
        }
        let next_s = jitter * cycle_s * (2.0 * self.cycle_noise.uniform() - 1.0);
        let lasts_s = cycle_s + next_s - self.late_s;
        self.late_s = next_s;
        lasts_s / self.steps_per_cycle as f64
    }

    /// Passes the controller's mode in the next cycle to the hand that guides the arm, if any.
    pub fn set_controller_view(&mut self, view: ControllerView) {
        if let Some(hand) = &mut self.hand {
            hand.set_controller_view(view, self.truth.time_s);
        }
    }

    /// Shorts exactly these motors from the next cycle on: they brake in addition to any commanded torque. A motor that was
    /// shorted brakes until its first torque acts, after the actuators' delay. Initially none is shorted.
    pub fn short_motors(&mut self, motors: [bool; N]) {
        self.actuators.short_motors(motors);
    }

    /// Adds a step to the joint velocities \[rad/s\], like an instantaneous impulse.
    ///
    /// # Errors
    /// [`PlantError`] if an entry is not finite.
    pub fn apply_velocity_step(&mut self, change: &Vector<N>) -> Result<(), PlantError> {
        finite("velocity change", change)?;
        self.world.apply_velocity_step(change);
        self.read_state();
        Ok(())
    }

    /// Reverses gravity, as if the arm were mounted upside down.
    pub fn reverse_gravity(&mut self) {
        let arm = &self.config.arm;
        // The arm was valid and stays valid with the reversed gravity vector.
        if let Ok(arm) = with_last_link(arm, arm.body(N - 1), -arm.gravity()) {
            self.frictions.set_arm(&arm);
            self.world.set_last_link_and_gravity(&arm);
            self.config.arm = arm;
        }
    }

    /// Fixes a ball of this mass \[kg\] to the tip, as large as the tip; it does not collide. It becomes part of the
    /// arm and of [`Plant::config`].
    ///
    /// # Errors
    /// [`PlantError`] if the mass is not finite and positive.
    pub fn add_payload(&mut self, mass_kg: f64) -> Result<(), PlantError> {
        let valid = mass_kg > 0.0 && mass_kg.is_finite();
        entry(valid, "payload mass_kg", mass_kg, "finite and positive")?;
        let loaded = with_payload(&self.config.arm, mass_kg, self.config.tip_radius_m);
        let must = "such that the last link stays a physical body";
        let arm = loaded.or(Err(PlantError::Entry {
            entry: "payload mass_kg".to_owned(),
            value: mass_kg,
            must,
        }))?;
        self.frictions.set_arm(&arm);
        self.world.set_last_link_and_gravity(&arm);
        self.config.arm = arm;
        Ok(())
    }

    /// Returns the kinetic energy of the arm with its rotors and payload \[J\].
    pub fn kinetic_energy_j(&self) -> f64 {
        let truth = &self.truth;
        let qd = &truth.velocity_rad_per_s;
        let energy_j = kinetic_energy(&self.config.arm, &truth.position_rad, qd);
        let Some(rotors) = &self.rotors else {
            return energy_j;
        };
        // `energy_j` assumes that the rotors turn at the speed of the joints.
        let armature = self.config.arm.armature();
        let moved = (0..N).filter(|i| rotors.is_elastic(*i));
        let at_joints: f64 = moved.map(|i| 0.5 * armature[i] * qd[i] * qd[i]).sum();
        energy_j - at_joints + rotors.energy_j(&truth.position_rad).1
    }

    /// Returns the potential energy of elastic cables or gears \[J\]; zero for a rigid transmission.
    pub fn elastic_energy_j(&self) -> f64 {
        let rotors = self.rotors.as_ref();
        rotors.map_or(0.0, |rotors| rotors.energy_j(&self.truth.position_rad).0)
    }

    /// Returns the largest contact force on the tip in all steps since the last call, base axes \[N\].
    pub fn take_max_force_n(&mut self) -> Vector3<f64> {
        core::mem::take(&mut self.max_force_n)
    }

    /// Returns the measurement at the end of the last cycle, or at the start.
    pub fn measurement(&self) -> &Measurement<N> {
        &self.measurement
    }

    /// Returns the ground truth at the end of the last cycle, or at the start.
    pub fn truth(&self) -> &Truth<N> {
        &self.truth
    }

    /// Records of all steps of the last cycle.
    pub fn steps(&self) -> &[StepRecord] {
        &self.steps
    }

    /// Returns the configuration of the plant, with any added payload.
    pub fn config(&self) -> &PlantConfig<N> {
        &self.config
    }

    /// Returns the current joint frames, `base_from_joint`.
    pub fn joint_poses(&self) -> &[Pose; N] {
        &self.poses
    }

    /// Objects of the environment in their current state.
    pub fn objects(&self) -> impl Iterator<Item = Object> {
        self.world.objects()
    }

    /// Returns the load of each joint, 0 to 1: gravity moment on motor and bearings, relative to that of the horizontally
    /// stretched arm.
    pub fn load(&self) -> Vector<N> {
        Load::new(&self.config.arm).relative(&self.poses)
    }

    /// Sets the arm to `q` \[rad\], `qd` \[rad/s\], with relaxed bristles, a reset filter and motors that hold it
    /// against gravity. Time and scene are unchanged.
    ///
    /// # Errors
    /// [`PlantError`] if an entry is not finite, or if the tip is more than a millimetre inside an object; in the
    /// latter case the arm is moved nevertheless.
    pub fn set_state(&mut self, q: Vector<N>, qd: Vector<N>) -> Result<(), PlantError> {
        finite("q", &q)?;
        finite("qd", &qd)?;
        self.world.set_state(&q, &qd);
        let gravity_nm = gravity(&self.config.arm, &q);
        if let Some(rotors) = &mut self.rotors {
            rotors.set_state(&q, &qd, &gravity_nm);
        }
        self.actuators.restart(&gravity_nm);
        self.filter.reset();
        self.frictions.reset();
        self.steps.clear();
        self.truth.contact_force_n = Vector3::zeros();
        self.truth.friction_torque_nm = Vector::zeros();
        self.read_state();
        self.measure(Vector3::zeros());
        self.check_start_penetration()
    }

    /// Rejects a tip that starts deep inside an object, because the contact force would eject it.
    fn check_start_penetration(&self) -> Result<(), PlantError> {
        match self.world.deepest(&self.tip_motion()) {
            Some((object, depth_m)) if depth_m > MAX_START_DEPTH_M => {
                Err(PlantError::TipInsideObject { object, depth_m })
            }
            _ => Ok(()),
        }
    }

    /// Runs one step of the physics of `dt_s` under the commanded joint torque `applied`.
    fn step(&mut self, applied: &Vector<N>, dt_s: f64) -> TipForce {
        let (q, qd) = (self.truth.position_rad, self.truth.velocity_rad_per_s);
        let (motor_q, motor_qd) = self.motor_state();
        let motor =
            self.actuators.motor_torque(applied, &motor_q) + self.actuators.braking(&motor_qd);
        let time_s = self.truth.time_s;
        let frictions = &mut self.frictions;
        let mut friction = frictions.joints_nm((&q, &qd), &motor, &self.poses, time_s, dt_s);
        let at_motors = frictions.motors_nm(&motor_qd, time_s, dt_s);
        let on_rotors = at_motors.map_or(motor, |friction| motor - friction);
        let transmitted = match &mut self.rotors {
            Some(rotors) => rotors.torque((&q, &qd), &on_rotors, dt_s),
            None => LinkTorque {
                torque_nm: on_rotors,
                damping_nm_s_per_rad: Vector::zeros(),
            },
        };
        let mut torque = transmitted.torque_nm - friction;
        if let Some(stops) = &self.config.stops {
            for i in 0..N {
                torque[i] += stops.torque_nm(i, q[i], qd[i]);
            }
        }
        let hose = &self.config.hose;
        if *hose != Hose::none() {
            torque -= q.component_mul(&hose.stiffness_nm_per_rad) + hose.preload_nm;
        }
        let tip = self.tip_motion();
        let mut contact = self.world.compute_tip_contact(&tip, dt_s);
        if let Some(hand) = &mut self.hand {
            contact.force_n += hand.force_n(time_s, &tip.center_m, &tip.linear_m_per_s);
        }
        let forces = Forces {
            torque_nm: &torque,
            damping_nm_s_per_rad: &transmitted.damping_nm_s_per_rad,
            tip: &contact,
            tip_center_m: &tip.center_m,
        };
        self.world.step(&forces, dt_s);
        if contact.force_n.norm_squared() > self.max_force_n.norm_squared() {
            self.max_force_n = contact.force_n;
        }
        if let Some(at_motors) = at_motors {
            friction += at_motors;
        }
        self.truth.contact_force_n = contact.force_n;
        self.truth.friction_torque_nm = friction;
        self.truth.motor_torque_nm = motor;
        if let Some(rotors) = &mut self.rotors {
            let arm = self.world.arm();
            rotors.advance((&arm.position_rad, &arm.velocity_rad_per_s), dt_s);
        }
        self.read_state();
        contact
    }

    /// Returns the angles and velocities of the motors, seen at the joints.
    fn motor_state(&self) -> (Vector<N>, Vector<N>) {
        let truth = &self.truth;
        (truth.motor_position_rad, truth.motor_velocity_rad_per_s)
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
        let arm = self.world.arm();
        let (q, qd) = (arm.position_rad, arm.velocity_rad_per_s);
        self.poses = arm.poses;
        let tip = self.poses[N - 1] * self.config.arm.joint_from_tip();
        self.truth.position_rad = q;
        self.truth.velocity_rad_per_s = qd;
        let (motor_q, motor_qd) = match &self.rotors {
            Some(rotors) => rotors.state(),
            None => (q, qd),
        };
        self.truth.motor_position_rad = motor_q;
        self.truth.motor_velocity_rad_per_s = motor_qd;
        self.truth.tip_position_m = tip.translation;
        // Use J qd: the link velocities of the engine lag by one step.
        let tip_velocity = |pose: &Pose, rate: f64| {
            let axis: Vector3<f64> = pose.rotation.column(2).into();
            axis.cross(&(tip.translation - pose.translation)) * rate
        };
        let rates = self.poses.iter().zip(qd.iter());
        self.truth.tip_velocity_m_per_s = rates.map(|(pose, rate)| tip_velocity(pose, *rate)).sum();
    }

    fn measure(&mut self, filtered_n: Vector3<f64>) {
        let q = self.truth.motor_position_rad;
        let noise_n = self.config.force_sensor.noise_n;
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
            time_s: self.measurement.cycle as f64 * self.config.cycle_s,
            position_rad: self.actuators.measure(&q, &mut self.encoder_noise),
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

/// Returns the same arm with a ball of this mass and radius fixed to its tip.
pub(crate) fn with_payload<const N: usize>(
    arm: &Arm<N>,
    mass_kg: f64,
    radius_m: f64,
) -> Result<Arm<N>, ArmError> {
    let payload = Body::ball(mass_kg, radius_m, arm.joint_from_tip().translation);
    with_last_link(arm, arm.body(N - 1).merged(&payload), arm.gravity())
}

/// Returns the same arm with another last link and another gravity.
fn with_last_link<const N: usize>(
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
