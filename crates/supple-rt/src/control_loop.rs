//! The control loop: receive an arm state, compute a step, publish the torque command.
//!
//! The loop does no other work between a state and its answer, nor directly after it. When the plant announces the next
//! state, the loop passes the last cycle's telemetry to the helper and runs the step once with its result discarded, to
//! warm the caches.
//!
//! If the loop is late, it steps over every pending state, so that the velocity estimate stays correct, and answers the
//! newest. If the plant stops sending, the loop repeats the step with the last state until the controller reports a
//! stale state. On shutdown the loop enters gravity hold and requests idle drives, in which the motors brake; it ends
//! when the drives are idle.
//!
//! Idle requests take priority over all others and are never queued behind them. A request for a cycle that is not after
//! the last accepted idle is refused, however late it arrives. States of another arm are discarded and counted.

use crate::deferred::is_motion;
use crate::error::RtError;
use crate::queues::{LoopIdleChannel, LoopQueues};
use crate::request_queue::RequestQueue;
use crate::timing::Timing;
use core::fmt;
use core::hint::black_box;
use core::sync::atomic::Ordering;
use core::time::Duration;
use supple_core::controller::{Controller, CycleRecord, Mode, NamesJoints, Request, State, step};
use supple_core::{Input, Output};
use supple_ipc::message::{
    ArmState, CycleTiming, Drives, OperatorReply, OperatorRequest, Outcome, Telemetry, Text,
    TorqueCommand,
};
use supple_ipc::{ControllerLink, WakeEvent, idle_reply};
use supple_realtime::{Stop, monotonic_ns};

/// Time without a state after which the loop repeats the step with the last state.
pub const PLANT_TIMEOUT: Duration = Duration::from_millis(20);
/// Maximum number of cycles until the plant has switched the drives to idle during shutdown.
const SHUTDOWN_CYCLES: u32 = 250;
/// Number of shutdown cycles that one timeout of a wait for a state counts as.
const CYCLES_PER_TIMEOUT: u32 = 20;

/// Maximum number of states of another arm that one iteration discards.
const MAX_FOREIGN_STATES: u32 = 64;

/// The controller and the state of its loop.
#[derive(Debug)]
pub struct ControlLoop<const N: usize> {
    controller: Controller<N>,
    state: State<N>,
    queues: LoopQueues,
    queued: RequestQueue,
    timing: Timing,
    virtual_time: bool,
    steps: u64,
    last_begin_ns: Option<u64>,
    last: Option<StepRecord<N>>,
    /// Whether the telemetry of the last step still has to be sent to the helper.
    telemetry_pending: bool,
    /// Channel for idle requests.
    idle_channel: Option<LoopIdleChannel>,
    /// Idle requests of operators, from the request queue.
    queued_idle: RequestQueue,
    /// Cycle in which idle was last accepted; 0 before the first state.
    last_idle: Option<u64>,
    /// Numbers of arm states that the loop has discarded, and that the link has discarded.
    states_dropped: (u64, u64),
    /// Number of cycles since the shutdown began; `None` before it.
    shutting_down: Option<u32>,
}

/// Source of the request that a cycle carries out.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "the loop's thread may not allocate memory, so a request cannot be boxed"
)]
enum RequestSource {
    /// An operator request, preceded by the number of requests that arrived before it and are still queued.
    Operator(usize, OperatorRequest),
    /// All idle requests; the value is the number of the last request on the idle channel, if it has a pending request.
    Idle(Option<u64>),
    /// The loop itself, during shutdown.
    Shutdown,
    /// The learner, which expects no reply.
    Learner,
}

/// A step: its input, output and timing, for the telemetry.
#[derive(Debug)]
struct StepRecord<const N: usize> {
    arm: ArmState,
    input: Input<N>,
    output: Output<N>,
    timing: CycleTiming,
}

impl<const N: usize> ControlLoop<N> {
    /// Creates the loop in idle, before the first state.
    pub fn new(controller: Controller<N>, queues: LoopQueues, virtual_time: bool) -> Self {
        ControlLoop {
            state: State::new(&controller),
            controller,
            queues,
            queued: RequestQueue::default(),
            timing: Timing::new(),
            virtual_time,
            steps: 0,
            last_begin_ns: None,
            last: None,
            telemetry_pending: false,
            idle_channel: None,
            queued_idle: RequestQueue::default(),
            last_idle: None,
            states_dropped: (0, 0),
            shutting_down: None,
        }
    }

    /// Adds the channel for idle requests, which take priority over all others.
    pub fn set_idle_channel(&mut self, channel: LoopIdleChannel) {
        self.idle_channel = Some(channel);
    }

    /// Answers states until a shutdown is requested and the drives are idle, or the plant does not answer during the shutdown.
    ///
    /// # Errors
    /// [`RtError`] if shared memory fails, or a state is of another arm.
    pub fn run(&mut self, link: &ControllerLink, stop: &Stop) -> Result<(), RtError> {
        let result = loop {
            match self.run_iteration(link, stop) {
                Ok(true) => {}
                result => break result.map(|_| ()),
            }
        };
        // No announcement follows, so the last telemetry is sent now.
        self.flush_telemetry();
        result
    }

    /// One iteration: waits for a state and answers it, or times out. Returns false when the loop must end.
    ///
    /// # Errors
    /// The same as those of [`ControlLoop::run`].
    pub fn run_iteration(&mut self, link: &ControllerLink, stop: &Stop) -> Result<bool, RtError> {
        self.queues.liveness.increment();
        // If no request can arrive any more, the loop shuts down: an arm that cannot be stopped must not move.
        let unreachable_by_operators = self.queues.peer_dropped()
            || self
                .idle_channel
                .as_ref()
                .is_some_and(LoopIdleChannel::peer_dropped);
        if stop.shutdown_requested() || unreachable_by_operators {
            self.shutting_down.get_or_insert(0);
        }
        let mut arm = match link.wait_for_event(PLANT_TIMEOUT)? {
            WakeEvent::State(arm) => match self.first_matching_state(link, arm)? {
                Some(arm) => arm,
                None => return self.handle_foreign_state(),
            },
            WakeEvent::Announced => {
                self.flush_telemetry();
                self.warm_up_caches()?;
                return Ok(true);
            }
            WakeEvent::Timeout => return self.handle_timeout(),
        };
        while let Some(newer) = link.receive()? {
            if self.accepts_state(link, &newer) {
                self.cycle(&arm)?;
                arm = newer;
            }
        }
        let shutting_down = self.shutting_down.is_some();
        let output = &self.step(&arm)?.output;
        let torque_off = output.torque_off;
        // The plant waits for this answer; the telemetry is sent later, when the plant announces the next state.
        link.answer(&TorqueCommand::new(output, shutting_down))?;
        if self.virtual_time {
            self.flush_telemetry();
        }
        let Some(cycles) = &mut self.shutting_down else {
            return Ok(true);
        };
        *cycles += 1;
        let drives_idle = arm.drives() != Drives::Active || torque_off;
        Ok(!drives_idle && *cycles < SHUTDOWN_CYCLES)
    }

    /// Timing statistics of the loop.
    pub fn into_timing(self) -> Timing {
        self.timing
    }

    /// Returns the first state of this arm, from `arm` and the unread states after it.
    fn first_matching_state(
        &mut self,
        link: &ControllerLink,
        mut arm: ArmState,
    ) -> Result<Option<ArmState>, RtError> {
        for _ in 0..MAX_FOREIGN_STATES {
            if self.accepts_state(link, &arm) {
                return Ok(Some(arm));
            }
            match link.receive()? {
                Some(next) => arm = next,
                None => break,
            }
        }
        Ok(None)
    }

    /// Whether the state is of this arm. Counts states of other arms, and states that the link has discarded.
    fn accepts_state(&mut self, link: &ControllerLink, arm: &ArmState) -> bool {
        let before = self.states_dropped;
        let is = arm.matches_dof::<N>();
        self.states_dropped.0 += u64::from(!is);
        self.states_dropped.1 = link.foreign();
        if self.states_dropped != before {
            let all = self.states_dropped.0 + self.states_dropped.1;
            self.queues.states_dropped.store(all, Ordering::Relaxed);
        }
        is
    }

    /// Handles the case that only states of another arm arrived: as a timeout, once [`PLANT_TIMEOUT`] has passed.
    fn handle_foreign_state(&mut self) -> Result<bool, RtError> {
        let now_ns = monotonic_ns();
        let since_ns = self.last_begin_ns.get_or_insert(now_ns);
        match now_ns.saturating_sub(*since_ns) >= PLANT_TIMEOUT.as_nanos() as u64 {
            true => {
                *since_ns = now_ns;
                self.handle_timeout()
            }
            false => Ok(true),
        }
    }

    /// Handles the case that no state arrived within the timeout.
    fn handle_timeout(&mut self) -> Result<bool, RtError> {
        if let Some(cycles) = &mut self.shutting_down {
            *cycles += CYCLES_PER_TIMEOUT;
            return Ok(*cycles < SHUTDOWN_CYCLES);
        }
        match &self.last {
            Some(last) if !self.virtual_time => {
                let arm = last.arm;
                self.cycle(&arm)?;
            }
            Some(_) => {}
            // No cycle has run yet, so the controller is already idle: the idle request is accepted, and earlier requests are
            // refused.
            None => {
                if let Some(number) = self.pending_idle() {
                    self.last_idle = Some(0);
                    self.receive_requests(0);
                    self.refuse_queued(self.queued.len(), 0, Mode::Idle);
                    self.answer_idle(number, 0, Outcome::Accepted, Text::EMPTY);
                }
            }
        }
        Ok(true)
    }

    /// Runs the step with its result discarded, to load code and data into the caches: after other work, cache misses
    /// would take longer than the step itself.
    fn warm_up_caches(&mut self) -> Result<(), RtError> {
        if let Some(last) = &self.last {
            let mut input = last.arm.input::<N>(None)?;
            input.cycle += 1;
            let mut state = self.state;
            black_box(step(&self.controller, &mut state, &input));
        }
        Ok(())
    }

    /// Runs a step without an answer to the plant.
    fn cycle(&mut self, arm: &ArmState) -> Result<(), RtError> {
        self.step(arm)?;
        self.flush_telemetry();
        Ok(())
    }

    /// Runs a step with the request of this cycle.
    fn step(&mut self, arm: &ArmState) -> Result<&StepRecord<N>, RtError> {
        self.flush_telemetry();
        let begin_ns = monotonic_ns();
        // A restarted plant counts its cycles from zero.
        if self.last_idle.is_some_and(|idle| arm.cycle < idle) {
            self.last_idle = Some(0);
        }
        let received = self.next_request(arm.cycle);
        let input = arm.input::<N>(received.as_ref().map(|(_, request)| *request))?;
        let had_fault = self.state.fault().is_some();
        let deactivated = arm.drives() != Drives::Active
            && (self.last.as_ref()).is_some_and(|last| last.arm.drives() == Drives::Active);
        let output = step(&self.controller, &mut self.state, &input);
        let step_ns = monotonic_ns() - begin_ns;
        if let Some((source, _)) = &received {
            self.answer(source, &output);
        }
        if matches!(input.request, Some(Request::Idle)) && output.refusal.is_none() {
            self.last_idle = Some(arm.cycle);
        }
        // Number of queued requests that this request ends.
        let ended = match (&received, input.request) {
            _ if output.fault.is_some() && !had_fault => self.queued.len(),
            _ if output.refusal.is_some() => 0,
            (_, Some(Request::Idle)) | (Some((RequestSource::Shutdown, _)), _) => self.queued.len(),
            // The operator requests a mode without motion now: a motion that was scheduled before must not begin later.
            (
                Some((RequestSource::Operator(earlier, message), _)),
                Some(Request::GravityHold | Request::Float),
            ) if !message.is_scheduled() => *earlier,
            _ => 0,
        };
        self.refuse_queued(ended, arm.cycle, output.mode);
        if deactivated {
            // An operator who activates the drives again does not expect a motion that was scheduled before.
            let reason = &"the drives became inactive";
            self.refuse_queued_if(arm.cycle, output.mode, reason, |_, request| {
                is_motion(request)
            });
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
        self.telemetry_pending = true;
        Ok(self.last.insert(StepRecord {
            arm: *arm,
            input,
            output,
            timing,
        }))
    }

    /// Returns the number of the last request on the idle channel, if it has not been answered.
    fn pending_idle(&self) -> Option<u64> {
        self.idle_channel
            .as_ref()
            .and_then(LoopIdleChannel::pending_request)
    }

    /// Moves the requests that have arrived into the loop's own queues.
    fn receive_requests(&mut self, cycle: u64) {
        while let Ok(&request) = self.queues.requests.peek() {
            if request.requests_idle_now() {
                // If `queued_idle` is full, the request stays in the request queue until the next cycle; all idle
                // requests are equivalent.
                if self.queued_idle.push(request).is_err() {
                    break;
                }
            } else if let Err(full) = self.queued.push(request) {
                let text = Text::of(&format_args!("refused: {full}"));
                self.reply(&request, cycle, self.state.mode(), Outcome::Refused, text);
            }
            let _ = self.queues.requests.pop();
        }
    }

    /// Returns the request to execute in this cycle; idle requests come first.
    fn next_request(&mut self, cycle: u64) -> Option<(RequestSource, Request<N>)> {
        let number = self.pending_idle();
        self.receive_requests(cycle);
        if number.is_some() || !self.queued_idle.is_empty() {
            return Some((RequestSource::Idle(number), Request::Idle));
        }
        if self.shutting_down == Some(0) && !matches!(self.state.mode(), Mode::Idle | Mode::Fault) {
            return Some((RequestSource::Shutdown, Request::GravityHold));
        }
        let Some((earlier, message)) = self.queued.pop_due(cycle) else {
            return self.next_learned(cycle);
        };
        if let Some(idle) = self.last_idle.filter(|idle| message.is_before(*idle)) {
            let text = Text::of(&format_args!(
                "refused: the request is for cycle {}, but idle was accepted in cycle {idle}",
                message.at_cycle
            ));
            self.reply(&message, cycle, self.state.mode(), Outcome::Refused, text);
            return None;
        }
        match message.request::<N>() {
            Ok(request) => request.map(|request| {
                let source = RequestSource::Operator(earlier, message);
                (source, request)
            }),
            Err(error) => {
                let text = Text::of(&error);
                self.reply(&message, cycle, self.state.mode(), Outcome::Refused, text);
                None
            }
        }
    }

    /// Returns the next due request of the learner; called in cycles without an operator request.
    fn next_learned(&mut self, cycle: u64) -> Option<(RequestSource, Request<N>)> {
        let learned = &mut self.queues.learned;
        if !learned.peek().is_ok_and(|message| message.is_due(cycle)) {
            return None;
        }
        let request = learned.pop().ok()?.request::<N>().ok()??;
        Some((RequestSource::Learner, request))
    }

    /// Sends the outcome to the source of the request.
    fn answer(&mut self, source: &RequestSource, output: &Output<N>) {
        let (outcome, text) = match &output.refusal {
            None => (Outcome::Accepted, Text::EMPTY),
            Some(refusal) => {
                let names = self.controller.config().joint_names;
                let refusal = refusal.with_names(names.as_slice());
                (Outcome::Refused, Text::of(&refusal))
            }
        };
        match source {
            RequestSource::Operator(_, request) => {
                self.reply(request, output.cycle, output.mode, outcome, text);
            }
            // The shutdown request is repeated in the next cycle until the torque is off.
            RequestSource::Idle(_) if outcome == Outcome::Accepted && !output.torque_off => {}
            RequestSource::Idle(number) => {
                if let Some(number) = number {
                    self.answer_idle(*number, output.cycle, outcome, text);
                }
                while let Some(request) = self.queued_idle.pop() {
                    self.reply(&request, output.cycle, output.mode, outcome, text);
                }
            }
            RequestSource::Shutdown | RequestSource::Learner => {}
        }
    }

    fn answer_idle(&mut self, request_number: u64, cycle: u64, outcome: Outcome, text: Text) {
        let reply = idle_reply(request_number, cycle, self.state.mode(), outcome, text);
        if let Some(channel) = &mut self.idle_channel {
            channel.answer(reply);
        }
    }

    /// Refuses the first `count` queued requests except idle requests, because they were sent under other conditions.
    fn refuse_queued(&mut self, count: usize, cycle: u64, mode: Mode) {
        if count > 0 {
            let reason = &format_args!("the controller changed to mode {}", mode.name());
            self.refuse_queued_if(cycle, mode, reason, |position, request| {
                position < count && !request.requests_idle()
            });
        }
    }

    /// Refuses the queued requests for which the condition on position and request holds.
    fn refuse_queued_if(
        &mut self,
        cycle: u64,
        mode: Mode,
        reason: &dyn fmt::Display,
        refused: impl Fn(usize, &OperatorRequest) -> bool,
    ) {
        let mut kept = RequestQueue::default();
        for position in 0..self.queued.len() {
            let Some(request) = self.queued.pop() else {
                break;
            };
            if !refused(position, &request) && kept.push(request).is_ok() {
                continue;
            }
            let text = Text::of(&format_args!(
                "refused: the request was still queued when {reason}"
            ));
            self.reply(&request, cycle, mode, Outcome::Refused, text);
        }
        self.queued = kept;
    }

    fn reply(
        &mut self,
        request: &OperatorRequest,
        cycle: u64,
        mode: Mode,
        outcome: Outcome,
        text: Text,
    ) {
        // If the reply queue is full, the reply is lost; the operator can repeat the request.
        let reply = OperatorReply::new(request, cycle, mode, outcome, text);
        let _ = self.queues.replies.push(reply);
    }

    /// Sends the telemetry of the last step to the helper, unless it has been sent. If the queue is full, the record is lost,
    /// which leaves a gap in the step numbers; in virtual time the loop waits instead.
    fn flush_telemetry(&mut self) {
        let (Some(last), true) = (&self.last, self.telemetry_pending) else {
            return;
        };
        self.telemetry_pending = false;
        self.timing.record(&last.timing);
        while self.virtual_time
            && self.queues.telemetry.is_full()
            && !self.queues.telemetry.is_abandoned()
        {
            std::thread::yield_now();
        }
        let names = &self.controller.config().joint_names;
        let record = CycleRecord::new(self.steps, &last.input, &last.output)
            .with_joint_names(&last.output, names);
        let mut telemetry = Telemetry::of(&record, &last.arm, last.timing);
        telemetry.states_dropped = self.states_dropped.0 + self.states_dropped.1;
        self.steps += 1;
        let _ = self.queues.telemetry.push(telemetry);
    }
}
