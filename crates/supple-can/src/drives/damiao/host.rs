//! Requests to one motor at a time during start-up, with retries and timeouts.

use super::error::DamiaoError;
use supple_bus::{Bus, BusFault, Event};
use supple_can_frame::FrameFormat;
use supple_damiao::feedback::Feedback;
use supple_damiao::frame::Frame;
use supple_damiao::refusal::Problem;
use supple_damiao::register::{self, Operation, Register, RegisterReply, Value};
use supple_damiao::special::SpecialCommand;

/// One millisecond \[ns\].
pub const MS: u64 = 1_000_000;
/// Maximum number of times that a request is sent.
const MAX_ATTEMPTS: u32 = 3;
/// Timeout of a reply \[ns\].
const REPLY_TIMEOUT_NS: u64 = 5 * MS;
/// Pause before a feedback request or a special frame is repeated \[ns\]; a register request is repeated at once.
const RETRY_NS: u64 = 100 * MS;

/// The host's access to the bus during start-up.
pub struct Host<'a, B> {
    /// The bus.
    pub bus: &'a mut B,
    /// Format of the frames.
    pub format: FrameFormat,
    /// Shutdown request: start-up calls it after each pause and ends if it returns `true`.
    pub stop: &'a dyn Fn() -> bool,
}

/// A frame that a motor sent.
struct ReceivedFrame {
    frame: Frame,
    fd: bool,
}

impl<B: Bus> Host<'_, B> {
    /// Receives and discards all frames for this time.
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

    /// Requests the feedback of a motor without a command.
    ///
    /// # Errors
    /// The outer error means that the bus failed or a shutdown was requested. The inner error is the [`Problem`] of a motor
    /// that does not answer, or not as expected.
    pub fn feedback(
        &mut self,
        id: u8,
        reply_id: u16,
    ) -> Result<Result<Feedback, Problem>, DamiaoError> {
        self.request_feedback(id, reply_id, &register::request_feedback(id))
    }

    /// Sends a special frame (enable, disable, clear an error) and returns the feedback in the motor's reply.
    ///
    /// # Errors
    /// The same as those of [`Host::feedback`].
    pub fn special(
        &mut self,
        id: u8,
        reply_id: u16,
        special: SpecialCommand,
    ) -> Result<Result<Feedback, Problem>, DamiaoError> {
        self.request_feedback(id, reply_id, &special.emit(id))
    }

    fn request_feedback(
        &mut self,
        id: u8,
        reply_id: u16,
        request: &Frame,
    ) -> Result<Result<Feedback, Problem>, DamiaoError> {
        let mut other = None;
        for attempt in 0..MAX_ATTEMPTS {
            if attempt > 0 {
                self.discard(RETRY_NS)?;
            }
            self.bus.send(&request.on_bus(self.format))?;
            let until_ns = self.bus.now_ns() + REPLY_TIMEOUT_NS;
            let mut found: Option<Feedback> = None;
            while let Some(received) = self.next(until_ns)? {
                if received.frame.id() == reply_id
                    && received.fd != matches!(self.format, FrameFormat::Fd { .. })
                {
                    return Ok(Err(Problem::FormatMismatch {
                        found_fd: received.fd,
                    }));
                }
                if received.frame.id() != reply_id {
                    other = Some(Problem::ReplyIdMismatch {
                        found: received.frame.id(),
                        expected: reply_id,
                    });
                    continue;
                }
                match Feedback::of_motor(&received.frame, id) {
                    _ if found.is_some() => return Ok(Err(Problem::TwoAnswers)),
                    Ok(feedback) => found = Some(feedback),
                    Err(error) => return Ok(Err(Problem::ForeignFeedback(error))),
                }
            }
            if let Some(feedback) = found {
                return Ok(Ok(feedback));
            }
        }
        Ok(Err(other.unwrap_or(Problem::Silent)))
    }

    /// Reads a register; returns `None` if the motor does not answer.
    ///
    /// # Errors
    /// If the bus fails.
    pub fn read(
        &mut self,
        id: u8,
        reply_id: u16,
        of: Register,
    ) -> Result<Option<[u8; 4]>, DamiaoError> {
        let request = register::read(id, of);
        self.access_register(id, reply_id, &request, Operation::Read, of)
    }

    /// Writes a register in RAM; returns `None` if the motor does not answer or the register cannot be written. The caller
    /// reads the register back.
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
        let Ok(request) = register::write(id, of, Value::Integer(value)) else {
            return Ok(None);
        };
        self.access_register(id, reply_id, &request, Operation::Write, of)
    }

    fn access_register(
        &mut self,
        id: u8,
        reply_id: u16,
        request: &Frame,
        operation: Operation,
        of: Register,
    ) -> Result<Option<[u8; 4]>, DamiaoError> {
        for _ in 0..MAX_ATTEMPTS {
            self.bus.send(&request.on_bus(self.format))?;
            let until_ns = self.bus.now_ns() + REPLY_TIMEOUT_NS;
            while let Some(received) = self.next(until_ns)? {
                let reply = RegisterReply::parse(&received.frame, id, operation, of);
                if let Some(reply) = reply.filter(|_| received.frame.id() == reply_id) {
                    return Ok(Some(reply.bytes));
                }
            }
        }
        Ok(None)
    }

    /// Returns the next frame of another node.
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
