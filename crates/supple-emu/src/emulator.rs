//! The complete emulated WAM on its bus: an event-driven simulation in virtual time.

use crate::config::EmulatorConfig;
use crate::error::EmulatorError;
use crate::puck::{Power, Puck};
use crate::safety::{ButtonPress, SafetyModule};
use crate::sensor::ForceSensor;
use crate::wire::Wire;
use std::collections::VecDeque;
use supple_bus::virtual_time::EmulatedNodes;
use supple_bus::{BusFault, Event};
use supple_can_frame::{BitRates, CanFrame};
use supple_core::dynamics::tip_pose;
use supple_core::nalgebra::Matrix4;
use supple_core::{Matrix, Vector};
use supple_plant::{
    ActuatorModel, ControllerView, Injection, InjectionError, Injector, Plant, PlantConfig, Truth,
};
use supple_puck::safety::SafetyMode;
use supple_puck::status::MotorMode;
use supple_puck::{Destination, GroupId, MessageId, NodeId, PackedTorques};
use supple_random::Random;

/// An event of the emulated arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmEvent {
    /// The operator pressed a button.
    Pressed(ButtonPress),
    /// The safety module entered this mode, for this cause.
    Safety(SafetyMode, crate::safety::Cause),
    /// A motor puck entered this mode.
    Motor(usize, MotorMode),
    /// A person put the arm back into the cradle.
    PutIntoCradle,
    /// The host sent a frame while the transceiver of a waking puck was resetting, and went bus-off.
    HostSentDuringWakeUp,
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
    /// Time until which the host's CAN controller is bus-off \[ns\].
    host_bus_off_until_ns: Option<u64>,
    /// Fault that the host has not received yet.
    pending_fault: Option<BusFault>,
    random: Random,
    arm_events: Vec<(u64, ArmEvent)>,
    /// Current difference between CLOCK_MONOTONIC and the arm's time \[ns\].
    offset_ns: u64,
    /// `offset_ns` at each event.
    event_offsets_ns: Vec<u64>,
    /// Scheduled button presses in order of time.
    presses: VecDeque<(u64, ButtonPress)>,
    /// Button presses scheduled relative to the host's first torque, with their delay after it \[ns\].
    after_first_torque: Vec<(u64, ButtonPress)>,
    powered: bool,
    /// Whether a cradle holds the arm in its start pose, until the motors enter torque mode.
    in_cradle: bool,
    start_rad: Vector<N>,
}

impl<const N: usize> Emulator<N> {
    /// Creates an arm at standstill at `start_rad`, at time `start_ns`. It is in emergency stop with unpowered pucks; with
    /// `config.zeroed` it is in idle with pucks that are awake and have their position reference. The plant's actuator model
    /// provides transmission, amplifiers, braking and delays beyond the first cycle; the pucks provide counts and torque units.
    /// The bias of the encoders is subtracted from `start_rad`.
    ///
    /// # Errors
    /// If the arm does not have 4 or 7 joints or a puck for each, its transmission is singular, no property ids are known for a
    /// puck's firmware, or the plant rejects its configuration.
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
        let joint_from_motor = plant.actuators.joint_from_motor;
        let motor_from_joint = joint_from_motor
            .try_inverse()
            .ok_or(EmulatorError::Transmission)?;
        let step_s = config.step_ns as f64 * 1e-9;
        // The emulated bus already delays torques by one cycle.
        let extra_delay_s =
            plant.actuators.torque_delay_cycles.saturating_sub(1) as f64 * plant.cycle_s;
        plant.actuators = ActuatorModel {
            counts_per_motor_revolution: Vector::zeros(),
            motor_torque_quantum_nm: Vector::zeros(),
            torque_delay_cycles: (extra_delay_s / step_s).round() as usize,
            ..plant.actuators
        };
        plant.step_s = step_s;
        plant.cycle_s = plant.step_s;
        // The bus has its own jitter.
        plant.cycle_jitter = 0.0;
        // The host sets the positions as if the arm were exactly in its home pose: the measured angles have the bias as error.
        let start_rad = start_rad - plant.actuators.encoder_bias_rad;
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
            wire: Wire::new(BitRates::CLASSIC_1M),
            plant,
            motor_from_joint,
            pucks,
            safety,
            sensor: config.force_sensor.then(ForceSensor::new),
            host_bus_off_until_ns: None,
            pending_fault: None,
            random: Random::new(config.seed),
            arm_events: Vec::new(),
            offset_ns: 0,
            event_offsets_ns: Vec::new(),
            presses: VecDeque::new(),
            after_first_torque: Vec::new(),
            powered: false,
            in_cradle: config.cradle,
            start_rad,
            config,
        };
        for puck in &mut emulator.pucks {
            puck.power_down();
        }
        emulator.update_motor_angles();
        if emulator.config.zeroed {
            emulator.press(ButtonPress::Idle);
            let counts: Vec<i32> = emulator.true_counts();
            for (puck, counts) in emulator.pucks.iter_mut().zip(counts) {
                puck.wake_at_once();
                puck.set_counts(counts);
            }
            emulator.safety.set_zeroed(true);
        }
        Ok(emulator)
    }

    /// Injects faults into the arm, replacing earlier ones. Call it before advancing time. Delays are counted in
    /// control cycles of `period_s`. Encoder faults refer to joints, reply faults to pucks.
    ///
    /// # Errors
    /// If a fault is not supported on a bus, or its joint or motor does not exist.
    pub fn inject(
        &mut self,
        injections: &[Injection],
        period_s: f64,
    ) -> Result<(), InjectionError> {
        for injection in injections {
            injection.check_bus_support()?;
        }
        self.injector = Injector::new(injections, &mut self.plant, period_s)?;
        self.update_motor_angles();
        Ok(())
    }

    /// Number of injected faults that have started.
    pub fn injections_begun(&self) -> usize {
        self.injector.begun()
    }

    /// Puts the arm back into the cradle in its start pose, as a person does.
    ///
    /// # Errors
    /// The reason as text; the arm then does not move. Reasons: a motor follows torque commands, faults of the plant are injected,
    /// or an object blocks the cradle.
    pub fn put_into_cradle(&mut self) -> Result<(), &'static str> {
        if self
            .pucks
            .iter()
            .any(|puck| puck.mode() == MotorMode::Torque)
        {
            return Err("the motors apply torque: press idle first");
        }
        if !self.injector.is_empty() {
            return Err("injected faults refer to the start pose: restart the emulator instead");
        }
        if self
            .plant
            .set_state(self.start_rad, Vector::zeros())
            .is_err()
        {
            return Err("something is in the way of the cradle");
        }
        self.injector = Injector::none(&self.plant);
        self.update_motor_angles();
        self.in_cradle = true;
        self.record(ArmEvent::PutIntoCradle);
        Ok(())
    }

    /// Presses a button of the pendant.
    pub fn press(&mut self, press: ButtonPress) {
        self.record(ArmEvent::Pressed(press));
        let safety_frame = self.safety.press(self.now_ns, press);
        self.apply_safety_mode(safety_frame);
    }

    /// Schedules a button press at a time \[ns\].
    pub fn press_at(&mut self, time_ns: u64, press: ButtonPress) {
        let at = self.presses.partition_point(|(due, _)| *due <= time_ns);
        self.presses.insert(at, (time_ns, press));
    }

    /// Schedules a button press `after_ns` after the host first commands a nonzero torque.
    pub fn press_after_first_torque(&mut self, after_ns: u64, press: ButtonPress) {
        self.after_first_torque.push((after_ns, press));
    }

    /// The safety module with its pendant.
    pub fn safety(&self) -> &SafetyModule {
        &self.safety
    }

    /// The safety module, for example to set the bus voltage.
    pub fn safety_mut(&mut self) -> &mut SafetyModule {
        &mut self.safety
    }

    /// Motor pucks, in the order of the joints.
    pub fn pucks(&self) -> &[Puck] {
        &self.pucks
    }

    /// Ground truth of the arm's motion.
    pub fn truth(&self) -> &Truth<N> {
        self.plant.truth()
    }

    /// The plant.
    pub fn plant(&self) -> &Plant<N> {
        &self.plant
    }

    /// The plant.
    pub fn plant_mut(&mut self) -> &mut Plant<N> {
        &mut self.plant
    }

    /// Torque of each motor, including braking \[N m\].
    pub fn motor_torque_nm(&self) -> Vector<N> {
        let speed = self.motor_from_joint * self.plant.truth().motor_velocity_rad_per_s;
        let braking = &self.plant.config().actuators.braking_nm_s_per_rad;
        let commanded = self.commanded_nm();
        Vector::from_fn(|i, _| match self.pucks[i].brakes() {
            _ if self.injector.is_dead(i) => 0.0,
            true => commanded[i] - braking[i] * speed[i],
            false => commanded[i],
        })
    }

    /// Commanded torque of each motor \[N m\].
    fn commanded_nm(&self) -> Vector<N> {
        Vector::from_fn(|i, _| self.pucks[i].torque_nm())
    }

    /// All events so far, with their times \[ns\].
    pub fn arm_events(&self) -> &[(u64, ArmEvent)] {
        &self.arm_events
    }

    /// All events so far, with their times by CLOCK_MONOTONIC \[ns\].
    pub fn events_in_monotonic_time(&self) -> impl Iterator<Item = (u64, ArmEvent)> {
        let timed = self.arm_events.iter().zip(&self.event_offsets_ns);
        timed.map(|((time_ns, arm_event), offset_ns)| (time_ns + offset_ns, *arm_event))
    }

    /// Sets the offset of CLOCK_MONOTONIC from the arm's time \[ns\].
    pub fn set_offset_ns(&mut self, offset_ns: u64) {
        self.offset_ns = offset_ns;
    }

    /// Current time by CLOCK_MONOTONIC \[ns\].
    pub fn monotonic_ns(&self) -> u64 {
        self.now_ns + self.offset_ns
    }

    fn record(&mut self, arm_event: ArmEvent) {
        self.arm_events.push((self.now_ns, arm_event));
        self.event_offsets_ns.push(self.offset_ns);
    }

    /// Time that frames have occupied the bus \[ns\].
    pub fn bus_busy_ns(&self) -> u64 {
        self.wire.busy_ns()
    }

    /// Time of the next event that does not depend on the host \[ns\].
    pub fn next_ns(&self) -> u64 {
        let wire = self.wire.next_end_ns().unwrap_or(u64::MAX);
        wire.min(self.next_tick_ns)
    }

    /// Advances the clock and the time of the next physics step by `gap_ns` without motion, and discards all frames that wait for
    /// the bus. The timeouts of the safety module, of a wake-up and of the host's bus-off continue.
    pub fn shift_clock(&mut self, gap_ns: u64) {
        let now = self.now_ns + gap_ns;
        self.wire.pause(gap_ns);
        self.next_tick_ns += gap_ns;
        self.now_ns = now;
    }

    /// Encoder counts of the true motor angles.
    fn true_counts(&self) -> Vec<i32> {
        let angles = self.motor_from_joint * self.plant.measurement().position_rad;
        let scale = |i: usize| f64::from(self.config.pucks[i].counts_per_revolution);
        let counts = angles.iter().enumerate();
        counts
            .map(|(i, angle)| (angle / core::f64::consts::TAU * scale(i)).round() as i32)
            .collect()
    }

    fn update_motor_angles(&mut self) {
        let angles = self.motor_from_joint * self.injector.position_rad();
        for (puck, angle) in self.pucks.iter_mut().zip(angles.iter()) {
            puck.set_motor_angle(*angle);
        }
    }

    /// Runs one physics step and the time-driven behaviour of the nodes.
    fn tick(&mut self) {
        if !self.in_cradle {
            let motor_torque_nm = self.commanded_nm();
            let shorted = core::array::from_fn(|i| self.pucks[i].brakes());
            let view = ControllerView {
                active: !shorted.contains(&true),
                mode: None,
            };
            let torque_nm = self.motor_from_joint.transpose() * motor_torque_nm;
            self.injector
                .cycle(&mut self.plant, view, &torque_nm, shorted);
            self.update_motor_angles();
        }
        let modes: Vec<MotorMode> = self.pucks.iter().map(Puck::mode).collect();
        for puck in &mut self.pucks {
            puck.tick(self.now_ns, self.config.wake_ns);
        }
        self.record_modes(&modes);
        if let Some(sensor) = &mut self.sensor {
            let q = self.plant.truth().position_rad;
            let base_from_tip = tip_pose(&self.plant.config().arm, &q);
            let force_n = self.plant.measurement().force_n;
            sensor.set_force(base_from_tip.rotation.transpose() * force_n);
        }
        while let Some((due, press)) = self.presses.front().copied()
            && due <= self.now_ns
        {
            self.presses.pop_front();
            self.press(press);
        }
        let safety_frame = self.safety.tick(self.now_ns);
        self.apply_safety_mode(safety_frame);
        if self
            .host_bus_off_until_ns
            .is_some_and(|until| self.now_ns >= until)
        {
            self.host_bus_off_until_ns = None;
            self.pending_fault = Some(BusFault::Restarted);
        }
        self.next_tick_ns += self.config.step_ns;
    }

    /// Applies a change of the safety module's mode: sends its frame to the motors and switches the pucks' power. Without a frame,
    /// the mode has not changed.
    fn apply_safety_mode(&mut self, frame: Option<CanFrame>) {
        let Some(frame) = frame else {
            return;
        };
        let mode = self.safety.mode();
        let cause = self.safety.cause();
        self.record(ArmEvent::Safety(mode, cause));
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
            self.record_modes(&modes);
            self.powered = powered;
        }
        self.wire.queue(self.now_ns, frame);
    }

    /// Records the motor pucks whose mode differs from `before`.
    fn record_modes(&mut self, before: &[MotorMode]) {
        for (index, before) in before.iter().enumerate() {
            let mode = self.pucks[index].mode();
            if mode != *before {
                self.in_cradle &= mode != MotorMode::Torque;
                self.record(ArmEvent::Motor(index, mode));
            }
        }
    }

    /// Whether the transceiver of a waking puck is resetting, so that the host must not send.
    fn any_transceiver_resetting(&self) -> bool {
        self.pucks.iter().any(|puck| match puck.power() {
            Power::Waking(since_ns) => self.now_ns >= since_ns + self.config.transceiver_reset_ns,
            _ => false,
        })
    }

    /// Delivers a completely transmitted frame to all other nodes; returns the event for the host.
    fn deliver(&mut self, frame: CanFrame) -> Option<Event> {
        let from_host = is_from_host(&frame);
        if from_host && self.any_transceiver_resetting() {
            self.record(ArmEvent::HostSentDuringWakeUp);
            self.host_bus_off_until_ns = Some(self.now_ns + self.config.restart_ns);
            // A CAN controller that is bus-off sends no frame of its queue.
            self.wire.discard(is_from_host);
            return Some(Event::Fault(BusFault::BusOff));
        }
        if !self.after_first_torque.is_empty() && from_host && commands_torque(&frame) {
            for (after_ns, press) in core::mem::take(&mut self.after_first_torque) {
                self.press_at(self.now_ns + after_ns, press);
            }
        }
        let modes: Vec<MotorMode> = self.pucks.iter().map(Puck::mode).collect();
        for index in 0..self.pucks.len() {
            let answer = self.pucks[index].handle_frame(self.now_ns, &frame);
            if let Some(answer) = answer
                && !(is_position(&answer) && self.injector.drops_reply(index))
            {
                let ready_ns = self.ready_ns();
                self.wire.queue(ready_ns, answer);
            }
        }
        self.record_modes(&modes);
        if let Some(sensor) = &mut self.sensor {
            let readings = sensor.handle_frame(self.now_ns, &frame);
            // Both frames become ready at the same time, so that they keep their order.
            let ready_ns = self.ready_ns();
            for reading in readings.into_iter().flatten() {
                self.wire.queue(ready_ns, reading);
            }
        }
        let before = self.safety.mode();
        let safety_frame = self.safety.handle_frame(self.now_ns, &frame);
        if self.safety.mode() == before {
            if let Some(answer) = safety_frame {
                let ready_ns = self.ready_ns();
                self.wire.queue(ready_ns, answer);
            }
        } else {
            self.apply_safety_mode(safety_frame);
        }
        if self.host_bus_off_until_ns.is_some() {
            return None;
        }
        Some(if from_host {
            Event::Sent(frame)
        } else {
            Event::Frame(frame)
        })
    }

    /// Time at which a node's answer to the current frame is ready \[ns\].
    fn ready_ns(&mut self) -> u64 {
        self.now_ns + self.config.latency_ns + self.jitter_ns()
    }

    /// Random jitter \[ns\].
    fn jitter_ns(&mut self) -> u64 {
        self.random.below(self.config.jitter_ns + 1)
    }
}

/// Destination of a frame of the arm's protocol.
fn destination(frame: &CanFrame) -> Option<Destination> {
    MessageId::of(frame).map(MessageId::to)
}

/// Whether the frame is a puck's reply to a position request.
fn is_position(frame: &CanFrame) -> bool {
    destination(frame) == Some(Destination::Group(GroupId::POSITION))
}

/// Whether the frame is a packed torque frame with a nonzero torque.
fn commands_torque(frame: &CanFrame) -> bool {
    let to_motors = matches!(
        destination(frame),
        Some(Destination::Group(
            GroupId::LOWER_TORQUES | GroupId::UPPER_TORQUES
        ))
    );
    let torques = PackedTorques::parse(frame);
    to_motors && torques.is_ok_and(|torques| torques.slots.iter().any(|t| t.units() != 0))
}

/// Whether the host sent the frame. Frames that are not of the protocol are from the host, because no node sends them.
fn is_from_host(frame: &CanFrame) -> bool {
    MessageId::of(frame).is_none_or(|id| id.from() == NodeId::HOST)
}

impl<const N: usize> EmulatedNodes for Emulator<N> {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn receive_from_host(&mut self, frame: &CanFrame) {
        if self.host_bus_off_until_ns.is_none() {
            self.wire.queue(self.now_ns, *frame);
        }
    }

    fn run_until(&mut self, until_ns: u64) -> Option<Event> {
        let until_ns = until_ns.max(self.now_ns);
        loop {
            if let Some(fault) = self.pending_fault.take() {
                return Some(Event::Fault(fault));
            }
            let end_ns = self.wire.next_end_ns().unwrap_or(u64::MAX);
            let next_ns = end_ns.min(self.next_tick_ns);
            if next_ns > until_ns {
                // A frame that is ready by now starts before the next frame of the host.
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
