//! The cycle: measure, publish, wait for the answer, move.

use crate::error::SimError;
use crate::motors::Motors;
use core::fmt;
use core::time::Duration;
use supple_ipc::message::{ArmState, Drives, PlantReport, TorqueCommand};
use supple_ipc::{PlantLink, ReceivedAnswer};
use supple_plant::{ControllerView, Injection, Injector, Plant, Sample, TraceFile};
use supple_realtime::{Stop, monotonic_ns, pause, sleep_until_ns};

/// Maximum lead with which the thread wakes before its cycle \[ns\]; most wake-ups take less.
const WAKE_AHEAD_NS: u64 = 50_000;
/// Interval at which a wait in virtual time checks for a shutdown request.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Poll interval for a controller to join, in virtual time.
const JOIN_POLL_INTERVAL: Duration = Duration::from_millis(1);
/// Maximum time for the drives to become idle at shutdown \[ns\].
const SHUTDOWN_TIMEOUT_NS: u64 = 300_000_000;
/// Lateness above which a cycle counts as a host stall and pauses simulated time \[ns\], so that a stall is not charged
/// to the controller. As on the emulated bus.
const STALL_THRESHOLD_NS: u64 = 100_000;

/// The simulation loop: plant, drives and the plant's link to the controller.
pub struct SimulationLoop<const N: usize> {
    plant: Plant<N>,
    injector: Injector<N>,
    /// Encoder readings of this cycle \[rad\]; `None` where a reply was lost.
    replies: [Option<f64>; N],
    motors: Motors<N>,
    link: PlantLink,
    report: PlantReport,
    period_ns: u64,
    trace: Option<TraceFile>,
}

/// Summary of a simulation run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Number of cycles.
    pub cycles: u64,
    /// Cycles with active drives whose answer did not arrive in time.
    pub missed: u64,
    /// Answers that arrived after their cycle.
    pub late: u64,
    /// Total time for which simulated time was paused because the host stalled \[ns\].
    pub clock_stall_ns: u64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} cycles, {} missed, {} late, clock paused for {:.1} ms",
            self.cycles,
            self.missed,
            self.late,
            self.clock_stall_ns as f64 * 1e-6
        )
    }
}

impl<const N: usize> SimulationLoop<N> {
    /// Creates the loop before its first cycle.
    pub fn new(plant: Plant<N>, motors: Motors<N>, link: PlantLink) -> Self {
        SimulationLoop {
            period_ns: (plant.config().cycle_s * 1e9).round() as u64,
            injector: Injector::none(&plant),
            replies: [None; N],
            plant,
            motors,
            link,
            report: PlantReport::default(),
            trace: None,
        }
    }

    /// Injects faults. Call it before the first cycle.
    ///
    /// # Errors
    /// [`SimError::Injection`]: a joint or motor that the arm does not have.
    pub fn inject(&mut self, injections: &[Injection]) -> Result<(), SimError> {
        let period_s = self.plant.config().cycle_s;
        self.injector = Injector::new(injections, &mut self.plant, period_s)?;
        Ok(())
    }

    /// Sets how long to poll for an answer before blocking, see [`PlantLink::spin`].
    pub fn spin(&mut self, at_most: Duration) {
        self.link.spin(at_most);
    }

    /// Starts writing a trace of the joint torques.
    pub fn trace(&mut self, trace: TraceFile) {
        self.trace = Some(trace);
    }

    /// Finishes the trace.
    ///
    /// # Errors
    /// [`SimError::Trace`] if writing failed during the run.
    pub fn end_trace(&mut self) -> Result<(), SimError> {
        match self.trace.take() {
            Some(trace) => Ok(trace.finish()?),
            None => Ok(()),
        }
    }

    /// Runs in real time. Waits for an answer until the fraction `answer_share` of its cycle has passed.
    ///
    /// # Errors
    /// [`SimError::Ipc`], [`SimError::Message`].
    pub fn run_in_real_time(
        &mut self,
        cycles: Option<u64>,
        answer_share: f64,
        stop: &Stop,
    ) -> Result<Summary, SimError> {
        let mut summary = Summary::default();
        let wait_ns = (answer_share * self.period_ns as f64) as u64;
        let mut due_ns = monotonic_ns() + self.period_ns;
        let mut rest_cycles = SHUTDOWN_TIMEOUT_NS / self.period_ns;
        while cycles.is_none_or(|cycles| summary.cycles < cycles) {
            if stop.shutdown_requested() {
                // Keep running until the drives are idle, so that the controller can complete its shutdown.
                if self.motors.drives() != Drives::Active || rest_cycles == 0 {
                    break;
                }
                rest_cycles -= 1;
            }
            let begin_ns = self.wait_until(due_ns)?;
            self.report.wake_ns = begin_ns.saturating_sub(due_ns);
            if self.report.wake_ns > STALL_THRESHOLD_NS {
                self.report.clock_stall_ns += self.report.wake_ns;
                due_ns = begin_ns;
            }
            let state = self.state(begin_ns);
            self.link.publish(&state)?;
            let left = || Duration::from_nanos((due_ns + wait_ns).saturating_sub(monotonic_ns()));
            let received = self.link.answer_within(self.cycle(), left)?;
            let received = self.discard_invalid(received);
            self.update_counters(&received, begin_ns);
            self.advance(&received, begin_ns)?;
            summary.cycles += 1;
            due_ns += self.period_ns;
        }
        Ok(self.with_counters(summary))
    }

    /// Runs in lockstep with the controller: each cycle waits for its answer.
    ///
    /// # Errors
    /// [`SimError::Ipc`], [`SimError::Message`].
    pub fn run_in_virtual_time(
        &mut self,
        cycles: Option<u64>,
        stop: &Stop,
    ) -> Result<Summary, SimError> {
        let mut summary = Summary::default();
        while cycles.is_none_or(|cycles| summary.cycles < cycles) {
            let begin_ns = monotonic_ns();
            let state = self.state(self.cycle() * self.period_ns);
            while !self.link.publish(&state)? {
                if stop.shutdown_requested() {
                    return Ok(self.with_counters(summary));
                }
                pause(JOIN_POLL_INTERVAL);
            }
            let mut received = self.link.answer(self.cycle(), POLL_INTERVAL)?;
            while received.answer.is_none() {
                if stop.shutdown_requested() {
                    return Ok(self.with_counters(summary));
                }
                received = self.link.answer(self.cycle(), POLL_INTERVAL)?;
            }
            let received = self.discard_invalid(received);
            self.update_counters(&received, begin_ns);
            self.advance(&received, state.stamp_ns)?;
            summary.cycles += 1;
        }
        Ok(self.with_counters(summary))
    }

    /// Sleeps until shortly before the cycle, announces it, and spins for the rest, so that a late wake-up seldom
    /// delays the cycle. Returns the current time.
    fn wait_until(&self, due_ns: u64) -> Result<u64, SimError> {
        let ahead_ns = WAKE_AHEAD_NS.min(self.period_ns / 10);
        sleep_until_ns(due_ns.saturating_sub(ahead_ns));
        if monotonic_ns() + ahead_ns / 3 < due_ns {
            self.link.announce()?;
        }
        loop {
            match monotonic_ns() {
                now_ns if now_ns < due_ns => core::hint::spin_loop(),
                now_ns => return Ok(now_ns),
            }
        }
    }

    fn cycle(&self) -> u64 {
        self.plant.measurement().cycle
    }

    /// Builds the arm state of a cycle. Call it once per cycle: the fault injector counts the encoder replies.
    fn state(&mut self, stamp_ns: u64) -> ArmState {
        self.replies = self.injector.replies();
        let measured = self.plant.measurement();
        ArmState::new::<N>(
            measured.cycle,
            stamp_ns,
            &self.replies,
            Some(measured.force_n),
            self.motors.drives(),
            self.report,
        )
    }

    /// Discards and counts a command that is not for this arm or not finite; the fallback torque acts then.
    fn discard_invalid(&mut self, mut received: ReceivedAnswer) -> ReceivedAnswer {
        if received
            .answer
            .is_some_and(|command| !command.is_usable::<N>())
        {
            received.answer = None;
            self.report.unusable += 1;
        }
        self.report.foreign = self.link.foreign();
        received
    }

    fn update_counters(&mut self, received: &ReceivedAnswer, begin_ns: u64) {
        self.report.late += received.late;
        self.report.round_trip_ns = match received.answer {
            Some(_) => monotonic_ns() - begin_ns,
            None => 0,
        };
        if received.answer.is_none() && self.motors.drives() == Drives::Active {
            self.report.missed += 1;
        }
    }

    fn advance(&mut self, received: &ReceivedAnswer, time_ns: u64) -> Result<(), SimError> {
        let torque_nm = self
            .motors
            .torque(&self.replies, received.answer.as_ref())?;
        let active = self.motors.drives() == Drives::Active;
        let view = ControllerView {
            active,
            mode: received.answer.as_ref().and_then(TorqueCommand::mode),
        };
        self.injector
            .cycle(&mut self.plant, view, &torque_nm, [!active; N]);
        if self.injector.drives_idle() {
            self.motors.switch_to_idle();
        }
        if let Some(trace) = &mut self.trace {
            let active = self.motors.drives() == Drives::Active;
            let sample = Sample {
                time_ns,
                active: if active { N } else { 0 },
                torque_nm: self.plant.truth().motor_torque_nm.into(),
                mode: received.answer.map(|answer| answer.mode),
                fault: received.answer.map(|answer| answer.fault),
                injections: self.injector.begun(),
            };
            trace.write_sample(&sample, &mut self.plant);
        }
        Ok(())
    }

    fn with_counters(&self, summary: Summary) -> Summary {
        Summary {
            missed: self.report.missed,
            late: self.report.late,
            clock_stall_ns: self.report.clock_stall_ns,
            ..summary
        }
    }
}
