//! The loop: a state, a step, an answer.
//!
//! Nothing else is done before the answer, and nothing after it: when the plant announces its next state, the loop
//! hands over what there is to tell of the last one, and rehearses the step.
//!
//! A loop that lags takes the states that came meanwhile one by one, so that velocities stay right, and
//! answers the newest. A plant that falls silent is stepped over with its last state, until the controller
//! finds it stale. On the way out the loop goes to gravity hold and asks the plant to lower the drives to
//! idle, in which the motors brake; it ends when they are there.

use crate::error::RtError;
use crate::queue::Queue;
use crate::rings::Inside;
use crate::timing::Timing;
use core::hint::black_box;
use core::time::Duration;
use supple_core::controller::{Controller, Mode, Request, State, step};
use supple_core::{Input, Output};
use supple_ipc::message::{
    ArmState, CycleTiming, Drives, OperatorReply, OperatorRequest, Outcome, Telemetry, Text,
    TorqueCommand,
};
use supple_ipc::{ControllerLink, Woken};
use supple_realtime::{Stop, monotonic_ns};

/// Silence of the plant after which its last state counts as seen again.
pub const PLANT_LOST_AFTER: Duration = Duration::from_millis(20);
/// Cycles that the plant has to lower the drives when the controller leaves.
const LEAVING_CYCLES: u32 = 250;
/// Cycles of them that a wait in vain counts for.
const SILENT_CYCLES: u32 = 20;

/// The controller with everything that its loop needs.
#[derive(Debug)]
pub struct ControlLoop<const N: usize> {
    controller: Controller<N>,
    state: State<N>,
    inside: Inside,
    queue: Queue,
    timing: Timing,
    virtual_time: bool,
    steps: u64,
    last_begin_ns: Option<u64>,
    last: Option<Stepped<N>>,
    /// Nobody was told of the last step yet.
    untold: bool,
    /// Cycles since the loop began to leave.
    leaving: Option<u32>,
}

/// A step with all that is told about it.
#[derive(Debug)]
struct Stepped<const N: usize> {
    arm: ArmState,
    input: Input<N>,
    output: Output<N>,
    timing: CycleTiming,
}

impl<const N: usize> ControlLoop<N> {
    /// Idle, before the first state.
    pub fn new(controller: Controller<N>, inside: Inside, virtual_time: bool) -> Self {
        ControlLoop {
            state: State::new(&controller),
            controller,
            inside,
            queue: Queue::default(),
            timing: Timing::new(),
            virtual_time,
            steps: 0,
            last_begin_ns: None,
            last: None,
            untold: false,
            leaving: None,
        }
    }

    /// Answers states until it is asked to stop and the drives are idle, or nobody is there to lower them.
    ///
    /// # Errors
    /// [`RtError`]: shared memory, or a state of another arm.
    pub fn run(&mut self, link: &ControllerLink, stop: &Stop) -> Result<(), RtError> {
        let ended = loop {
            match self.turn(link, stop) {
                Ok(true) => {}
                ended => break ended.map(|_| ()),
            }
        };
        // Whatever ended it, nothing is announced any more.
        self.tell_last();
        ended
    }

    /// One turn of the loop: what came is answered, or nothing came. False when the loop is to end.
    ///
    /// # Errors
    /// As [`ControlLoop::run`].
    pub fn turn(&mut self, link: &ControllerLink, stop: &Stop) -> Result<bool, RtError> {
        self.inside.pulse.beat();
        if stop.asked() {
            self.leaving.get_or_insert(0);
        }
        let mut arm = match link.wake(PLANT_LOST_AFTER)? {
            Woken::State(arm) => arm,
            Woken::Announced => {
                self.tell_last();
                self.rehearse()?;
                return Ok(true);
            }
            Woken::Silence => return self.silence(),
        };
        while let Some(newer) = link.receive()? {
            self.cycle(&arm)?;
            arm = newer;
        }
        let leaving = self.leaving.is_some();
        let output = &self.step(&arm)?.output;
        let limp = output.limp;
        // The plant waits for this; whoever else wants to know hears of it when it announces the next state.
        link.answer(&TorqueCommand::new(output, leaving))?;
        if self.virtual_time {
            self.tell_last();
        }
        let Some(cycles) = &mut self.leaving else {
            return Ok(true);
        };
        *cycles += 1;
        let lowered = arm.drives() != Drives::Active || limp;
        Ok(!lowered && *cycles < LEAVING_CYCLES)
    }

    /// How the loop kept its time.
    pub fn into_timing(self) -> Timing {
        self.timing
    }

    /// A wait in vain.
    fn silence(&mut self) -> Result<bool, RtError> {
        if let Some(cycles) = &mut self.leaving {
            *cycles += SILENT_CYCLES;
            return Ok(*cycles < LEAVING_CYCLES);
        }
        if let (Some(last), false) = (&self.last, self.virtual_time) {
            let arm = last.arm;
            self.cycle(&arm)?;
        }
        Ok(true)
    }

    /// Does what the next cycle will do, and forgets it: code and data that a whole period has driven out of the
    /// processor's caches take longer than the step itself.
    fn rehearse(&mut self) -> Result<(), RtError> {
        if let Some(last) = &self.last {
            let mut input = last.arm.input::<N>(None)?;
            input.cycle += 1;
            let mut state = self.state;
            black_box(step(&self.controller, &mut state, &input));
        }
        Ok(())
    }

    /// One step, which nobody waits for.
    fn cycle(&mut self, arm: &ArmState) -> Result<(), RtError> {
        self.step(arm)?;
        self.tell_last();
        Ok(())
    }

    /// One step, with what was asked for.
    fn step(&mut self, arm: &ArmState) -> Result<&Stepped<N>, RtError> {
        self.tell_last();
        let begin_ns = monotonic_ns();
        let heard = self.hear(arm.cycle);
        let input = arm.input::<N>(heard.as_ref().map(|(_, request)| *request))?;
        let had_fault = self.state.fault().is_some();
        let output = step(&self.controller, &mut self.state, &input);
        let step_ns = monotonic_ns() - begin_ns;
        if let Some((message, _)) = &heard {
            let (outcome, text) = match &output.refusal {
                None => (Outcome::Accepted, Text::EMPTY),
                Some(refusal) => (Outcome::Refused, Text::of(refusal)),
            };
            self.reply(message, arm.cycle, output.mode, outcome, text);
        }
        let let_go = input.request == Some(Request::Idle) && output.refusal.is_none();
        if let_go || (output.fault.is_some() && !had_fault) {
            self.drop_waiting(arm.cycle, output.mode);
        }
        let timing = CycleTiming {
            period_ns: self.last_begin_ns.map_or(0, |last| begin_ns - last),
            latency_ns: match self.virtual_time {
                true => 0,
                false => begin_ns.saturating_sub(arm.stamp_ns),
            },
            step_ns,
        };
        self.last_begin_ns = Some(begin_ns);
        self.untold = true;
        Ok(self.last.insert(Stepped {
            arm: *arm,
            input,
            output,
            timing,
        }))
    }

    /// The request of this cycle, if there is one.
    fn hear(&mut self, cycle: u64) -> Option<(OperatorRequest, Request<N>)> {
        while let Ok(request) = self.inside.requests.pop() {
            if !self.queue.push(request) {
                let text = Text::of(&"refused: too many requests wait for their cycle");
                self.reply(&request, cycle, self.state.mode(), Outcome::Refused, text);
            }
        }
        if self.leaving == Some(0) && !matches!(self.state.mode(), Mode::Idle | Mode::Fault) {
            let message = OperatorRequest::new(0, 0, None, &Request::<N>::GravityHold);
            return Some((message, Request::GravityHold));
        }
        let message = self.queue.due(cycle)?;
        match message.request::<N>() {
            Ok(request) => request.map(|request| (message, request)),
            Err(error) => {
                let text = Text::of(&error);
                self.reply(&message, cycle, self.state.mode(), Outcome::Refused, text);
                None
            }
        }
    }

    /// What still waits was asked of another situation.
    fn drop_waiting(&mut self, cycle: u64, mode: Mode) {
        while let Some(request) = self.queue.pop() {
            let text = Text::of(&format_args!(
                "refused: it waited for its cycle when the controller went to mode {}",
                mode.name()
            ));
            self.reply(&request, cycle, mode, Outcome::Refused, text);
        }
    }

    fn reply(
        &mut self,
        request: &OperatorRequest,
        cycle: u64,
        mode: Mode,
        outcome: Outcome,
        text: Text,
    ) {
        // An operator whose reply finds no room hears nothing, and may ask again.
        let reply = OperatorReply::new(request, cycle, mode, outcome, text);
        let _ = self.inside.replies.push(reply);
    }

    /// Hands the last step to the helper, where that is still to be done. Where the helper is behind, the record
    /// is lost and its number shows it; in virtual time the loop waits.
    fn tell_last(&mut self) {
        let (Some(last), true) = (&self.last, self.untold) else {
            return;
        };
        self.untold = false;
        self.timing.record(&last.timing);
        while self.virtual_time
            && self.inside.telemetry.is_full()
            && !self.inside.telemetry.is_abandoned()
        {
            std::thread::yield_now();
        }
        let telemetry = Telemetry::new(
            self.steps,
            &last.arm,
            &last.input,
            &last.output,
            last.timing,
        );
        self.steps += 1;
        let _ = self.inside.telemetry.push(telemetry);
    }
}
