//! The cycle: measure, publish, wait for the answer, move.

use crate::error::SimError;
use crate::motors::Motors;
use core::fmt;
use core::time::Duration;
use supple_ipc::message::{ArmState, Drives, PlantReport, TorqueCommand};
use supple_ipc::{Heard, PlantLink, pause};
use supple_plant::{Injection, Injector, Plant, Sample, Sight, TraceFile};
use supple_realtime::{Stop, monotonic_ns, sleep_until_ns};

/// How long before its cycle a thread is woken at most \[ns\]: longer than most wake-ups take.
const AHEAD_NS: u64 = 50_000;
/// How long one wait of virtual time lasts before it looks whether to stop.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// How often virtual time looks whether a controller has come.
const JOIN_EVERY: Duration = Duration::from_millis(1);
/// How long the motors may take to come to rest at the end \[ns\].
const REST_NS: u64 = 300_000_000;
/// By how much a cycle may begin late before the arm's time has stood still instead \[ns\]: a simulated arm that
/// its machine holds up is no slow controller. As on the emulated bus.
const FORGIVEN_NS: u64 = 100_000;

/// A plant with its motors, at the plant's end of shared memory.
pub struct World<const N: usize> {
    plant: Plant<N>,
    injector: Injector<N>,
    /// What the encoders said in this cycle \[rad\].
    replies: [Option<f64>; N],
    motors: Motors<N>,
    link: PlantLink,
    report: PlantReport,
    period_ns: u64,
    trace: Option<TraceFile>,
}

/// How a simulation went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Cycles.
    pub cycles: u64,
    /// Cycles with active motors whose answer did not come in time.
    pub missed: u64,
    /// Answers that came after their cycle.
    pub late: u64,
    /// How long the arm's time stood still because the machine held it up \[ns\].
    pub stood_still_ns: u64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} cycles, {} missed, {} late, stood still for {:.1} ms",
            self.cycles,
            self.missed,
            self.late,
            self.stood_still_ns as f64 * 1e-6
        )
    }
}

impl<const N: usize> World<N> {
    /// Before its first cycle.
    pub fn new(plant: Plant<N>, motors: Motors<N>, link: PlantLink) -> Self {
        World {
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

    /// Puts faults into the arm; to be called before the first cycle.
    ///
    /// # Errors
    /// [`SimError::Injection`]: a joint or motor that the arm has not.
    pub fn inject(&mut self, injections: &[Injection]) -> Result<(), SimError> {
        let period_s = self.plant.config().cycle_s;
        self.injector = Injector::new(injections, &mut self.plant, period_s)?;
        Ok(())
    }

    /// Looks for an answer for so long before sleeping, see [`PlantLink::spin`].
    pub fn spin(&mut self, at_most: Duration) {
        self.link.spin(at_most);
    }

    /// From now on what acts at the joints is written.
    pub fn trace(&mut self, trace: TraceFile) {
        self.trace = Some(trace);
    }

    /// The end of what is written.
    ///
    /// # Errors
    /// [`SimError::Trace`] where it ended before the run.
    pub fn end_trace(&mut self) -> Result<(), SimError> {
        match self.trace.take() {
            Some(trace) => Ok(trace.finish()?),
            None => Ok(()),
        }
    }

    /// Runs by the wall clock. An answer is waited for until `answer_share` of its cycle has passed.
    ///
    /// # Errors
    /// [`SimError::Ipc`], [`SimError::Message`].
    pub fn run_by_the_clock(
        &mut self,
        cycles: Option<u64>,
        answer_share: f64,
        stop: &Stop,
    ) -> Result<Summary, SimError> {
        let mut summary = Summary::default();
        let wait_ns = (answer_share * self.period_ns as f64) as u64;
        let mut due_ns = monotonic_ns() + self.period_ns;
        let mut rest_cycles = REST_NS / self.period_ns;
        while cycles.is_none_or(|cycles| summary.cycles < cycles) {
            if stop.asked() {
                // An arm does not go away from under those who are lowering it.
                if self.motors.drives() != Drives::Active || rest_cycles == 0 {
                    break;
                }
                rest_cycles -= 1;
            }
            let begin_ns = self.wait_until(due_ns)?;
            self.report.wake_ns = begin_ns.saturating_sub(due_ns);
            if self.report.wake_ns > FORGIVEN_NS {
                self.report.stood_still_ns += self.report.wake_ns;
                due_ns = begin_ns;
            }
            let state = self.state(begin_ns);
            self.link.publish(&state)?;
            let left = || Duration::from_nanos((due_ns + wait_ns).saturating_sub(monotonic_ns()));
            let heard = self.link.answer_within(self.cycle(), left)?;
            let heard = self.usable(heard);
            self.note(&heard, begin_ns);
            self.advance(&heard, begin_ns)?;
            summary.cycles += 1;
            due_ns += self.period_ns;
        }
        Ok(self.summed_up(summary))
    }

    /// Runs in lockstep with the controller: no cycle goes on without its answer.
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
                if stop.asked() {
                    return Ok(self.summed_up(summary));
                }
                pause(JOIN_EVERY);
            }
            let mut heard = self.link.answer(self.cycle(), LOOK_EVERY)?;
            while heard.answer.is_none() {
                if stop.asked() {
                    return Ok(self.summed_up(summary));
                }
                heard = self.link.answer(self.cycle(), LOOK_EVERY)?;
            }
            let heard = self.usable(heard);
            self.note(&heard, begin_ns);
            self.advance(&heard, state.stamp_ns)?;
            summary.cycles += 1;
        }
        Ok(self.summed_up(summary))
    }

    /// Sleeps until shortly before a cycle, announces it, and watches the clock: so a thread that is woken late is
    /// seldom late. Gives the time.
    fn wait_until(&self, due_ns: u64) -> Result<u64, SimError> {
        let ahead_ns = AHEAD_NS.min(self.period_ns / 10);
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

    /// The state of a cycle; to be made once for each, as the replies of encoders are counted.
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

    /// A command that is not for this arm, or not finite, is no answer: it is counted, and the fallback acts.
    fn usable(&mut self, mut heard: Heard) -> Heard {
        if heard
            .answer
            .is_some_and(|command| !command.is_usable::<N>())
        {
            heard.answer = None;
            self.report.unusable += 1;
        }
        self.report.foreign = self.link.foreign();
        heard
    }

    fn note(&mut self, heard: &Heard, begin_ns: u64) {
        self.report.late += heard.late;
        self.report.round_trip_ns = match heard.answer {
            Some(_) => monotonic_ns() - begin_ns,
            None => 0,
        };
        if heard.answer.is_none() && self.motors.drives() == Drives::Active {
            self.report.missed += 1;
        }
    }

    fn advance(&mut self, heard: &Heard, time_ns: u64) -> Result<(), SimError> {
        let torque_nm = self.motors.torque(&self.replies, heard.answer.as_ref())?;
        let active = self.motors.drives() == Drives::Active;
        let sight = Sight {
            active,
            mode: heard.answer.as_ref().and_then(TorqueCommand::mode),
        };
        self.injector
            .cycle(&mut self.plant, sight, &torque_nm, [!active; N]);
        if self.injector.drives_idle() {
            self.motors.lower();
        }
        if let Some(trace) = &mut self.trace {
            let active = self.motors.drives() == Drives::Active;
            let sample = Sample {
                time_ns,
                active: if active { N } else { 0 },
                torque_nm: self.plant.truth().motor_torque_nm.into(),
                mode: heard.answer.map(|answer| answer.mode),
                fault: heard.answer.map(|answer| answer.fault),
                injections: self.injector.begun(),
            };
            trace.note(&sample, &mut self.plant);
        }
        Ok(())
    }

    fn summed_up(&self, summary: Summary) -> Summary {
        Summary {
            missed: self.report.missed,
            late: self.report.late,
            stood_still_ns: self.report.stood_still_ns,
            ..summary
        }
    }
}
