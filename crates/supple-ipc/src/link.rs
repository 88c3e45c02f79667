//! The control path: arm states one way, torque commands the other, a bell for each.
//!
//! The plant owns the clock: it publishes a state and rings, the controller answers with the command of the
//! same cycle. Neither waits for the other without a bound. Where both share a processor, whatever
//! the controller does between its answer and its sleep keeps the plant waiting: so the plant rings before a state
//! too, when there is time for everything else, and is rung back only where it said that it goes to sleep. It says so
//! before it does, and looks once more: of the answer and the word, one always comes in time for the other.

use crate::bell::{Awoken, Bell, Ring, Rope};
use crate::domain::Domain;
use crate::error::IpcError;
use crate::last_out::LastOut;
use crate::message::{ArmState, PlantAsleep, TorqueCommand};
use crate::port::{Full, Reader, Terms, Writer};
use crate::writer_identity::KnownWriter;
use core::cell::{Cell, LazyCell};
use core::sync::atomic::{Ordering, fence};
use core::time::Duration;
use std::time::Instant;

/// A controller that lags catches up state by state, without a hole in its velocity estimate.
const STATES: Terms = Terms {
    name: "arm_state",
    writers: 1,
    readers: 1,
    depth: 32,
    oldest_goes: true,
};
const COMMANDS: Terms = Terms {
    name: "torque_command",
    writers: 1,
    readers: 1,
    depth: 2,
    oldest_goes: true,
};
const ASLEEP: Terms = Terms {
    name: "plant_asleep",
    writers: 1,
    readers: 1,
    depth: 1,
    oldest_goes: true,
};
/// Messages of others that are passed over in one look: they may write as fast as they like.
const MOST_FOREIGN: u32 = 64;
const STATE_BELL: &str = "arm_state";
const COMMAND_BELL: &str = "torque_command";

/// The plant's end, of `supple-sim` or `supple-can`. It stays in the thread that made it.
#[derive(Debug)]
pub struct PlantLink {
    // Given up before the place is: the bell of the next is not to be taken away.
    bell: Bell,
    rope: Rope,
    states: Writer<ArmState>,
    commands: Reader<TorqueCommand>,
    asleep: Writer<PlantAsleep>,
    controller: KnownWriter,
    spin: Duration,
    /// A ring was asked for that was not waited for.
    rung: Cell<bool>,
    _last_out: LastOut,
}

/// What a plant heard while it waited for the answer of a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Heard {
    /// The answer to the cycle, if it came in time.
    pub answer: Option<TorqueCommand>,
    /// Answers to earlier cycles that came only now.
    pub late: u64,
}

impl PlantLink {
    /// Takes the plant's place in a system.
    ///
    /// # Errors
    /// [`IpcError::SecondWriter`] where there is a plant already, and what else [`IpcError`] says.
    pub fn new(domain: &Domain) -> Result<PlantLink, IpcError> {
        let bytes = STATES.bytes_of::<ArmState>()
            + ASLEEP.bytes_of::<PlantAsleep>()
            + COMMANDS.bytes_of_reader();
        let (ports, last_out) = domain.join(bytes, |node| {
            Ok((
                Writer::new(domain, node, &STATES, Full::Lose)?,
                Reader::new(domain, node, &COMMANDS)?,
                Writer::new(domain, node, &ASLEEP, Full::Lose)?,
                Bell::new(domain, COMMAND_BELL)?,
            ))
        })?;
        let (states, commands, asleep, bell) = ports;
        Ok(PlantLink {
            states,
            commands,
            asleep,
            bell,
            rope: Rope::new(domain, STATE_BELL)?,
            controller: KnownWriter::of(domain, COMMANDS.name)?,
            spin: Duration::ZERO,
            rung: Cell::new(false),
            _last_out: last_out,
        })
    }

    /// From now on an answer is looked for again and again, for so long after it begins to wait, before the
    /// thread sleeps until the bell: to be woken takes longer than many an answer. It costs the processor that
    /// time of each cycle.
    pub fn spin(&mut self, at_most: Duration) {
        self.spin = at_most;
    }

    /// Publishes the state of a cycle and wakes the controller. Gives whether there is one to read it.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn publish(&self, state: &ArmState) -> Result<bool, IpcError> {
        self.silence()?;
        let readers = self.states.send(&ArmState {
            writer: self.states.number(),
            ..*state
        })?;
        self.rope.ring(Ring::Sent);
        Ok(readers > 0)
    }

    /// Commands that were dropped because this system's controller did not write them.
    pub fn foreign(&self) -> u64 {
        self.controller.dropped()
    }

    /// Tells the controller that a state follows within some tens or hundreds of microseconds: what it has to do
    /// besides it does best now, while nobody waits for it. It may be left out.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn announce(&self) -> Result<(), IpcError> {
        self.silence()?;
        self.states.connect()?;
        self.asleep.connect()?;
        self.rope.ring(Ring::Announced);
        Ok(())
    }

    /// Forgets a ring that was not waited for.
    fn silence(&self) -> Result<(), IpcError> {
        match self.rung.replace(false) {
            true => self.bell.silence(),
            false => Ok(()),
        }
    }

    /// Waits for the answer to a cycle, at most for `timeout`.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn answer(&self, cycle: u64, timeout: Duration) -> Result<Heard, IpcError> {
        self.answer_within(cycle, || timeout)
    }

    /// As [`PlantLink::answer`], but how long to wait is asked only where the answer is not there already: it is most
    /// of the time where both share a processor, and no clock has to be read then.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn answer_within(
        &self,
        cycle: u64,
        timeout: impl FnOnce() -> Duration,
    ) -> Result<Heard, IpcError> {
        let mut heard = Heard::default();
        let begun = LazyCell::new(|| (Instant::now(), timeout()));
        let mut told = false;
        loop {
            for _ in 0..MOST_FOREIGN {
                let Some(command) = self.commands.receive()? else {
                    break;
                };
                if !self.controller.wrote(command.writer) {
                    continue;
                }
                if command.cycle == cycle {
                    heard.answer = Some(TorqueCommand {
                        writer: 0,
                        ..command
                    });
                    return Ok(heard);
                }
                heard.late += 1;
            }
            let (start, timeout) = *begun;
            let waited = start.elapsed();
            let left = timeout.saturating_sub(waited);
            if left.is_zero() {
                return Ok(heard);
            }
            if waited < self.spin {
                core::hint::spin_loop();
                continue;
            }
            if !told {
                self.asleep.send(&PlantAsleep { cycle })?;
                fence(Ordering::SeqCst);
                told = true;
                self.rung.set(true);
                continue;
            }
            if self.bell.wait(left)? {
                told = false;
                self.rung.set(false);
            }
        }
    }
}

/// What woke a controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Woken {
    /// The oldest state that was not read yet.
    State(ArmState),
    /// A state follows soon, see [`PlantLink::announce`].
    Announced,
    /// Nothing.
    Silence,
}

/// The controller's end, of `supple-rt`. It stays in the thread that made it.
#[derive(Debug)]
pub struct ControllerLink {
    // As with the plant.
    bell: Bell,
    rope: Rope,
    states: Reader<ArmState>,
    commands: Writer<TorqueCommand>,
    asleep: Reader<PlantAsleep>,
    plant: KnownWriter,
    /// There was no state left, so that the next one has its ring yet to come.
    read_all: Cell<bool>,
    _last_out: LastOut,
}

impl ControllerLink {
    /// Takes the controller's place in a system.
    ///
    /// # Errors
    /// [`IpcError::SecondWriter`] where there is a controller already, and what else [`IpcError`] says.
    pub fn new(domain: &Domain) -> Result<ControllerLink, IpcError> {
        let bytes = COMMANDS.bytes_of::<TorqueCommand>()
            + STATES.bytes_of_reader()
            + ASLEEP.bytes_of_reader();
        let (ports, last_out) = domain.join(bytes, |node| {
            Ok((
                Writer::new(domain, node, &COMMANDS, Full::Lose)?,
                // Before the states: who waits for the answer to one is heard.
                Reader::new(domain, node, &ASLEEP)?,
                Reader::new(domain, node, &STATES)?,
                Bell::new(domain, STATE_BELL)?,
            ))
        })?;
        let (commands, asleep, states, bell) = ports;
        Ok(ControllerLink {
            commands,
            asleep,
            states,
            bell,
            rope: Rope::new(domain, COMMAND_BELL)?,
            plant: KnownWriter::of(domain, STATES.name)?,
            read_all: Cell::new(false),
            _last_out: last_out,
        })
    }

    /// The oldest state that was not read yet, without waiting.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn receive(&self) -> Result<Option<ArmState>, IpcError> {
        for _ in 0..MOST_FOREIGN {
            match self.states.receive()? {
                Some(state) if self.plant.wrote(state.writer) => {
                    self.read_all.set(false);
                    return Ok(Some(ArmState { writer: 0, ..state }));
                }
                Some(_) => {}
                None => {
                    self.read_all.set(true);
                    return Ok(None);
                }
            }
        }
        self.read_all.set(false);
        Ok(None)
    }

    /// States that were dropped because this system's plant did not write them.
    pub fn foreign(&self) -> u64 {
        self.plant.dropped()
    }

    /// The oldest state that was not read yet; waits for one at most for `timeout`, which the kernel counts in
    /// ticks of up to 10 ms.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn wait(&self, timeout: Duration) -> Result<Option<ArmState>, IpcError> {
        let start = Instant::now();
        loop {
            match self.wake(timeout.saturating_sub(start.elapsed()))? {
                Woken::State(state) => return Ok(Some(state)),
                Woken::Announced => {}
                Woken::Silence => return Ok(None),
            }
        }
    }

    /// As [`ControllerLink::wait`], but wakes too when a state is announced. It reads no clock before it was woken in
    /// vain, by a signal or the ring of a state that was read already: the time counts anew from the first of them.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn wake(&self, timeout: Duration) -> Result<Woken, IpcError> {
        let mut left = timeout;
        let mut in_vain_since = None;
        loop {
            // Whoever has read all goes to sleep at once, and the plant on his processor goes on.
            if !self.read_all.get() || left.is_zero() {
                match self.receive()? {
                    Some(state) => return Ok(Woken::State(state)),
                    None if left.is_zero() => return Ok(Woken::Silence),
                    None => {}
                }
            }
            match self.bell.wait_in_ticks(left)? {
                Awoken::By(Ring::Announced) => {
                    // To look once more costs nobody anything now, and makes the next look quicker.
                    self.read_all.set(false);
                    return Ok(Woken::Announced);
                }
                Awoken::By(Ring::Sent) | Awoken::BySignal => {
                    if let Some(state) = self.receive()? {
                        return Ok(Woken::State(state));
                    }
                    let since = *in_vain_since.get_or_insert_with(Instant::now);
                    left = timeout.saturating_sub(since.elapsed());
                }
                Awoken::InVain => left = Duration::ZERO,
            }
        }
    }

    /// Publishes the answer to a state and wakes the plant where it sleeps.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn answer(&self, command: &TorqueCommand) -> Result<(), IpcError> {
        self.commands.send(&TorqueCommand {
            writer: self.commands.number(),
            ..*command
        })?;
        fence(Ordering::SeqCst);
        if self.asleep.receive()?.is_some() {
            self.rope.ring(Ring::Sent);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{Drives, PlantReport};
    use core::sync::atomic::AtomicBool;

    const SOON: Duration = Duration::from_secs(5);

    #[test]
    fn a_plant_is_rung_where_it_said_that_it_sleeps_and_only_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::within(&folder.path().join("run"), "asleep").expect("a domain");
        let plant = PlantLink::new(&domain).expect("a plant");
        let controller = ControllerLink::new(&domain).expect("a controller");
        for (cycle, asleep) in [(0, false), (1, true), (2, false), (3, true), (4, true)] {
            let report = PlantReport::default();
            let state = ArmState::new(cycle, 0, &[Some(0.0); 4], None, Drives::Idle, report);
            plant.publish(&state).expect("published");
            if asleep {
                let in_vain = plant.answer(cycle, Duration::from_millis(1)).expect("read");
                assert_eq!(in_vain, Heard::default());
            }
            assert_eq!(controller.wait(SOON).expect("read"), Some(state));
            let command = TorqueCommand {
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
            };
            controller.answer(&command).expect("answered");
            assert_eq!(
                plant.bell.wait(Duration::ZERO).expect("heard"),
                asleep,
                "cycle {cycle}"
            );
            let heard = plant.answer(cycle, SOON).expect("read");
            assert_eq!(heard.answer, Some(command));
        }
    }

    #[test]
    fn rings_without_a_state_hold_a_controller_no_longer_than_twice_its_patience() {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::within(&folder.path().join("run"), "rings").expect("a domain");
        let controller = ControllerLink::new(&domain).expect("a controller");
        let heard = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let rope = Rope::new(&domain, STATE_BELL).expect("a rope");
                while !heard.load(Ordering::Relaxed) {
                    rope.ring(Ring::Sent);
                    crate::outside::pause(Duration::from_millis(2));
                }
            });
            let woken = controller.wake(Duration::from_millis(50)).expect("read");
            heard.store(true, Ordering::Relaxed);
            assert_eq!(woken, Woken::Silence);
        });
    }
}
