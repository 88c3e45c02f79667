//! The simulated arm as drives: no bus, no operator, and a clock of its own.
//!
//! ```text
//! idle  --torque is wanted, in gravity hold-->  active  --the plant loop lowers them-->  idle
//! ```
//!
//! No operator is needed: the drives become active as soon as a controller in gravity hold requests torque; after a
//! loss only once a controller has requested none. In idle the motors are shorted and brake
//! ([`supple_plant::ActuatorModel`]).
//!
//! In real time a period starts at its scheduled time, whatever the controller does; when the host stalls while this
//! program waits for it, simulated time pauses, and when the period begins late, the arm moves in the periods that are
//! skipped. In virtual time it is as fast as both processes allow.

use supple_can_frame::BitRates;
use supple_core::Vector;
use supple_core::controller::Mode;
use supple_drive::{
    Budget, Command, Drive, DriveCounters, DriveState, Drives, LoopError, LossReason, LoweringMode,
    Reading, ReservedTimes, TipForce, TorqueOffBehaviour,
};
use supple_plant::{
    ControllerView, Injection, InjectionError, Injector, Plant, Sample, TraceError, TraceFile,
};
use supple_realtime::{monotonic_ns, sleep_until_ns};

/// Maximum lead with which the thread wakes before its period \[ns\]; most wake-ups take less.
const WAKE_AHEAD_NS: u64 = 50_000;
/// Lateness above which a period counts as a host stall and pauses simulated time \[ns\], so that a stall is not
/// charged to the controller. As on the emulated bus.
const STALL_THRESHOLD_NS: u64 = 100_000;

/// Maximum number of skipped periods in which the arm moves.
const MAX_SKIPPED: u64 = 100;

/// Clock of the simulated arm.
#[derive(Clone, Copy, Debug)]
enum Clock {
    /// Virtual time \[ns\].
    Virtual(u64),
    /// The monotonic clock without the pauses, whose sum this is \[ns\].
    Paused(u64),
}

/// The simulated arm.
pub struct SimulatedArm<const N: usize> {
    plant: Plant<N>,
    injector: Injector<N>,
    clock: Clock,
    period_ns: u64,
    /// Time for which a controller's answer is not awaited \[ns\].
    rest_ns: u64,
    /// Start of this period \[ns\].
    start_ns: u64,
    /// Encoder readings of this cycle \[rad\]; `None` where a reply was lost.
    replies: [Option<f64>; N],
    torque_nm: Vector<N>,
    active: bool,
    /// Idle after a loss; latched until the controller requests no torque.
    latched_idle: bool,
    /// Mode of the controller, and the codes of its last answer.
    mode: Option<Mode>,
    codes: Option<[u8; 2]>,
    replies_lost: u64,
    trace: Option<TraceFile>,
}

impl<const N: usize> SimulatedArm<N> {
    /// An idle arm; in real time an answer is awaited for the fraction `answer_share` of a period.
    pub fn new(plant: Plant<N>, virtual_time: bool, answer_share: f64) -> SimulatedArm<N> {
        let period_ns = (plant.config().cycle_s * 1e9).round() as u64;
        let (clock, start_ns) = match virtual_time {
            true => (Clock::Virtual(0), 0),
            false => (Clock::Paused(0), monotonic_ns()),
        };
        SimulatedArm {
            injector: Injector::none(&plant),
            plant,
            clock,
            period_ns,
            rest_ns: period_ns - (answer_share * period_ns as f64) as u64,
            start_ns,
            replies: [None; N],
            torque_nm: Vector::zeros(),
            active: false,
            latched_idle: false,
            mode: None,
            codes: None,
            replies_lost: 0,
            trace: None,
        }
    }

    /// Period \[ns\].
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// The plant.
    pub fn plant(&self) -> &Plant<N> {
        &self.plant
    }

    /// Joint torques that the motors received in the last period \[N m\]; zero in idle.
    pub fn applied_nm(&self) -> Vector<N> {
        if self.active {
            self.torque_nm
        } else {
            Vector::zeros()
        }
    }

    /// Injects faults. Call it before the first cycle.
    ///
    /// # Errors
    /// A joint or motor that the arm does not have.
    pub fn inject(&mut self, injections: &[Injection]) -> Result<(), InjectionError> {
        let period_s = self.plant.config().cycle_s;
        self.injector = Injector::new(injections, &mut self.plant, period_s)?;
        Ok(())
    }

    /// Starts writing a trace of the joint torques.
    pub fn trace(&mut self, trace: TraceFile) {
        self.trace = Some(trace);
    }

    /// Finishes the trace.
    ///
    /// # Errors
    /// If writing failed during the run.
    pub fn end_trace(&mut self) -> Result<(), TraceError> {
        match self.trace.take() {
            Some(trace) => trace.finish(),
            None => Ok(()),
        }
    }

    /// Moves the arm by one period.
    fn advance(&mut self) {
        let active = self.active;
        let torque_nm = self.applied_nm();
        let view = ControllerView {
            active,
            mode: self.mode,
        };
        self.injector
            .cycle(&mut self.plant, view, &torque_nm, [!active; N]);
        if self.injector.drives_idle() {
            self.active = false;
        }
        if let Some(trace) = &mut self.trace {
            let sample = Sample {
                time_ns: match self.clock {
                    Clock::Virtual(_) => self.start_ns,
                    Clock::Paused(paused_ns) => self.start_ns + paused_ns,
                },
                active: if self.active { N } else { 0 },
                torque_nm: self.plant.truth().motor_torque_nm.into(),
                mode: self.codes.map(|[mode, _]| mode),
                fault: self.codes.map(|[_, fault]| fault),
                injections: self.injector.begun(),
            };
            trace.write_sample(&sample, &mut self.plant);
        }
    }

    /// Waits until shortly before the next period, so that a late wake-up seldom delays it. A stall pauses the clock.
    fn wait_for(&mut self, next_period_ns: u64) {
        match &mut self.clock {
            Clock::Virtual(now_ns) => *now_ns = next_period_ns.max(*now_ns),
            Clock::Paused(paused_ns) => {
                let due_ns = next_period_ns + *paused_ns;
                let ahead_ns = WAKE_AHEAD_NS.min(self.period_ns / 10);
                sleep_until_ns(due_ns.saturating_sub(ahead_ns));
                let late_ns = monotonic_ns().saturating_sub(due_ns);
                *paused_ns += late_ns.saturating_sub(STALL_THRESHOLD_NS.min(self.period_ns / 4));
            }
        }
        self.start_ns = next_period_ns;
    }
}

impl<const N: usize> Drive<N> for SimulatedArm<N> {
    fn now_ns(&self) -> u64 {
        match self.clock {
            Clock::Virtual(now_ns) => now_ns,
            Clock::Paused(paused_ns) => monotonic_ns() - paused_ns,
        }
    }

    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        time_ns + self.clock_stall_ns()
    }

    fn clock_stall_ns(&self) -> u64 {
        match self.clock {
            Clock::Virtual(_) => 0,
            Clock::Paused(paused_ns) => paused_ns,
        }
    }

    fn torque_off_behaviour(&self) -> TorqueOffBehaviour {
        TorqueOffBehaviour::Brakes
    }

    fn reserved(&self) -> ReservedTimes {
        ReservedTimes {
            states_ns: 0,
            torques_ns: self.rest_ns,
        }
    }

    /// There is no bus.
    fn budget(&self) -> Budget {
        Budget::new(BitRates::CLASSIC_1M, N)
    }

    fn request(&mut self) -> Result<(), LoopError> {
        Ok(())
    }

    fn collect(&mut self, _: u64) -> Result<u8, LoopError> {
        while self.now_ns() < self.start_ns {
            core::hint::spin_loop();
        }
        self.replies = self.injector.replies();
        let mut missing = 0;
        for (joint, reply) in self.replies.iter().enumerate() {
            missing |= u8::from(reply.is_none()) << joint;
        }
        self.replies_lost += u64::from(missing.count_ones());
        Ok(missing)
    }

    fn reading(&self) -> Reading<N> {
        Reading {
            position_rad: self.replies,
            tip_force: Some(TipForce::Base(self.plant.measurement().force_n)),
        }
    }

    fn state(&self) -> DriveState {
        DriveState {
            drives: if self.active {
                Drives::Active
            } else {
                Drives::Idle
            },
            unsent: false,
            bus_off: false,
            loss: None,
        }
    }

    fn operate(&mut self, command: Option<&Command<N>>, allowed: bool) -> bool {
        self.mode = command.and_then(|command| command.mode);
        self.codes = command.map(|command| command.codes);
        let Some(command) = command else {
            return false;
        };
        self.latched_idle &= command.wants_torque;
        let holding = command.mode == Some(Mode::GravityHold);
        let may = allowed && holding && command.wants_torque && !self.latched_idle;
        if self.active || !may {
            return false;
        }
        self.active = true;
        true
    }

    /// Its motors have no damping of their own.
    fn send_torques(&mut self, torque_nm: &Vector<N>, _: &Vector<N>) -> Result<(), LoopError> {
        self.torque_nm = *torque_nm;
        Ok(())
    }

    fn lower(&mut self, _: LoweringMode, reason: LossReason) -> Result<(), LoopError> {
        self.latched_idle |= self.active && reason != LossReason::TorqueNotWanted;
        self.active = false;
        Ok(())
    }

    fn drain(&mut self, next_period_ns: u64) -> Result<(), LoopError> {
        self.advance();
        self.wait_for(next_period_ns);
        Ok(())
    }

    /// The motors keep the last torque. After more periods than this the controller latches a fault, and the arm stands
    /// still in them.
    fn skip(&mut self, periods: u64, next_period_ns: u64) -> Result<(), LoopError> {
        self.start_ns = next_period_ns.saturating_sub(periods * self.period_ns);
        for _ in 0..periods.min(MAX_SKIPPED) {
            self.advance();
            self.start_ns += self.period_ns;
        }
        self.wait_for(next_period_ns);
        Ok(())
    }

    fn motors_replied(&self) -> bool {
        self.replies.iter().any(Option::is_some)
    }

    fn counters(&self) -> DriveCounters {
        DriveCounters {
            replies_lost: self.replies_lost,
            ..DriveCounters::default()
        }
    }
}
