//! Sends requests to motors, one motor at a time.

use supple_bus::{Address, Bus, BusError, Event, OwnerFolder, PacedBus, SocketCan};
use supple_can_frame::FrameFormat;
use supple_cli::exit::Failure;
use supple_damiao::register::{self, Operation};
use supple_damiao::{Feedback, Frame, Register, RegisterReply, SpecialCommand, Value, flash};
use supple_model::{BusDescription, BusFormat};

/// Time for which replies are collected \[ns\]; a host in real time is not always scheduled within a millisecond.
const ANSWER_NS: u64 = 10_000_000;
/// Time that a motor needs to store its registers \[ns\].
const STORE_NS: u64 = 50_000_000;
/// Number of requests after which a motor counts as silent.
const MAX_ATTEMPTS: usize = 3;

/// The bus of an arm whose motors are disabled.
pub(super) struct MotorBus {
    bus: Box<dyn Bus>,
    format: FrameFormat,
    address: String,
}

impl MotorBus {
    /// Opens the bus.
    pub fn open(address: &Address, described: &BusDescription) -> Result<MotorBus, Failure> {
        let named = address.to_string();
        let failed = |error: BusError| Failure::Motors {
            problem: format!("{named}: {error}"),
        };
        let bus: Box<dyn Bus> = match address {
            Address::Interface(name) => Box::new(SocketCan::open(name).map_err(failed)?),
            Address::Folder(folder) => {
                let folder = OwnerFolder::open(folder.clone()).map_err(failed)?;
                Box::new(PacedBus::open(&folder).map_err(failed)?)
            }
        };
        let format = match described.format {
            BusFormat::Classic => FrameFormat::Classic,
            BusFormat::Fd => FrameFormat::Fd {
                bit_rate_switch: true,
            },
        };
        Ok(MotorBus {
            bus,
            format,
            address: named,
        })
    }

    fn failed(&self, error: BusError) -> Failure {
        let address = &self.address;
        Failure::Motors {
            problem: format!("{address}: {error}"),
        }
    }

    /// Sends a frame and collects received frames until `for_ns` have passed, or `enough` returns true.
    fn exchange(
        &mut self,
        frame: &Frame,
        for_ns: u64,
        enough: &dyn Fn(&Frame) -> bool,
    ) -> Result<Vec<Frame>, Failure> {
        let sent = self.bus.send(&frame.on_bus(self.format));
        sent.map_err(|error| self.failed(error))?;
        let until_ns = self.bus.now_ns() + for_ns;
        let mut frames = Vec::new();
        loop {
            let event = self.bus.receive_until(until_ns);
            match event.map_err(|error| self.failed(error))? {
                None => return Ok(frames),
                Some(Event::Frame(frame)) => {
                    let Ok(frame) = Frame::of_bus(&frame) else {
                        continue;
                    };
                    frames.push(frame);
                    if enough(&frame) {
                        return Ok(frames);
                    }
                }
                Some(_) => {}
            }
        }
    }

    /// Requests feedback; returns all replies with their ids: none, one, or two if two motors have the same id.
    pub fn feedback(&mut self, id: u8) -> Result<Vec<(u16, Feedback)>, Failure> {
        for _ in 0..MAX_ATTEMPTS {
            let frames = self.exchange(&register::request_feedback(id), ANSWER_NS, &|_| false)?;
            let found: Vec<_> = frames
                .iter()
                .filter_map(|frame| Some((frame.id(), Feedback::of_motor(frame, id).ok()?)))
                .collect();
            if !found.is_empty() {
                return Ok(found);
            }
        }
        Ok(Vec::new())
    }

    /// Reads a register; returns `None` if the motor does not answer.
    pub fn read(&mut self, id: u8, register: Register) -> Result<Option<Value>, Failure> {
        let parse = |frame: &Frame| RegisterReply::parse(frame, id, Operation::Read, register);
        for _ in 0..MAX_ATTEMPTS {
            let frame = register::read(id, register);
            let frames = self.exchange(&frame, ANSWER_NS, &|frame| parse(frame).is_some())?;
            if let Some(reply) = frames.iter().find_map(parse) {
                return Ok(Some(reply.value()));
            }
        }
        Ok(None)
    }

    /// Writes a register, twice because some motors ignore the first write, and reads it back. A new id is read
    /// back under that id.
    pub fn write(
        &mut self,
        id: u8,
        register: Register,
        value: Value,
    ) -> Result<Option<Value>, Failure> {
        let frame = register::write(id, register, value).map_err(|error| Failure::Motors {
            problem: format!("motor {id}: {error}"),
        })?;
        for _ in 0..2 {
            self.exchange(&frame, ANSWER_NS, &|_| true)?;
        }
        let id = match (register, value) {
            (Register::ID, Value::Integer(new)) => u8::try_from(new).unwrap_or(id),
            _ => id,
        };
        self.read(id, register)
    }

    /// Clears a latched error.
    pub fn clear_error(&mut self, id: u8) -> Result<(), Failure> {
        self.exchange(&SpecialCommand::ClearError.emit(id), ANSWER_NS, &|_| true)
            .map(|_| ())
    }

    /// Stores all registers of a motor in its flash.
    pub fn store(&mut self, id: u8) -> Result<(), Failure> {
        self.exchange(&flash::store_all(id), STORE_NS, &|_| false)
            .map(|_| ())
    }
}
