//! The whole arm on its bus: an event at a time, in virtual time.

use crate::config::EmulatorConfig;
use crate::error::EmulatorError;
use crate::puck::{Power, Puck};
use crate::safety::{Press, SafetyModule};
use crate::sensor::ForceSensor;
use crate::wire::Wire;
use std::collections::VecDeque;
use supple_bus::virtual_time::Peer;
use supple_bus::{BusFault, Event};
use supple_core::dynamics::tip_pose;
use supple_core::nalgebra::Matrix4;
use supple_core::{Matrix, Vector};
use supple_plant::{Drive, Injection, InjectionError, Injector, Plant, PlantConfig, Sight, Truth};
use supple_puck::safety::SafetyMode;
use supple_puck::status::MotorMode;
use supple_puck::{CanFrame, Destination, GroupId, NodeId, PackedTorques};

/// Something worth telling, with its time \[ns\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Happening {
    /// An operator pressed a button.
    Pressed(Press),
    /// The safety module came to this mode.
    Safety(SafetyMode, crate::safety::Cause),
    /// A motor puck came to this mode.
    Motor(usize, MotorMode),
    /// The host spoke while pucks were waking and was driven off the bus.
    SpokeWhileWaking,
}

/// The emulated arm.
pub struct Emulator<const N: usize> {
    config: EmulatorConfig,
    now_ns: u64,
    next_tick_ns: u64,
    wire: Wire,
    plant: Plant<N>,
    injector: Injector<N>,
    motor_from_joint: Matrix<N, N>,
    pucks: Vec<Puck>,
    safety: SafetyModule,
    sensor: Option<ForceSensor>,
    /// Until then the host is off the bus \[ns\].
    host_off_until_ns: Option<u64>,
    report: Option<BusFault>,
    random: u64,
    happenings: Vec<(u64, Happening)>,
    /// The machine's clock over the arm's time, now and at each happening \[ns\].
    offset_ns: u64,
    offsets_ns: Vec<u64>,
    /// Presses to come, the soonest first.
    presses: VecDeque<(u64, Press)>,
    /// Presses that wait for the host's first torque, with their time after it \[ns\].
    once_held: Vec<(u64, Press)>,
    powered: bool,
    in_cradle: bool,
}

impl<const N: usize> Emulator<N> {
    /// An arm at rest at `start_rad`, powered up in the emergency stop, at time `start_ns`. Of the
    /// plant's drive transmission, ripple and braking are used: counts and torque units are the pucks'.
    ///
    /// # Errors
    /// An arm that has not 4 or 7 joints, a puck without a list of ids, or what the plant refuses.
    pub fn new(
        config: EmulatorConfig,
        mut plant: PlantConfig<N>,
        start_rad: Vector<N>,
        start_ns: u64,
    ) -> Result<Emulator<N>, EmulatorError> {
        if N != 4 && N != 7 {
            return Err(EmulatorError::Joints { found: N });
        }
        if config.pucks.len() != N {
            return Err(EmulatorError::Pucks {
                found: config.pucks.len(),
                expected: N,
            });
        }
        let joint_from_motor = plant.drive.joint_from_motor;
        let motor_from_joint = joint_from_motor
            .try_inverse()
            .ok_or(EmulatorError::Transmission)?;
        plant.drive = Drive {
            joint_from_motor,
            ripple: plant.drive.ripple,
            braking_nm_s_per_rad: plant.drive.braking_nm_s_per_rad,
            ..Drive::direct()
        };
        plant.step_s = config.step_ns as f64 * 1e-9;
        plant.cycle_s = plant.step_s;
        let mut pucks = Vec::with_capacity(N);
        for (index, puck) in config.pucks.iter().enumerate() {
            let version = puck.version;
            let puck = Puck::new(index + 1, *puck);
            pucks.push(puck.ok_or(EmulatorError::Firmware {
                node: index + 1,
                version,
            })?);
        }
        let rad_per_count = core::array::from_fn(|i| {
            core::f64::consts::TAU / f64::from(config.pucks[i].counts_per_revolution)
        });
        let safety = SafetyModule::new(
            config.safety,
            N,
            Matrix4::from_fn(|i, j| joint_from_motor[(i, j)]),
            rad_per_count,
        );
        let safety = safety.ok_or(EmulatorError::Firmware {
            node: usize::from(NodeId::SAFETY.number()),
            version: config.safety.version,
        })?;
        let plant = Plant::new(plant, start_rad, Vector::zeros())?;
        let mut emulator = Emulator {
            injector: Injector::none(&plant),
            now_ns: start_ns,
            next_tick_ns: start_ns + config.step_ns,
            wire: Wire::default(),
            plant,
            motor_from_joint,
            pucks,
            safety,
            sensor: config.force_sensor.then(ForceSensor::new),
            host_off_until_ns: None,
            report: None,
            random: config.seed,
            happenings: Vec::new(),
            offset_ns: 0,
            offsets_ns: Vec::new(),
            presses: VecDeque::new(),
            once_held: Vec::new(),
            powered: false,
            in_cradle: config.cradle,
            config,
        };
        for puck in &mut emulator.pucks {
            puck.power_down();
        }
        emulator.turn_motors();
        if emulator.config.zeroed {
            emulator.press(Press::Idle);
            let counts: Vec<i32> = emulator.true_counts();
            for (puck, counts) in emulator.pucks.iter_mut().zip(counts) {
                puck.wake_at_once();
                puck.define(counts);
            }
            emulator.safety.set_zeroed(true);
        }
        Ok(emulator)
    }

    /// Puts faults into the arm, in the place of those given before; to be called before time goes on. Delays are
    /// counted in control cycles of `period_s`. Encoders are those of joints, replies those of pucks.
    ///
    /// # Errors
    /// What an arm on a bus cannot do, and a joint or motor that this one has not.
    pub fn inject(
        &mut self,
        injections: &[Injection],
        period_s: f64,
    ) -> Result<(), InjectionError> {
        for injection in injections {
            injection.on_bus()?;
        }
        self.injector = Injector::new(injections, &mut self.plant, period_s)?;
        self.turn_motors();
        Ok(())
    }

    /// How many of them have begun.
    pub fn injections_begun(&self) -> usize {
        self.injector.begun()
    }

    /// An operator presses a button.
    pub fn press(&mut self, press: Press) {
        self.note(Happening::Pressed(press));
        let told = self.safety.press(self.now_ns, press);
        self.tell(told);
    }

    /// An operator will press a button at a time \[ns\].
    pub fn press_at(&mut self, time_ns: u64, press: Press) {
        let at = self.presses.partition_point(|(due, _)| *due <= time_ns);
        self.presses.insert(at, (time_ns, press));
    }

    /// An operator will press a button `after_ns` after the host first asks for a torque that is not zero: once
    /// somebody wants to hold the arm.
    pub fn press_once_held(&mut self, after_ns: u64, press: Press) {
        self.once_held.push((after_ns, press));
    }

    /// Safety module with its pendant.
    pub fn safety(&self) -> &SafetyModule {
        &self.safety
    }

    /// The same, to set the bus voltage.
    pub fn safety_mut(&mut self) -> &mut SafetyModule {
        &mut self.safety
    }

    /// Motor pucks, in the order of the joints.
    pub fn pucks(&self) -> &[Puck] {
        &self.pucks
    }

    /// What the arm really does.
    pub fn truth(&self) -> &Truth<N> {
        self.plant.truth()
    }

    /// The plant.
    pub fn plant(&self) -> &Plant<N> {
        &self.plant
    }

    /// The same.
    pub fn plant_mut(&mut self) -> &mut Plant<N> {
        &mut self.plant
    }

    /// Torque of each motor, braking included \[N m\].
    pub fn motor_torque_nm(&self) -> Vector<N> {
        let speed = self.motor_from_joint * self.plant.truth().velocity_rad_per_s;
        let braking = &self.plant.config().drive.braking_nm_s_per_rad;
        let commanded = self.commanded_nm();
        Vector::from_fn(|i, _| match self.pucks[i].brakes() {
            _ if self.injector.is_dead(i) => 0.0,
            true => commanded[i] - braking[i] * speed[i],
            false => commanded[i],
        })
    }

    /// Torque that each motor is commanded \[N m\].
    fn commanded_nm(&self) -> Vector<N> {
        Vector::from_fn(|i, _| self.pucks[i].torque_nm())
    }

    /// What has happened so far, with its times \[ns\].
    pub fn happenings(&self) -> &[(u64, Happening)] {
        &self.happenings
    }

    /// The same, by the machine's monotonic clock where it differs \[ns\].
    pub fn happenings_by_the_wall(&self) -> impl Iterator<Item = (u64, Happening)> {
        let timed = self.happenings.iter().zip(&self.offsets_ns);
        timed.map(|((time_ns, happening), offset_ns)| (time_ns + offset_ns, *happening))
    }

    /// The machine's monotonic clock over the arm's time from now on \[ns\].
    pub fn set_offset_ns(&mut self, offset_ns: u64) {
        self.offset_ns = offset_ns;
    }

    /// Now, by the machine's monotonic clock where it differs \[ns\].
    pub fn wall_ns(&self) -> u64 {
        self.now_ns + self.offset_ns
    }

    fn note(&mut self, happening: Happening) {
        self.happenings.push((self.now_ns, happening));
        self.offsets_ns.push(self.offset_ns);
    }

    /// Time that frames have occupied the bus \[ns\].
    pub fn bus_busy_ns(&self) -> u64 {
        self.wire.busy_ns()
    }

    /// When something will happen next without the host \[ns\].
    pub fn next_ns(&self) -> u64 {
        let wire = self.wire.next_end_ns().unwrap_or(u64::MAX);
        wire.min(self.next_tick_ns)
    }

    /// The world stands still while `gap_ns` pass: every time that is waited for moves on.
    pub fn skip(&mut self, gap_ns: u64) {
        let now = self.now_ns + gap_ns;
        self.wire.clear();
        self.next_tick_ns += gap_ns;
        self.now_ns = now;
    }

    /// Counts that stand for where the motors really are.
    fn true_counts(&self) -> Vec<i32> {
        let angles = self.motor_from_joint * self.plant.truth().position_rad;
        let scale = |i: usize| f64::from(self.config.pucks[i].counts_per_revolution);
        let counts = angles.iter().enumerate();
        counts
            .map(|(i, angle)| (angle / core::f64::consts::TAU * scale(i)).round() as i32)
            .collect()
    }

    fn turn_motors(&mut self) {
        let angles = self.motor_from_joint * self.injector.position_rad();
        for (puck, angle) in self.pucks.iter_mut().zip(angles.iter()) {
            puck.turn(*angle);
        }
    }

    /// One step of the physics, and whatever the nodes do by themselves.
    fn tick(&mut self) {
        if !self.in_cradle {
            let motor = self.commanded_nm();
            let shorted = core::array::from_fn(|i| self.pucks[i].brakes());
            let sight = Sight {
                active: !shorted.contains(&true),
                mode: None,
            };
            let torque_nm = self.motor_from_joint.transpose() * motor;
            self.injector
                .cycle(&mut self.plant, sight, &torque_nm, shorted);
            self.turn_motors();
        }
        let modes: Vec<MotorMode> = self.pucks.iter().map(Puck::mode).collect();
        for puck in &mut self.pucks {
            puck.tick(self.now_ns, self.config.wake_ns);
        }
        self.note_modes(&modes);
        if let Some(sensor) = &mut self.sensor {
            let q = self.plant.truth().position_rad;
            let base_from_tip = tip_pose(&self.plant.config().arm, &q);
            let force_n = self.plant.measurement().force_n;
            sensor.feel(base_from_tip.rotation.transpose() * force_n);
        }
        while let Some((due, press)) = self.presses.front().copied()
            && due <= self.now_ns
        {
            self.presses.pop_front();
            self.press(press);
        }
        let told = self.safety.tick(self.now_ns);
        self.tell(told);
        if self
            .host_off_until_ns
            .is_some_and(|until| self.now_ns >= until)
        {
            self.host_off_until_ns = None;
            self.report = Some(BusFault::Restarted);
        }
        self.next_tick_ns += self.config.step_ns;
    }

    /// Lets the safety module speak, and the power follow its mode.
    fn tell(&mut self, frame: Option<CanFrame>) {
        let Some(frame) = frame else {
            return;
        };
        let mode = self.safety.mode();
        let cause = self.safety.cause();
        self.note(Happening::Safety(mode, cause));
        let powered = mode != SafetyMode::EStop;
        if powered != self.powered {
            let modes: Vec<MotorMode> = self.pucks.iter().map(Puck::mode).collect();
            for puck in &mut self.pucks {
                if powered {
                    puck.power_up();
                } else {
                    puck.power_down();
                }
            }
            self.note_modes(&modes);
            self.powered = powered;
        }
        self.wire.queue(self.now_ns, frame);
    }

    fn note_modes(&mut self, before: &[MotorMode]) {
        for (index, before) in before.iter().enumerate() {
            let mode = self.pucks[index].mode();
            if mode != *before {
                self.in_cradle &= mode != MotorMode::Torque;
                self.note(Happening::Motor(index, mode));
            }
        }
    }

    fn waking(&self) -> bool {
        self.pucks.iter().any(|puck| match puck.power() {
            Power::Waking(since_ns) => self.now_ns >= since_ns + self.config.wake_quiet_from_ns,
            _ => false,
        })
    }

    /// A frame has ended: every other node hears it. What the host notices of it.
    fn deliver(&mut self, frame: CanFrame) -> Option<Event> {
        let from_host = frame.id().from() == NodeId::HOST;
        if from_host && self.waking() {
            self.note(Happening::SpokeWhileWaking);
            self.host_off_until_ns = Some(self.now_ns + self.config.restart_ns);
            return Some(Event::Fault(BusFault::BusOff));
        }
        if !self.once_held.is_empty() && from_host && asks_for_torque(&frame) {
            for (after_ns, press) in core::mem::take(&mut self.once_held) {
                self.press_at(self.now_ns + after_ns, press);
            }
        }
        let modes: Vec<MotorMode> = self.pucks.iter().map(Puck::mode).collect();
        for index in 0..self.pucks.len() {
            let answer = self.pucks[index].hear(self.now_ns, &frame);
            if let Some(answer) = answer
                && !(is_position(&answer) && self.injector.loses_reply(index))
            {
                let ready_ns = self.ready_ns();
                self.wire.queue(ready_ns, answer);
            }
        }
        self.note_modes(&modes);
        if let Some(sensor) = &mut self.sensor {
            let readings = sensor.hear(self.now_ns, &frame);
            // Both at once: a node keeps the order of its frames.
            let ready_ns = self.ready_ns();
            for reading in readings.into_iter().flatten() {
                self.wire.queue(ready_ns, reading);
            }
        }
        let before = self.safety.mode();
        let told = self.safety.hear(self.now_ns, &frame);
        if self.safety.mode() == before {
            if let Some(answer) = told {
                let ready_ns = self.ready_ns();
                self.wire.queue(ready_ns, answer);
            }
        } else {
            self.tell(told);
        }
        if self.host_off_until_ns.is_some() {
            return None;
        }
        Some(if from_host {
            Event::Sent(frame)
        } else {
            Event::Frame(frame)
        })
    }

    /// When a node answers what it hears now \[ns\].
    fn ready_ns(&mut self) -> u64 {
        self.now_ns + self.config.latency_ns + self.jitter_ns()
    }

    /// SplitMix64.
    fn jitter_ns(&mut self) -> u64 {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.random;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % (self.config.jitter_ns + 1)
    }
}

/// A puck's answer to a request for its position.
fn is_position(frame: &CanFrame) -> bool {
    frame.id().to() == Destination::Group(GroupId::POSITION)
}

/// A packed torque frame with a torque in it.
fn asks_for_torque(frame: &CanFrame) -> bool {
    let to_motors = matches!(
        frame.id().to(),
        Destination::Group(GroupId::LOWER_TORQUES | GroupId::UPPER_TORQUES)
    );
    let torques = PackedTorques::parse(frame);
    to_motors && torques.is_ok_and(|torques| torques.slots.iter().any(|t| t.units() != 0))
}

impl<const N: usize> Peer for Emulator<N> {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn host_sends(&mut self, frame: &CanFrame) {
        if self.host_off_until_ns.is_none() {
            self.wire.queue(self.now_ns, *frame);
        }
    }

    fn run_until(&mut self, until_ns: u64) -> Option<Event> {
        let until_ns = until_ns.max(self.now_ns);
        loop {
            if let Some(fault) = self.report.take() {
                return Some(Event::Fault(fault));
            }
            let end_ns = self.wire.next_end_ns().unwrap_or(u64::MAX);
            let next_ns = end_ns.min(self.next_tick_ns);
            if next_ns > until_ns {
                // A frame that begins before the host speaks again is not overtaken by what it says.
                self.wire.advance(until_ns);
                self.now_ns = until_ns;
                return None;
            }
            self.now_ns = next_ns;
            if self.next_tick_ns <= end_ns {
                self.tick();
            } else if let Some((frame, _)) = self.wire.advance(next_ns)
                && let Some(event) = self.deliver(frame)
            {
                return Some(event);
            }
        }
    }
}
