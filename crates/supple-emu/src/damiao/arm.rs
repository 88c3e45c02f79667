//! Emulated arm with Damiao motors: motors, plant and bus medium, in virtual time.

use super::config::DamiaoConfig;
use super::misbehaviour::{Misbehaviour, MisbehaviourKind};
use super::motor::Motor;
use crate::error::EmulatorError;
use crate::wire::Wire;
use supple_bus::virtual_time::EmulatedNodes;
use supple_bus::{BusFault, Event};
use supple_can_frame::CanFrame;
use supple_core::Vector;
use supple_damiao::{Request, Status};
use supple_plant::{
    ActuatorModel, ControllerView, HardStops, Injection, InjectionError, Injector, Plant,
    PlantConfig, Truth,
};
use supple_random::Random;

/// Event of a motor or of its bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotorEvent {
    /// The motor of this index, counted from 0, entered this status.
    Status(usize, Status),
    /// A motor executed a request that writes flash.
    Flash(usize, Request),
    /// A misbehaviour began.
    Misbehaves(Misbehaviour),
}

/// Emulated arm with Damiao motors. Each motor moves one joint directly.
pub struct DamiaoArm<const N: usize> {
    config: DamiaoConfig,
    now_ns: u64,
    next_tick_ns: u64,
    wire: Wire,
    plant: Plant<N>,
    injector: Injector<N>,
    motors: Vec<Motor>,
    /// Misbehaviours that have not begun.
    misbehaviours: Vec<Misbehaviour>,
    /// Time at which the first motor was enabled \[ns\].
    enabled_ns: Option<u64>,
    supported: bool,
    wedged: bool,
    bus_off_until_ns: Option<u64>,
    pending_fault: Option<BusFault>,
    random: Random,
    events: Vec<(u64, MotorEvent)>,
    /// Current offset of the machine's monotonic clock from the arm's time \[ns\].
    offset_ns: u64,
}

impl<const N: usize> DamiaoArm<N> {
    /// Creates an arm at standstill at `start_rad`, at time `start_ns`. A joint whose `stow_rad` lies within `soft_zone_rad` of a
    /// limit gets its mechanical stop at that angle, so that the stowed arm rests on it.
    ///
    /// # Errors
    /// If the numbers of motors and joints differ, the motors do not drive the joints directly, or the plant rejects its
    /// configuration.
    pub fn new(
        config: DamiaoConfig,
        mut plant: PlantConfig<N>,
        start_rad: Vector<N>,
        stow: Option<(Vector<N>, f64)>,
        start_ns: u64,
    ) -> Result<DamiaoArm<N>, EmulatorError> {
        if config.motors.len() != N {
            return Err(EmulatorError::Pucks {
                found: config.motors.len(),
                expected: N,
            });
        }
        if plant.actuators.joint_from_motor != supple_core::Matrix::<N, N>::identity() {
            return Err(EmulatorError::NotDirect);
        }
        if let (Some((stow_rad, zone_rad)), Some(stops)) = (stow, &mut plant.stops) {
            rest_on_stops(stops, &stow_rad, zone_rad);
        }
        let step_s = config.step_ns as f64 * 1e-9;
        // The bus already delays torques by one cycle.
        let late_s = plant.actuators.torque_delay_cycles.saturating_sub(1) as f64 * plant.cycle_s;
        plant.actuators = ActuatorModel {
            counts_per_motor_revolution: Vector::zeros(),
            motor_torque_quantum_nm: Vector::zeros(),
            torque_delay_cycles: (late_s / step_s).round() as usize,
            ..plant.actuators
        };
        plant.step_s = step_s;
        plant.cycle_s = step_s;
        plant.cycle_jitter = 0.0;
        let plant = Plant::new(plant, start_rad, Vector::zeros())?;
        let mut arm = DamiaoArm {
            injector: Injector::none(&plant),
            now_ns: start_ns,
            next_tick_ns: start_ns + config.step_ns,
            wire: Wire::new(config.rates),
            plant,
            motors: config.motors.iter().cloned().map(Motor::new).collect(),
            misbehaviours: Vec::new(),
            enabled_ns: None,
            supported: config.supported,
            wedged: false,
            bus_off_until_ns: None,
            pending_fault: None,
            random: Random::new(config.seed),
            events: Vec::new(),
            offset_ns: 0,
            config,
        };
        arm.update_motors();
        Ok(arm)
    }

    /// Adds misbehaviours; a misbehaviour without a time begins now. Call it before advancing time.
    ///
    /// # Errors
    /// If the arm does not have the motor.
    pub fn misbehave(&mut self, misbehaviours: &[Misbehaviour]) -> Result<(), EmulatorError> {
        for misbehaviour in misbehaviours {
            let other = match misbehaviour.kind {
                MisbehaviourKind::SwappedWith { other, .. } => Some(other),
                _ => None,
            };
            for motor in misbehaviour.motor.into_iter().chain(other) {
                if motor >= N {
                    return Err(EmulatorError::Motor {
                        found: motor + 1,
                        motors: N,
                    });
                }
            }
            match misbehaviour.at_s {
                Some(_) => self.misbehaviours.push(*misbehaviour),
                None => self.begin(*misbehaviour),
            }
        }
        Ok(())
    }

    /// Injects faults into the plant, replacing earlier ones; delays are counted in cycles of `period_s`.
    ///
    /// # Errors
    /// If a fault is not supported on a bus, or its joint does not exist.
    pub fn inject(
        &mut self,
        injections: &[Injection],
        period_s: f64,
    ) -> Result<(), InjectionError> {
        for injection in injections {
            injection.check_bus_support()?;
        }
        self.injector = Injector::new(injections, &mut self.plant, period_s)?;
        self.update_motors();
        Ok(())
    }

    /// Number of injected faults and misbehaviours that have begun.
    pub fn injections_begun(&self) -> usize {
        let begun = |event: &&(u64, MotorEvent)| matches!(event.1, MotorEvent::Misbehaves(_));
        self.injector.begun() + self.events.iter().filter(begun).count()
    }

    /// Motors, in the order of the joints.
    pub fn motors(&self) -> &[Motor] {
        &self.motors
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

    /// Torque of each motor at its joint, as its current control estimates it \[N m\].
    pub fn motor_torque_nm(&self) -> Vector<N> {
        Vector::from_fn(|i, _| self.motors[i].joint_torque_nm())
    }

    /// All events so far, with their times \[ns\].
    pub fn events(&self) -> &[(u64, MotorEvent)] {
        &self.events
    }

    /// Time that frames have occupied the bus \[ns\].
    pub fn bus_busy_ns(&self) -> u64 {
        self.wire.busy_ns()
    }

    /// Removes the support, if there is one.
    pub fn release(&mut self) {
        self.supported = false;
    }

    /// Sets the offset of the machine's monotonic clock from the arm's time \[ns\].
    pub fn set_offset_ns(&mut self, offset_ns: u64) {
        self.offset_ns = offset_ns;
    }

    /// Current time by the machine's monotonic clock \[ns\].
    pub fn monotonic_ns(&self) -> u64 {
        self.now_ns + self.offset_ns
    }

    /// Time of the next event that does not depend on the host \[ns\].
    pub fn next_ns(&self) -> u64 {
        let wire = self.wire.next_end_ns().unwrap_or(u64::MAX);
        wire.min(self.next_tick_ns)
    }

    /// Advances the clock by `gap_ns` without motion; frames that wait for the bus are lost.
    pub fn shift_clock(&mut self, gap_ns: u64) {
        self.wire.pause(gap_ns);
        self.next_tick_ns += gap_ns;
        self.now_ns += gap_ns;
    }

    fn record(&mut self, event: MotorEvent) {
        self.events.push((self.now_ns, event));
    }

    fn begin(&mut self, misbehaviour: Misbehaviour) {
        self.record(MotorEvent::Misbehaves(misbehaviour));
        match (misbehaviour.kind, misbehaviour.motor) {
            (MisbehaviourKind::BusOff, _) => {
                self.bus_off_until_ns = Some(self.now_ns + self.config.restart_ns);
                self.pending_fault = Some(BusFault::BusOff);
                self.wire.discard(|_| true);
            }
            (MisbehaviourKind::Wedged, _) => self.wedged = true,
            (MisbehaviourKind::SwappedWith { other, same }, Some(motor)) => {
                let (own, others) = (self.motors[motor].ids(), self.motors[other].ids());
                self.motors[motor].set_ids(others);
                if !same {
                    self.motors[other].set_ids(own);
                }
            }
            (kind, Some(motor)) => self.motors[motor].misbehave(kind),
            (_, None) => {}
        }
    }

    /// Updates the motors from the motion of the joints.
    fn update_motors(&mut self) {
        let position_rad = *self.injector.position_rad();
        let velocity = self.plant.truth().motor_velocity_rad_per_s;
        let step_s = self.config.step_ns as f64 * 1e-9;
        for (i, motor) in self.motors.iter_mut().enumerate() {
            motor.tick(self.now_ns, position_rad[i], velocity[i], step_s);
        }
    }

    fn tick(&mut self) {
        let before: Vec<Status> = self.motors.iter().map(Motor::status).collect();
        if !self.supported {
            let torque_nm = self.motor_torque_nm();
            let shorted = core::array::from_fn(|i| self.motors[i].brakes());
            let active = before.iter().all(|status| *status == Status::Enabled);
            let view = ControllerView { active, mode: None };
            self.injector
                .cycle(&mut self.plant, view, &torque_nm, shorted);
        }
        self.update_motors();
        if let Some(enabled_ns) = self.enabled_ns {
            let elapsed_s = (self.now_ns - enabled_ns) as f64 * 1e-9;
            let (due, later): (Vec<_>, Vec<_>) = self
                .misbehaviours
                .iter()
                .partition(|m| m.at_s.is_some_and(|at_s| at_s <= elapsed_s));
            self.misbehaviours = later;
            due.into_iter().for_each(|m| self.begin(m));
        }
        self.record_states(&before);
        if self
            .bus_off_until_ns
            .is_some_and(|until| self.now_ns >= until)
        {
            self.bus_off_until_ns = None;
            self.pending_fault = Some(BusFault::Restarted);
        }
        self.next_tick_ns += self.config.step_ns;
    }

    /// Records the motors whose status differs from `before`; once all motors are enabled, removes the support.
    fn record_states(&mut self, before: &[Status]) {
        for (motor, before) in before.iter().enumerate() {
            let status = self.motors[motor].status();
            if status == *before {
                continue;
            }
            self.record(MotorEvent::Status(motor, status));
            if status == Status::Enabled && self.enabled_ns.is_none() {
                self.enabled_ns = Some(self.now_ns);
            }
        }
        let enabled = |motor: &Motor| motor.status() == Status::Enabled;
        if self.motors.iter().all(enabled) {
            self.supported = false;
        }
    }

    /// Delivers a complete frame to all nodes; returns the event for the host.
    fn deliver(&mut self, frame: CanFrame, from_host: bool) -> Event {
        if !from_host {
            return Event::Frame(frame);
        }
        let before: Vec<Status> = self.motors.iter().map(Motor::status).collect();
        for index in 0..self.motors.len() {
            let motor = &mut self.motors[index];
            let reaction = motor.handle_frame(self.now_ns, &frame, self.config.allow_flash);
            if let Some(request) = reaction.flash {
                assert!(
                    self.config.allow_flash,
                    "the host requests motor {} to write its flash: {request:?} in {frame:?}",
                    index + 1
                );
                self.record(MotorEvent::Flash(index, request));
            }
            if let Some(reply) = reaction.reply {
                let late_ns = self.motors[index].late_ns();
                let jitter_ns = self.random.below(self.config.jitter_ns + 1);
                let ready_ns = self.now_ns + self.config.latency_ns + jitter_ns + late_ns;
                self.wire.queue(ready_ns, reply);
            }
        }
        self.record_states(&before);
        Event::Sent(frame)
    }

    /// Whether the host sent a frame: no motor replies with the id of a command.
    fn is_from_host(&self, frame: &CanFrame) -> bool {
        let id = frame.id().raw();
        !self.motors.iter().any(|motor| motor.ids()[1] == id)
    }
}

/// Moves the mechanical stops of the joints so that the stowed arm rests on them.
fn rest_on_stops<const N: usize>(stops: &mut HardStops<N>, stow_rad: &Vector<N>, zone_rad: f64) {
    for i in 0..N {
        let rests = |stop_rad: f64| (stow_rad[i] - stop_rad).abs() <= zone_rad * (1.0 + 1e-9);
        if rests(stops.lower_rad[i]) {
            stops.lower_rad[i] = stow_rad[i];
        } else if rests(stops.upper_rad[i]) {
            stops.upper_rad[i] = stow_rad[i];
        }
    }
}

impl<const N: usize> EmulatedNodes for DamiaoArm<N> {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn receive_from_host(&mut self, frame: &CanFrame) {
        if self.bus_off_until_ns.is_none() && !self.wedged {
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
            } else if let Some((frame, _)) = self.wire.advance(next_ns) {
                let from_host = self.is_from_host(&frame);
                let event = self.deliver(frame, from_host);
                if self.bus_off_until_ns.is_none() {
                    return Some(event);
                }
            }
        }
    }
}
