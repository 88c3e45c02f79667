//! Questions to one motor at a time during start-up, with tries and deadlines.

use super::error::DamiaoError;
use supple_bus::{Bus, BusFault, Event};
use supple_can_frame::FrameFormat;
use supple_damiao::feedback::Feedback;
use supple_damiao::frame::Frame;
use supple_damiao::refusal::Problem;
use supple_damiao::register::{self, Operation, Register, RegisterReply, Value};
use supple_damiao::special::Special;

/// One millisecond \[ns\].
pub const MS: u64 = 1_000_000;
/// Tries of a question.
const TRIES: u32 = 3;
/// Deadline of a reply \[ns\].
const REPLY_NS: u64 = 5 * MS;
/// Pause before a feedback request or a special frame is sent again \[ns\]; requests of registers are repeated at once.
const RETRY_NS: u64 = 100 * MS;

/// The host's end of the bus during start-up.
pub struct Host<'a, B> {
    /// The bus.
    pub bus: &'a mut B,
    /// Format of the frames.
    pub format: FrameFormat,
    /// Called after each pause; `true` ends the start-up.
    pub stop: &'a dyn Fn() -> bool,
}

/// A frame that a motor sent.
struct ReceivedFrame {
    frame: Frame,
    fd: bool,
}

impl<B: Bus> Host<'_, B> {
    /// Receives and drops all frames for this time.
    ///
    /// # Errors
    /// If the bus fails, or a shutdown is requested.
    pub fn discard(&mut self, duration_ns: u64) -> Result<(), DamiaoError> {
        let until_ns = self.bus.now_ns() + duration_ns;
        while self.next(until_ns)?.is_some() {}
        if (self.stop)() {
            return Err(DamiaoError::Stopped);
        }
        Ok(())
    }

    /// The feedback of a motor, without a command.
    ///
    /// # Errors
    /// Outer: the bus fails, or a shutdown is requested. Inner: the [`Problem`] of a motor that does not answer, or not as
    /// expected.
    pub fn feedback(
        &mut self,
        id: u8,
        reply_id: u16,
    ) -> Result<Result<Feedback, Problem>, DamiaoError> {
        self.ask(id, reply_id, &register::ask_feedback(id))
    }

    /// Sends a special frame (enable, disable, clear an error) and returns the feedback to it.
    ///
    /// # Errors
    /// As [`Host::feedback`].
    pub fn special(
        &mut self,
        id: u8,
        reply_id: u16,
        special: Special,
    ) -> Result<Result<Feedback, Problem>, DamiaoError> {
        self.ask(id, reply_id, &special.emit(id))
    }

    fn ask(
        &mut self,
        id: u8,
        reply_id: u16,
        question: &Frame,
    ) -> Result<Result<Feedback, Problem>, DamiaoError> {
        let mut other = None;
        for attempt in 0..TRIES {
            if attempt > 0 {
                self.discard(RETRY_NS)?;
            }
            self.bus.send(&question.on_bus(self.format))?;
            let until_ns = self.bus.now_ns() + REPLY_NS;
            let mut found: Option<Feedback> = None;
            while let Some(received) = self.next(until_ns)? {
                if received.frame.id() == reply_id
                    && received.fd != matches!(self.format, FrameFormat::Fd { .. })
                {
                    return Ok(Err(Problem::Format {
                        found_fd: received.fd,
                    }));
                }
                if received.frame.id() != reply_id {
                    other = Some(Problem::ReplyId {
                        found: received.frame.id(),
                        expected: reply_id,
                    });
                    continue;
                }
                match Feedback::of_motor(&received.frame, id) {
                    _ if found.is_some() => return Ok(Err(Problem::TwoAnswers)),
                    Ok(feedback) => found = Some(feedback),
                    Err(error) => return Ok(Err(Problem::Reply(error))),
                }
            }
            if let Some(feedback) = found {
                return Ok(Ok(feedback));
            }
        }
        Ok(Err(other.unwrap_or(Problem::Silent)))
    }

    /// Reads a register; `None` if it does not answer.
    ///
    /// # Errors
    /// If the bus fails.
    pub fn read(
        &mut self,
        id: u8,
        reply_id: u16,
        of: Register,
    ) -> Result<Option<[u8; 4]>, DamiaoError> {
        let question = register::read(id, of);
        self.register(id, reply_id, &question, Operation::Read, of)
    }

    /// Writes a register in RAM; `None` if the motor does not answer, or the register cannot be written. The caller reads
    /// it back.
    ///
    /// # Errors
    /// If the bus fails.
    pub fn write(
        &mut self,
        id: u8,
        reply_id: u16,
        of: Register,
        value: u32,
    ) -> Result<Option<[u8; 4]>, DamiaoError> {
        let Ok(question) = register::write(id, of, Value::Integer(value)) else {
            return Ok(None);
        };
        self.register(id, reply_id, &question, Operation::Write, of)
    }

    fn register(
        &mut self,
        id: u8,
        reply_id: u16,
        question: &Frame,
        operation: Operation,
        of: Register,
    ) -> Result<Option<[u8; 4]>, DamiaoError> {
        for _ in 0..TRIES {
            self.bus.send(&question.on_bus(self.format))?;
            let until_ns = self.bus.now_ns() + REPLY_NS;
            while let Some(received) = self.next(until_ns)? {
                let reply = RegisterReply::parse(&received.frame, id, operation, of);
                if let Some(reply) = reply.filter(|_| received.frame.id() == reply_id) {
                    return Ok(Some(reply.bytes));
                }
            }
        }
        Ok(None)
    }

    /// The next frame of another node.
    fn next(&mut self, until_ns: u64) -> Result<Option<ReceivedFrame>, DamiaoError> {
        loop {
            match self.bus.receive_until(until_ns)? {
                None => return Ok(None),
                Some(Event::Frame(frame)) => {
                    if let Ok(parsed) = Frame::of_bus(&frame) {
                        let fd = frame.is_fd();
                        return Ok(Some(ReceivedFrame { frame: parsed, fd }));
                    }
                }
                Some(Event::Fault(fault @ BusFault::BusOff)) => {
                    return Err(DamiaoError::BusFault(fault));
                }
                Some(Event::Sent(_) | Event::Fault(_)) => {}
            }
        }
    }
}
