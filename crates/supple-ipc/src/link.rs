//! The control path: arm states one way, torque commands the other, a bell for each.
//!
//! The plant owns the clock: it publishes a state and rings, the controller answers with the command of the
//! same cycle and rings back. Neither waits for the other without a bound.

use crate::domain::Domain;
use crate::error::IpcError;
use crate::last_out::LastOut;
use crate::message::{ArmState, TorqueCommand};
use crate::port::{Bell, Full, Reader, Rope, Terms, Writer};
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
const STATE_BELL: &str = "arm_state_bell";
const COMMAND_BELL: &str = "torque_command_bell";

/// The plant's end, of `supple-sim` or `supple-can`. It stays in the thread that made it.
#[derive(Debug)]
pub struct PlantLink {
    states: Writer<ArmState>,
    commands: Reader<TorqueCommand>,
    rope: Rope,
    bell: Bell,
    spin: Duration,
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
        let joining = domain.join()?;
        Ok(PlantLink {
            states: Writer::new(domain, &joining.node, &STATES, Full::Lose)?,
            commands: Reader::new(domain, &joining.node, &COMMANDS)?,
            rope: Rope::new(domain, &joining.node, STATE_BELL)?,
            bell: Bell::new(&joining.node, COMMAND_BELL)?,
            spin: Duration::ZERO,
            _last_out: LastOut::of(domain),
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
        let readers = self.states.send(state)?;
        self.rope.ring();
        Ok(readers > 0)
    }

    /// Waits for the answer to a cycle, at most for `timeout`.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn answer(&self, cycle: u64, timeout: Duration) -> Result<Heard, IpcError> {
        let mut heard = Heard::default();
        let start = Instant::now();
        let mut slept = false;
        loop {
            while let Some(command) = self.commands.receive()? {
                match command.cycle {
                    answered if answered == cycle => heard.answer = Some(command),
                    _ => heard.late += 1,
                }
            }
            let waited = start.elapsed();
            let left = timeout.saturating_sub(waited);
            if heard.answer.is_some() || left.is_zero() {
                if !slept {
                    self.bell.silence()?;
                }
                return Ok(heard);
            }
            if waited < self.spin {
                core::hint::spin_loop();
                continue;
            }
            slept = true;
            self.bell.wait(left)?;
        }
    }
}

/// The controller's end, of `supple-rt`. It stays in the thread that made it.
#[derive(Debug)]
pub struct ControllerLink {
    states: Reader<ArmState>,
    commands: Writer<TorqueCommand>,
    rope: Rope,
    bell: Bell,
    _last_out: LastOut,
}

impl ControllerLink {
    /// Takes the controller's place in a system.
    ///
    /// # Errors
    /// [`IpcError::SecondWriter`] where there is a controller already, and what else [`IpcError`] says.
    pub fn new(domain: &Domain) -> Result<ControllerLink, IpcError> {
        let joining = domain.join()?;
        Ok(ControllerLink {
            commands: Writer::new(domain, &joining.node, &COMMANDS, Full::Lose)?,
            states: Reader::new(domain, &joining.node, &STATES)?,
            rope: Rope::new(domain, &joining.node, COMMAND_BELL)?,
            bell: Bell::new(&joining.node, STATE_BELL)?,
            _last_out: LastOut::of(domain),
        })
    }

    /// The oldest state that was not read yet, without waiting.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn receive(&self) -> Result<Option<ArmState>, IpcError> {
        self.states.receive()
    }

    /// The oldest state that was not read yet; waits for one at most for `timeout`, which the kernel counts in
    /// ticks of up to 10 ms.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn wait(&self, timeout: Duration) -> Result<Option<ArmState>, IpcError> {
        let start = Instant::now();
        loop {
            if let Some(state) = self.states.receive()? {
                return Ok(Some(state));
            }
            let left = timeout.saturating_sub(start.elapsed());
            if left.is_zero() {
                return Ok(None);
            }
            self.bell.wait_in_ticks(left)?;
        }
    }

    /// Publishes the answer to a state and wakes the plant.
    ///
    /// # Errors
    /// [`IpcError::Service`].
    pub fn answer(&self, command: &TorqueCommand) -> Result<(), IpcError> {
        self.commands.send(command)?;
        self.rope.ring();
        Ok(())
    }
}
