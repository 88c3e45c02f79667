//! The loop: a state, a step, an answer.
//!
//! Nothing else is done before the answer, and nothing after it: when the plant announces its next state, the loop
//! hands over what there is to tell of the last one, and rehearses the step.
//!
//! A loop that lags takes the states that came meanwhile one by one, so that velocities stay right, and
//! answers the newest. A plant that falls silent is stepped over with its last state, until the controller
//! finds it stale. On the way out the loop goes to gravity hold and asks the plant to lower the drives to
//! idle, in which the motors brake; it ends when they are there.
//!
//! A request for idle goes before all others and waits in no queue. A state of another arm is dropped and counted.

use crate::error::RtError;
use crate::queue::Queue;
use crate::rings::{IdleInside, Inside};
use crate::timing::Timing;
use core::hint::black_box;
use core::sync::atomic::Ordering;
use core::time::Duration;
use supple_core::controller::{Controller, Mode, Request, State, step};
use supple_core::{Input, Output};
use supple_ipc::message::{
    ArmState, CycleTiming, Drives, OperatorReply, OperatorRequest, Outcome, Telemetry, Text,
    TorqueCommand,
};
use supple_ipc::{ControllerLink, Woken, idle_reply};
use supple_realtime::{Stop, monotonic_ns};

/// Silence of the plant after which its last state counts as seen again.
pub const PLANT_LOST_AFTER: Duration = Duration::from_millis(20);
/// Cycles that the plant has to lower the drives when the controller leaves.
const LEAVING_CYCLES: u32 = 250;
/// Cycles of them that a wait in vain counts for.
const SILENT_CYCLES: u32 = 20;

/// States of another arm that are passed over in one turn.
const MOST_OF_OTHERS: u32 = 64;

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
    /// The way for requests for idle.
    idle_path: Option<IdleInside>,
    /// Requests for idle that came with the others.
    idle: Queue,
    /// Arm states that were dropped here, and before by the link.
    states_dropped: (u64, u64),
    /// Cycles since the loop began to leave.
    leaving: Option<u32>,
}

/// Who asked for what a cycle hears.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "the loop's thread allocates nothing: no request is boxed"
)]
enum Asker {
    /// An operator.
    Operator(OperatorRequest),
    /// All who asked for idle, up to this number on the way for idle.
    Idle(Option<u64>),
    /// The loop itself, on its way out.
    Loop,
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
            idle_path: None,
            idle: Queue::default(),
            states_dropped: (0, 0),
            leaving: None,
        }
    }

    /// From now on requests for idle are heard on this way too, before all others.
    pub fn hear_idle(&mut self, path: IdleInside) {
        self.idle_path = Some(path);
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
        // Where nobody can be heard any more, an arm is not kept moving.
        let alone =
            self.inside.is_alone() || self.idle_path.as_ref().is_some_and(IdleInside::is_alone);
        if stop.asked() || alone {
            self.leaving.get_or_insert(0);
        }
        let mut arm = match link.wake(PLANT_LOST_AFTER)? {
            Woken::State(arm) => match self.first_of_this_arm(link, arm)? {
                Some(arm) => arm,
                None => return self.other_arm(),
            },
            Woken::Announced => {
                self.tell_last();
                self.rehearse()?;
                return Ok(true);
            }
            Woken::Silence => return self.silence(),
        };
        while let Some(newer) = link.receive()? {
            if self.is_of_this_arm(link, &newer) {
                self.cycle(&arm)?;
                arm = newer;
            }
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

    /// Of a state and those that came after it the first that is of this arm.
    fn first_of_this_arm(
        &mut self,
        link: &ControllerLink,
        mut arm: ArmState,
    ) -> Result<Option<ArmState>, RtError> {
        for _ in 0..MOST_OF_OTHERS {
            if self.is_of_this_arm(link, &arm) {
                return Ok(Some(arm));
            }
            match link.receive()? {
                Some(next) => arm = next,
                None => break,
            }
        }
        Ok(None)
    }

    /// Counts a state that is of another arm, and those that the link has dropped.
    fn is_of_this_arm(&mut self, link: &ControllerLink, arm: &ArmState) -> bool {
        let before = self.states_dropped;
        let is = arm.is_of::<N>();
        self.states_dropped.0 += u64::from(!is);
        self.states_dropped.1 = link.foreign();
        if self.states_dropped != before {
            let all = self.states_dropped.0 + self.states_dropped.1;
            self.inside.states_dropped.store(all, Ordering::Relaxed);
        }
        is
    }

    /// States of another arm are as good as none.
    fn other_arm(&mut self) -> Result<bool, RtError> {
        let now_ns = monotonic_ns();
        let since_ns = self.last_begin_ns.get_or_insert(now_ns);
        match now_ns.saturating_sub(*since_ns) >= PLANT_LOST_AFTER.as_nanos() as u64 {
            true => {
                *since_ns = now_ns;
                self.silence()
            }
            false => Ok(true),
        }
    }

    /// A wait in vain.
    fn silence(&mut self) -> Result<bool, RtError> {
        if let Some(cycles) = &mut self.leaving {
            *cycles += SILENT_CYCLES;
            return Ok(*cycles < LEAVING_CYCLES);
        }
        match &self.last {
            Some(last) if !self.virtual_time => {
                let arm = last.arm;
                self.cycle(&arm)?;
            }
            Some(_) => {}
            // There was no cycle yet, in which the arm could have been held.
            None => {
                if let Some(asked) = self.idle_path.as_ref().and_then(IdleInside::asked) {
                    self.answer_idle(asked, 0, Outcome::Accepted, Text::EMPTY);
                }
            }
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
        if let Some((asker, _)) = &heard {
            self.answer(asker, &output);
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

    /// The request of this cycle, if there is one; that for idle first.
    fn hear(&mut self, cycle: u64) -> Option<(Asker, Request<N>)> {
        let asked = self.idle_path.as_ref().and_then(IdleInside::asked);
        while let Ok(&request) = self.inside.requests.peek() {
            if request.is_for_idle_now() {
                // What finds no place is heard in the next cycle; each of them asks for the same.
                if self.idle.push(request).is_err() {
                    break;
                }
            } else if let Err(no_place) = self.queue.push(request) {
                let text = Text::of(&format_args!("refused: {no_place}"));
                self.reply(&request, cycle, self.state.mode(), Outcome::Refused, text);
            }
            let _ = self.inside.requests.pop();
        }
        if asked.is_some() || !self.idle.is_empty() {
            return Some((Asker::Idle(asked), Request::Idle));
        }
        if self.leaving == Some(0) && !matches!(self.state.mode(), Mode::Idle | Mode::Fault) {
            return Some((Asker::Loop, Request::GravityHold));
        }
        let message = self.queue.due(cycle)?;
        match message.request::<N>() {
            Ok(request) => request.map(|request| (Asker::Operator(message), request)),
            Err(error) => {
                let text = Text::of(&error);
                self.reply(&message, cycle, self.state.mode(), Outcome::Refused, text);
                None
            }
        }
    }

    /// Tells who asked what became of it.
    fn answer(&mut self, asker: &Asker, output: &Output<N>) {
        let (outcome, text) = match &output.refusal {
            None => (Outcome::Accepted, Text::EMPTY),
            Some(refusal) => (Outcome::Refused, Text::of(refusal)),
        };
        match asker {
            Asker::Operator(request) => {
                self.reply(request, output.cycle, output.mode, outcome, text);
            }
            // Asked again in the next cycle, until the arm is let go of.
            Asker::Idle(_) if outcome == Outcome::Accepted && !output.limp => {}
            Asker::Idle(asked) => {
                if let Some(asked) = asked {
                    self.answer_idle(*asked, output.cycle, outcome, text);
                }
                while let Some(request) = self.idle.pop() {
                    self.reply(&request, output.cycle, output.mode, outcome, text);
                }
            }
            Asker::Loop => {}
        }
    }

    fn answer_idle(&mut self, asked: u64, cycle: u64, outcome: Outcome, text: Text) {
        let reply = idle_reply(asked, cycle, self.state.mode(), outcome, text);
        if let Some(path) = &mut self.idle_path {
            path.answer(reply);
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
        let mut telemetry = Telemetry::new(
            self.steps,
            &last.arm,
            &last.input,
            &last.output,
            last.timing,
        );
        telemetry.states_dropped = self.states_dropped.0 + self.states_dropped.1;
        self.steps += 1;
        let _ = self.inside.telemetry.push(telemetry);
    }
}
