//! The control path: arm states from the plant to the controller and torque commands from the controller to the plant, each
//! with a wake-up socket.
//!
//! The plant owns the clock: it publishes a state and wakes the controller; the controller answers with the command of
//! the same cycle. Every wait has a timeout. If both processes share a processor, any work that the controller does
//! after its answer delays the plant. The plant therefore also wakes the controller shortly before each state, and the
//! controller does its other work then. The controller notifies the plant only if the plant is blocked: before it
//! blocks, the plant publishes a [`WakeRequest`] and then checks for the answer again. Therefore either the plant reads the
//! answer, or the controller reads the request.

use crate::cleanup::SharedMemoryCleanup;
use crate::domain::Domain;
use crate::error::{IpcError, failed};
use crate::message::{ArmState, TorqueCommand, WakeRequest};
use crate::port::{Backpressure, QualityOfService, Reader, Writer};
use crate::wake::{WaitResult, WakeReason, WakeReceiver, WakeSender};
use crate::writer_identity::WriterFilter;
use core::cell::{Cell, LazyCell};
use core::sync::atomic::{Ordering, fence};
use core::time::Duration;
use std::time::Instant;

/// Parameters of the service of arm states. Its queue lets a late controller process every missed state, so that the
/// velocity estimate has no gaps.
const STATES: QualityOfService = QualityOfService {
    name: "arm_state",
    writers: 1,
    readers: 1,
    depth: 32,
    overwrite_oldest: true,
};
const COMMANDS: QualityOfService = QualityOfService {
    name: "torque_command",
    writers: 1,
    readers: 1,
    depth: 2,
    overwrite_oldest: true,
};
const WAKE_REQUESTS: QualityOfService = QualityOfService {
    name: "wake_request",
    writers: 1,
    readers: 1,
    depth: 1,
    overwrite_oldest: true,
};
/// Maximum number of messages of other writers that one call discards, so that a fast foreign writer cannot keep the
/// call in its loop.
const MAX_FOREIGN_PER_CALL: u32 = 64;
const STATE_WAKE_SOCKET: &str = "arm_state";
const COMMAND_WAKE_SOCKET: &str = "torque_command";

/// The plant's side of the control path, in `supple-sim` or `supple-can`. Only the thread that created it can use it.
#[derive(Debug)]
pub struct PlantLink {
    // This field is dropped before the writer lock; otherwise it would remove the socket of the next plant.
    wake_receiver: WakeReceiver,
    wake_sender: WakeSender,
    states: Writer<ArmState>,
    commands: Reader<TorqueCommand>,
    wake_requests: Writer<WakeRequest>,
    controller: WriterFilter,
    spin: Duration,
    /// Whether a wake-up was requested and has not been consumed.
    wakeup_pending: Cell<bool>,
    _cleanup: SharedMemoryCleanup,
}

/// Commands that the plant received while it waited for the answer to a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReceivedAnswer {
    /// The answer to the cycle, if it arrived in time.
    pub answer: Option<TorqueCommand>,
    /// Number of answers to earlier cycles, which are discarded.
    pub late: u64,
    /// Whether a wait ended without a wake-up, by its timeout or by a signal.
    pub timed_out: bool,
}

impl PlantLink {
    /// Joins the system as its plant.
    ///
    /// # Errors
    /// [`IpcError::SecondWriter`] if a plant has already joined; other variants of [`IpcError`] if the ports cannot be
    /// opened.
    pub fn new(domain: &Domain) -> Result<PlantLink, IpcError> {
        let bytes = STATES.bytes_of::<ArmState>()
            + WAKE_REQUESTS.bytes_of::<WakeRequest>()
            + COMMANDS.bytes_of_reader();
        let (ports, cleanup) = domain.join(bytes, |node| {
            Ok((
                Writer::new(domain, node, &STATES, Backpressure::Drop)?,
                Reader::new(domain, node, &COMMANDS)?,
                Writer::new(domain, node, &WAKE_REQUESTS, Backpressure::Drop)?,
                WakeReceiver::new(domain, COMMAND_WAKE_SOCKET)?,
            ))
        })?;
        let (states, commands, wake_requests, wake_receiver) = ports;
        Ok(PlantLink {
            states,
            commands,
            wake_requests,
            wake_receiver,
            wake_sender: WakeSender::new(domain, STATE_WAKE_SOCKET)?,
            controller: WriterFilter::of(domain, COMMANDS.name)?,
            spin: Duration::ZERO,
            wakeup_pending: Cell::new(false),
            _cleanup: cleanup,
        })
    }

    /// Sets the time for which [`PlantLink::answer`] polls for the answer before it blocks. Many answers arrive sooner than a
    /// blocked thread can be woken. Polling occupies the processor for up to this time in each cycle.
    pub fn set_spin_duration(&mut self, at_most: Duration) {
        self.spin = at_most;
    }

    /// Publishes the state of a cycle and wakes the controller. Returns whether a controller is connected.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn publish(&self, state: &ArmState) -> Result<bool, IpcError> {
        self.discard_wakeups()?;
        let readers = self.states.send(&ArmState {
            writer: self.states.writer_id(),
            ..*state
        })?;
        self.wake_sender.notify(WakeReason::MessageSent);
        Ok(readers > 0)
    }

    /// Number of commands discarded because this system's controller did not write them.
    pub fn foreign(&self) -> u64 {
        self.controller.dropped()
    }

    /// Returns whether the controller that answered last, or any one before the first answer, has not left; its process may be stopped
    /// or blocked. A controller that joins at this moment may wait a millisecond longer; if this process is stopped at this moment for
    /// longer than 0.2 s, it is refused. Opens no file and allocates no memory.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn has_same_controller(&self) -> Result<bool, IpcError> {
        let has = self.controller.last_writer_exists();
        has.map_err(|error| failed(COMMANDS.name, &error))
    }

    /// Notifies the controller that a state follows within some tens or hundreds of microseconds, so that the controller can do
    /// other work first. Calling this is optional.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn announce(&self) -> Result<(), IpcError> {
        self.discard_wakeups()?;
        self.states.connect()?;
        self.wake_requests.connect()?;
        self.wake_sender.notify(WakeReason::Announced);
        Ok(())
    }

    /// Discards a wake-up that was requested and has not been consumed.
    fn discard_wakeups(&self) -> Result<(), IpcError> {
        match self.wakeup_pending.replace(false) {
            true => self.wake_receiver.discard_wakeups(),
            false => Ok(()),
        }
    }

    /// Waits for the answer to a cycle for at most `timeout`.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn answer(&self, cycle: u64, timeout: Duration) -> Result<ReceivedAnswer, IpcError> {
        self.answer_within(cycle, || timeout)
    }

    /// Waits as [`PlantLink::answer`] does, but evaluates `timeout` only if the answer has not arrived yet. If both processes
    /// share a processor, the answer has usually arrived, and no clock is read.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn answer_within(
        &self,
        cycle: u64,
        timeout: impl FnOnce() -> Duration,
    ) -> Result<ReceivedAnswer, IpcError> {
        let mut received = ReceivedAnswer::default();
        let begun = LazyCell::new(|| (Instant::now(), timeout()));
        let mut wake_requested = false;
        loop {
            for _ in 0..MAX_FOREIGN_PER_CALL {
                let Some(command) = self.commands.receive()? else {
                    break;
                };
                if !self.controller.accepts(command.writer) {
                    continue;
                }
                if command.cycle == cycle {
                    received.answer = Some(TorqueCommand {
                        writer: 0,
                        ..command
                    });
                    return Ok(received);
                }
                received.late += 1;
            }
            let (start, timeout) = *begun;
            let waited = start.elapsed();
            let left = timeout.saturating_sub(waited);
            if left.is_zero() {
                return Ok(received);
            }
            if waited < self.spin {
                core::hint::spin_loop();
                continue;
            }
            if !wake_requested {
                self.wake_requests.send(&WakeRequest { cycle })?;
                fence(Ordering::SeqCst);
                wake_requested = true;
                self.wakeup_pending.set(true);
                continue;
            }
            if self.wake_receiver.wait(left)? {
                wake_requested = false;
                self.wakeup_pending.set(false);
            } else {
                received.timed_out = true;
            }
        }
    }
}

/// Event that ended the controller's wait.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WakeEvent {
    /// The oldest unread state.
    State(ArmState),
    /// A state follows soon, see [`PlantLink::announce`].
    Announced,
    /// Neither a state nor an announcement arrived within the timeout.
    Timeout,
}

/// The controller's side of the control path, in `supple-rt`. Only the thread that created it can use it.
#[derive(Debug)]
pub struct ControllerLink {
    // Field order as in [`PlantLink`]: the socket is dropped before the writer lock.
    wake_receiver: WakeReceiver,
    wake_sender: WakeSender,
    states: Reader<ArmState>,
    commands: Writer<TorqueCommand>,
    wake_requests: Reader<WakeRequest>,
    plant: WriterFilter,
    /// Whether the last read found the queue empty, so that the next state causes a wake-up.
    queue_empty: Cell<bool>,
    _cleanup: SharedMemoryCleanup,
}

impl ControllerLink {
    /// Joins the system as its controller.
    ///
    /// # Errors
    /// [`IpcError::SecondWriter`] if a controller has already joined; other variants of [`IpcError`] if the ports
    /// cannot be opened.
    pub fn new(domain: &Domain) -> Result<ControllerLink, IpcError> {
        let bytes = COMMANDS.bytes_of::<TorqueCommand>()
            + STATES.bytes_of_reader()
            + WAKE_REQUESTS.bytes_of_reader();
        let (ports, cleanup) = domain.join(bytes, |node| {
            Ok((
                Writer::new(domain, node, &COMMANDS, Backpressure::Drop)?,
                // This reader is opened before the reader of states, so that it receives the wake request of every answered state.
                Reader::new(domain, node, &WAKE_REQUESTS)?,
                Reader::new(domain, node, &STATES)?,
                WakeReceiver::new(domain, STATE_WAKE_SOCKET)?,
            ))
        })?;
        let (commands, wake_requests, states, wake_receiver) = ports;
        Ok(ControllerLink {
            commands,
            wake_requests,
            states,
            wake_receiver,
            wake_sender: WakeSender::new(domain, COMMAND_WAKE_SOCKET)?,
            plant: WriterFilter::of(domain, STATES.name)?,
            queue_empty: Cell::new(false),
            _cleanup: cleanup,
        })
    }

    /// Returns the oldest unread state, without waiting.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn receive(&self) -> Result<Option<ArmState>, IpcError> {
        for _ in 0..MAX_FOREIGN_PER_CALL {
            match self.states.receive()? {
                Some(state) if self.plant.accepts(state.writer) => {
                    self.queue_empty.set(false);
                    return Ok(Some(ArmState { writer: 0, ..state }));
                }
                Some(_) => {}
                None => {
                    self.queue_empty.set(true);
                    return Ok(None);
                }
            }
        }
        self.queue_empty.set(false);
        Ok(None)
    }

    /// Number of states discarded because this system's plant did not write them.
    pub fn foreign(&self) -> u64 {
        self.plant.dropped()
    }

    /// Returns the oldest unread state; waits for a state for at most `timeout`, which the kernel rounds to ticks of up to
    /// 10 ms.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn wait(&self, timeout: Duration) -> Result<Option<ArmState>, IpcError> {
        let start = Instant::now();
        loop {
            match self.wait_for_event(timeout.saturating_sub(start.elapsed()))? {
                WakeEvent::State(state) => return Ok(Some(state)),
                WakeEvent::Announced => {}
                WakeEvent::Timeout => return Ok(None),
            }
        }
    }

    /// Waits as [`ControllerLink::wait`] does, but also returns when a state is announced. Reads no clock until the first
    /// spurious wake-up (a signal, or the wake-up of a state that was already read), at which the timeout restarts once.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn wait_for_event(&self, timeout: Duration) -> Result<WakeEvent, IpcError> {
        let mut left = timeout;
        let mut first_spurious_wakeup = None;
        loop {
            // If the queue was empty, this thread blocks at once, so that a plant on the same processor can continue.
            if !self.queue_empty.get() || left.is_zero() {
                match self.receive()? {
                    Some(state) => return Ok(WakeEvent::State(state)),
                    None if left.is_zero() => return Ok(WakeEvent::Timeout),
                    None => {}
                }
            }
            match self.wake_receiver.wait_coarse(left)? {
                WaitResult::Notified(WakeReason::Announced) => {
                    // An additional read delays no process at this point, and loads the cache for the next read.
                    self.queue_empty.set(false);
                    return Ok(WakeEvent::Announced);
                }
                WaitResult::Notified(WakeReason::MessageSent) | WaitResult::SignalReceived => {
                    if let Some(state) = self.receive()? {
                        return Ok(WakeEvent::State(state));
                    }
                    let since = *first_spurious_wakeup.get_or_insert_with(Instant::now);
                    left = timeout.saturating_sub(since.elapsed());
                }
                WaitResult::TimedOut => left = Duration::ZERO,
            }
        }
    }

    /// Publishes the answer to a state, and wakes the plant if the plant is blocked.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn answer(&self, command: &TorqueCommand) -> Result<(), IpcError> {
        self.commands.send(&TorqueCommand {
            writer: self.commands.writer_id(),
            ..*command
        })?;
        fence(Ordering::SeqCst);
        if self.wake_requests.receive()?.is_some() {
            self.wake_sender.notify(WakeReason::MessageSent);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{Drives, PlantReport};
    use core::sync::atomic::AtomicBool;

    const TIMEOUT: Duration = Duration::from_secs(5);

    fn command(cycle: u64) -> TorqueCommand {
        TorqueCommand {
            writer: 0,
            cycle,
            torque_nm: Default::default(),
            fallback_torque_nm: Default::default(),
            dof: 4,
            mode: 0,
            fault: 0,
            safe_action: 0,
            drives: Drives::Idle as u8,
            reserved: Default::default(),
        }
    }

    #[test]
    fn plant_is_woken_only_while_blocked() {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::in_folder(&folder.path().join("run"), "asleep").expect("a domain");
        let plant = PlantLink::new(&domain).expect("a plant");
        let controller = ControllerLink::new(&domain).expect("a controller");
        for (cycle, blocked) in [(0, false), (1, true), (2, false), (3, true), (4, true)] {
            let report = PlantReport::default();
            let state = ArmState::new(cycle, 0, &[Some(0.0); 4], None, Drives::Idle, report);
            plant.publish(&state).expect("published");
            if blocked {
                let received = plant.answer(cycle, Duration::from_millis(1)).expect("read");
                assert_eq!((received.answer, received.timed_out), (None, true));
            }
            assert_eq!(controller.wait(TIMEOUT).expect("read"), Some(state));
            let command = command(cycle);
            controller.answer(&command).expect("answered");
            assert_eq!(
                plant.wake_receiver.wait(Duration::ZERO).expect("waited"),
                blocked,
                "cycle {cycle}"
            );
            let received = plant.answer(cycle, TIMEOUT).expect("read");
            assert_eq!(received.answer, Some(command));
        }
    }

    #[test]
    fn a_controller_is_the_same_until_it_leaves() {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::in_folder(&folder.path().join("run"), "same").expect("a domain");
        let plant = PlantLink::new(&domain).expect("a plant");
        let has = || plant.has_same_controller().expect("read");
        assert!(!has());
        let first = ControllerLink::new(&domain).expect("a controller");
        assert!(has(), "none has answered yet");
        first.answer(&command(0)).expect("answered");
        let received = plant.answer(0, TIMEOUT).expect("read");
        assert_eq!(received.answer, Some(command(0)));
        assert!(has());
        drop(first);
        assert!(!has());
        let second = ControllerLink::new(&domain).expect("a controller");
        assert!(!has(), "another one has replaced it");
        second.answer(&command(1)).expect("answered");
        let received = plant.answer(1, TIMEOUT).expect("read");
        assert_eq!(received.answer, Some(command(1)));
        assert!(has());
    }

    #[test]
    fn spurious_wakeups_at_most_double_the_timeout() {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::in_folder(&folder.path().join("run"), "spurious").expect("a domain");
        let controller = ControllerLink::new(&domain).expect("a controller");
        let received = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let wake_sender =
                    WakeSender::new(&domain, STATE_WAKE_SOCKET).expect("a wake_sender");
                while !received.load(Ordering::Relaxed) {
                    wake_sender.notify(WakeReason::MessageSent);
                    supple_realtime::pause(Duration::from_millis(2));
                }
            });
            let woken = controller
                .wait_for_event(Duration::from_millis(50))
                .expect("read");
            received.store(true, Ordering::Relaxed);
            assert_eq!(woken, WakeEvent::Timeout);
        });
    }
}
