//! The helper thread: telemetry, requests and replies. It never blocks: separate threads write to the disk and to
//! standard error.

use crate::deferred::{MotionPlan, Pose, StartPose, WaitingMotions, cancels_motions};
use crate::error::RtError;
use crate::fault_file::{FaultFiles, FaultRecorder};
use crate::learning::Learning;
use crate::options::Options;
use crate::queues::HelperQueues;
use core::fmt::Display;
use core::time::Duration;
use std::collections::VecDeque;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};
use supple_core::Vector;
use supple_core::controller::{Controller, Mode, NamesJoints, Request, check_motion};
use supple_ipc::message::{Drives, OperatorReply, OperatorRequest, Outcome, Text};
use supple_ipc::{Backpressure, Domain, IpcError, OperatorServer};
use supple_realtime::{diagnostics, pause};

/// Poll interval of the helper: half a period at 1 kHz, so that a request waits for a quarter of a period in the mean.
const POLL_INTERVAL: Duration = Duration::from_micros(500);
/// Maximum number of messages of one kind per iteration.
const MAX_PER_ITERATION: usize = 256;
/// Maximum number of set-points that one iteration checks.
const MAX_SET_POINTS_PER_ITERATION: usize = 8;
/// Name of the folder for fault tables, in the folder of the system's sockets.
const FAULT_FOLDER: &str = "faults";
/// Maximum time for which the shutdown waits for the disk.
const DISK_TIMEOUT: Duration = Duration::from_secs(2);

/// Checks whether a requested motion is feasible over its whole length, from its start pose if that is known
/// ([`supple_core::controller::check_motion()`]); otherwise whether its target is. Returns the end pose, if known.
///
/// # Errors
/// Text of the refusal.
pub type MotionCheck =
    Box<dyn Fn(&OperatorRequest, Option<&Pose>) -> Result<Option<Pose>, String> + Send>;

/// Creates the feasibility check of an arm with `N` joints. An invalid request passes the check; the loop refuses it.
pub fn motion_check<const N: usize>(controller: Controller<N>) -> MotionCheck {
    Box::new(move |message, from_rad| {
        let Ok(Some(request)) = message.request::<N>() else {
            return Ok(None);
        };
        let from_rad = from_rad.map(|from_rad| Vector::from_fn(|i, _| from_rad[i]));
        // If the start pose is unknown, an excitation is checked from its centre, near which it starts. For a joint motion, the
        // workspace and the torque at its target are checked.
        let from_rad = match &request {
            Request::Excite(series) => from_rad.or(Some(series.centre_rad)),
            Request::Move { target_rad, .. } | Request::JointImpedance { target_rad, .. } => {
                from_rad.or(Some(*target_rad))
            }
            _ => from_rad,
        };
        if let Some(from_rad) = from_rad {
            check_motion(&controller, &from_rad, &request).map_err(|refusal| {
                let names = controller.config().joint_names;
                refusal.with_names(names.as_slice()).to_string()
            })?;
        }
        let end_rad = match &request {
            Request::Move { target_rad, .. } => Some(*target_rad),
            Request::Excite(series) => Some(series.at(series.duration_s).position_rad),
            _ => None,
        };
        Ok(end_rad
            .map(|end_rad| core::array::from_fn(|i| end_rad.get(i).copied().unwrap_or_default())))
    })
}

/// The running helper thread.
#[derive(Debug)]
pub struct Helper {
    thread: JoinHandle<Result<(), IpcError>>,
}

impl Helper {
    /// Starts the thread and waits until its ports are open. `motion_check` checks requested motions, `learning` refines
    /// the model.
    ///
    /// # Errors
    /// [`RtError::Ipc`] if the ports cannot be opened, [`RtError::Thread`].
    pub fn start(
        domain: &Domain,
        queues: HelperQueues,
        options: &Options,
        motion_check: MotionCheck,
        learning: Learning,
    ) -> Result<Helper, RtError> {
        let backpressure = match options.process.virtual_time {
            true => Backpressure::Block,
            false => Backpressure::Drop,
        };
        let folder = options.fault_dir.clone();
        let folder = folder.unwrap_or_else(|| domain.folder().join(FAULT_FOLDER));
        let files = FaultFiles::start(folder).map_err(RtError::Thread)?;
        let domain = domain.clone();
        let (ready, is_ready) = sync_channel(1);
        let thread = Builder::new()
            .name("supple-rt-helper".to_owned())
            .spawn(move || {
                let works = (motion_check, learning);
                work(&domain, backpressure, queues, files, works, &ready)
            })
            .map_err(RtError::Thread)?;
        let helper = Helper { thread };
        match is_ready.recv() {
            Ok(()) => Ok(helper),
            // The thread ended before it was ready: its error is returned.
            Err(_) => helper.finish().and(Err(RtError::Helper)),
        }
    }

    /// Waits until all telemetry and replies of a loop that has ended are published.
    ///
    /// # Errors
    /// [`RtError::Ipc`] if the ports could not be opened, [`RtError::Helper`] if the thread panicked.
    pub fn finish(self) -> Result<(), RtError> {
        match self.thread.join() {
            Ok(worked) => Ok(worked?),
            Err(_) => Err(RtError::Helper),
        }
    }
}

fn work(
    domain: &Domain,
    backpressure: Backpressure,
    queues: HelperQueues,
    files: FaultFiles,
    (motion_check, learning): (MotionCheck, Learning),
    ready: &SyncSender<()>,
) -> Result<(), IpcError> {
    let link = OperatorServer::new(domain, backpressure)?;
    // The receiver is dropped only if the start was aborted.
    let _ = ready.send(());
    let mut state = HelperState {
        link,
        queues,
        fault_recorder: FaultRecorder::new(files),
        motion_check,
        learning,
        virtual_time: backpressure == Backpressure::Block,
        position_rad: None,
        cycle: 0,
        plan: MotionPlan::default(),
        waiting: WaitingMotions::default(),
        awaiting_check: VecDeque::with_capacity(MAX_PER_ITERATION),
        failed: false,
        dropped_states_reported: false,
    };
    loop {
        state.queues.liveness.increment();
        let ended = state.queues.ended();
        state.requests();
        state.telemetry();
        state.check_due_motion();
        state.replies();
        if ended {
            state.fault_recorder.finish(DISK_TIMEOUT);
            return Ok(());
        }
        pause(POLL_INTERVAL);
    }
}

/// State of the helper thread. An error of a port does not end the thread; the next message uses the port again.
struct HelperState {
    link: OperatorServer,
    queues: HelperQueues,
    fault_recorder: FaultRecorder,
    motion_check: MotionCheck,
    learning: Learning,
    /// Requests waiting for their motion check.
    awaiting_check: VecDeque<OperatorRequest>,
    virtual_time: bool,
    /// Last known joint angles, and their cycle.
    position_rad: Option<Pose>,
    cycle: u64,
    /// Start pose of the next motion.
    plan: MotionPlan,
    /// Motions that wait for their cycle.
    waiting: WaitingMotions,
    failed: bool,
    dropped_states_reported: bool,
}

impl HelperState {
    fn requests(&mut self) {
        // Idle requests are forwarded without a check. One other request is checked per iteration, because the check of a
        // whole motion takes milliseconds.
        while self.awaiting_check.len() < MAX_PER_ITERATION {
            match self.link.request() {
                Ok(Some(request)) if request.requests_idle_now() => {
                    self.cancel_motions();
                    self.enqueue(request);
                }
                Ok(Some(request)) => self.awaiting_check.push_back(request),
                Ok(None) => break,
                Err(error) => {
                    self.port_failed(&error);
                    break;
                }
            }
        }
        // The check of a set-point takes microseconds.
        for _ in 0..MAX_SET_POINTS_PER_ITERATION {
            let Some(request) = self.awaiting_check.pop_front() else {
                return;
            };
            self.check(request);
            if !request.is_set_point() {
                return;
            }
        }
    }

    /// Checks a request, then passes it to the loop, keeps it until its cycle or refuses it.
    fn check(&mut self, request: OperatorRequest) {
        if cancels_motions(&request) {
            self.cancel_motions();
        }
        let from_rad = match self.plan.start_pose(&request) {
            StartPose::Present => self.position_rad,
            StartPose::Known(pose) => Some(pose),
            StartPose::Unknown => None,
        };
        match (self.motion_check)(&request, from_rad.as_ref()) {
            Ok(end_rad)
                if !self.virtual_time && WaitingMotions::must_wait(&request, self.cycle) =>
            {
                match self.waiting.push(request) {
                    Ok(()) => {
                        self.plan.record_accepted(&request, end_rad);
                        self.reply(&reply_before_step(&request, Outcome::Queued, ""));
                    }
                    Err(full) => {
                        let text = format!("refused: {full}");
                        self.reply(&reply_before_step(&request, Outcome::Refused, &text));
                    }
                }
            }
            Ok(end_rad) => {
                self.plan.record_accepted(&request, end_rad);
                self.enqueue(request);
            }
            Err(text) => {
                self.reply(&reply_before_step(&request, Outcome::Refused, &text));
            }
        }
    }

    fn enqueue(&mut self, request: OperatorRequest) {
        let queued = self.queues.request(request);
        match (queued, request.is_scheduled()) {
            // The loop reads the request before the step of its cycle.
            (true, true) => self.reply(&reply_before_step(&request, Outcome::Queued, "")),
            (true, false) => {}
            (false, _) => self.refuse_because_queue_is_full(&request),
        }
    }

    fn refuse_because_queue_is_full(&mut self, request: &OperatorRequest) {
        let text = "refused: too many requests at once";
        self.reply(&reply_before_step(request, Outcome::Refused, text));
    }

    /// Checks the next due motion from the present pose of the arm, and passes it to the loop; one motion per iteration.
    fn check_due_motion(&mut self) {
        let Some(request) = self.waiting.pop_due(self.cycle) else {
            return;
        };
        match (self.motion_check)(&request, self.position_rad.as_ref()) {
            Ok(_) => {
                if !self.queues.request(request) {
                    self.refuse_because_queue_is_full(&request);
                }
            }
            Err(text) => self.refuse_waiting(&request, &text),
        }
    }

    /// Refuses all waiting motions.
    fn cancel_motions(&mut self) {
        self.plan.reset();
        while let Some(request) = self.waiting.pop() {
            let text = "refused: while the motion waited, a mode without motion was requested, a fault latched or the drives became inactive";
            self.refuse_waiting(&request, text);
        }
    }

    fn refuse_waiting(&mut self, request: &OperatorRequest, text: &str) {
        let reply = reply_before_step(request, Outcome::Refused, text);
        self.plan.handle_reply(&reply);
        self.reply(&reply);
    }

    fn telemetry(&mut self) {
        for _ in 0..MAX_PER_ITERATION {
            let Some(telemetry) = self.queues.telemetry() else {
                break;
            };
            if let Err(error) = self.link.publish(&telemetry) {
                self.port_failed(&error);
            }
            self.fault_recorder.add(&telemetry);
            let record = telemetry.record();
            self.position_rad = Some(record.position_rad.into());
            self.cycle = telemetry.state.cycle;
            self.plan.update(self.cycle);
            let active = telemetry.state.drives() == Drives::Active;
            if (self.waiting).cancelled_by(record.mode(), record.fault != 0, active) {
                self.cancel_motions();
            }
            for request in (self.learning)(&telemetry) {
                // If the queue is full, the request is lost; a later estimate replaces it.
                self.queues.learned(request);
            }
        }
        if self.queues.states_dropped() > 0 && !self.dropped_states_reported {
            self.dropped_states_reported = true;
            diagnostics::post(
                "supple-rt: warning: arm states are discarded: they are from another arm, or from a program that is not \
                 this system's plant; start every process with the same --arm, and only one plant",
            );
        }
    }

    fn replies(&mut self) {
        for _ in 0..MAX_PER_ITERATION {
            let Some(reply) = self.queues.reply() else {
                break;
            };
            self.plan.handle_reply(&reply);
            self.reply(&reply);
        }
    }

    fn reply(&mut self, reply: &OperatorReply) {
        if let Err(error) = self.link.reply(reply) {
            self.port_failed(&error);
        }
    }

    /// Reports the first failure of a port.
    fn port_failed(&mut self, error: &dyn Display) {
        if !self.failed {
            self.failed = true;
            diagnostics::post(format_args!("supple-rt: warning: {error}"));
        }
    }
}

/// Creates a reply of the helper to a request that the loop has not received.
fn reply_before_step(request: &OperatorRequest, outcome: Outcome, text: &str) -> OperatorReply {
    OperatorReply::new(request, 0, Mode::Idle, outcome, Text::of(&text))
}
