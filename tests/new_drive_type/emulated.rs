//! Emulated moteus motors that move a simulated arm: registers, modes, watchdog, one reply per command.

use core::f64::consts::TAU;
use moteus_protocol::Mode;
use std::collections::VecDeque;
use supple_bus::Event;
use supple_bus::virtual_time::EmulatedNodes;
use supple_can_frame::{BitRates, CanFrame, CanId};
use supple_core::Vector;
use supple_model::Description;
use supple_plant::{Plant, PlantConfig};

const RATES: BitRates = BitRates::FD_1M_5M;
const LATENCY_NS: u64 = 20_000;
const STEP_NS: u64 = 250_000;

#[derive(Clone, Copy, Default)]
struct Motor {
    mode: Mode,
    fault: i8,
    torque_nm: f64,
    kd_scale: f64,
    /// Time at which the watchdog ends the torque \[ns\].
    due_ns: u64,
}

impl Motor {
    /// Writes a register. The host encodes modes as small integers and all other values in single precision.
    fn write(&mut self, now_ns: u64, register: u16, raw: [u8; 4]) {
        let number = f64::from(f32::from_le_bytes(raw));
        match register {
            0x000 => {
                let mode = Mode::try_from(raw[0]).unwrap_or(Mode::Fault);
                // Only the stop mode clears a fault or a timeout.
                if !matches!(self.mode, Mode::Fault | Mode::Timeout) || mode == Mode::Stopped {
                    self.mode = mode;
                }
            }
            0x022 => self.torque_nm = number,
            0x024 => self.kd_scale = number,
            0x027 => self.due_ns = now_ns + (number * 1e9) as u64,
            _ => {}
        }
    }
}

pub struct EmulatedMoteus {
    plant: Plant<4>,
    motors: [Motor; 4],
    now_ns: u64,
    next_tick_ns: u64,
    /// Frames in order of sending, each with its earliest start time and its duration \[ns\].
    waiting: VecDeque<(u64, u64, Event)>,
    free_ns: u64,
    pub register_map: i16,
}

impl EmulatedMoteus {
    pub fn new(description: &Description) -> EmulatedMoteus {
        let mut config = PlantConfig::<4>::from_description(description).unwrap();
        config.step_s = STEP_NS as f64 * 1e-9;
        config.cycle_s = config.step_s;
        config.actuators.torque_delay_cycles = 0;
        EmulatedMoteus {
            plant: Plant::new(config, description.home().unwrap(), Vector::zeros()).unwrap(),
            motors: [Motor::default(); 4],
            now_ns: 0,
            next_tick_ns: STEP_NS,
            waiting: VecDeque::new(),
            free_ns: 0,
            register_map: 5,
        }
    }

    pub fn position_rad(&self) -> Vector<4> {
        self.plant.truth().position_rad
    }

    pub fn all_stopped(&self) -> bool {
        self.motors.iter().all(|motor| motor.mode == Mode::Stopped)
    }

    /// Sets a fault of a motor.
    pub fn fail(&mut self, index: usize, fault: i8) {
        self.motors[index].mode = Mode::Fault;
        self.motors[index].fault = fault;
    }

    fn tick(&mut self) {
        let speed = self.plant.truth().velocity_rad_per_s;
        let now_ns = self.now_ns;
        let torque_nm = Vector::from_fn(|i, _| {
            let motor = &mut self.motors[i];
            if motor.mode == Mode::Position && now_ns >= motor.due_ns {
                motor.mode = Mode::Timeout;
            }
            let damping = motor.kd_scale * crate::drive::KD_NM_S_PER_RAD;
            match motor.mode {
                Mode::Position => motor.torque_nm - damping * speed[i],
                _ => 0.0,
            }
        });
        // A cradle holds the arm until the motors are enabled.
        if self.motors.iter().any(|motor| motor.mode != Mode::Stopped) {
            self.plant.cycle(&torque_nm);
        }
        self.next_tick_ns += STEP_NS;
    }

    /// Executes a command; returns the reply with the requested registers.
    fn reaction(&mut self, frame: &CanFrame) -> Option<CanFrame> {
        let index = usize::from(frame.id().raw() as u8 & 0x7f).checked_sub(1)?;
        let angle_rev = self.plant.measurement().position_rad[index] / TAU;
        let speed_rev = self.plant.truth().velocity_rad_per_s[index] / TAU;
        let motor = self.motors.get_mut(index)?;
        let mut reply = Vec::new();
        let mut bytes = frame.payload().iter().copied();
        while let Some(head) = bytes.next() {
            if head == 0x50 {
                continue;
            }
            let width = [1, 2, 4, 4][usize::from(head >> 2 & 3)];
            let count = match head & 3 {
                0 => bytes.next()?,
                count => count,
            };
            let mut register = u16::from(bytes.next()?);
            if register >= 0x80 {
                register = register & 0x7f | u16::from(bytes.next()?) << 7;
            }
            for register in register..register + u16::from(count) {
                if head < 0x10 {
                    let mut raw = [0; 4];
                    for byte in &mut raw[..width] {
                        *byte = bytes.next()?;
                    }
                    motor.write(self.now_ns, register, raw);
                    continue;
                }
                let value = match register {
                    0x000 => f64::from(motor.mode as u8),
                    0x001 => angle_rev,
                    0x002 => speed_rev,
                    0x003 => motor.torque_nm,
                    0x00d => 48.0,
                    0x00e => 30.0,
                    0x00f => f64::from(motor.fault),
                    _ => f64::from(self.register_map),
                };
                // Each subframe has one value, and its register as a variable-length integer.
                reply.push(0x21 | head & 0x0c);
                match register {
                    0..0x80 => reply.push(register as u8),
                    _ => reply.extend([register as u8 & 0x7f | 0x80, (register >> 7) as u8]),
                }
                match head >> 2 & 3 {
                    0 => reply.push(value as i8 as u8),
                    1 => reply.extend((value as i16).to_le_bytes()),
                    _ => reply.extend((value as f32).to_le_bytes()),
                }
            }
        }
        while CanFrame::fd(frame.id(), true, &reply).is_err() && reply.len() < 64 {
            reply.push(0x50);
        }
        let id = CanId::standard((index as u32 + 1) << 8).ok()?;
        CanFrame::fd(id, true, &reply).ok()
    }
}

impl EmulatedNodes for EmulatedMoteus {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn receive_from_host(&mut self, frame: &CanFrame) {
        let event = Event::Sent(*frame);
        self.waiting
            .push_back((self.now_ns, RATES.duration_ns(frame), event));
    }

    fn run_until(&mut self, until_ns: u64) -> Option<Event> {
        loop {
            let front = self.waiting.front();
            let end_ns = front.map_or(u64::MAX, |(ready_ns, lasts_ns, _)| {
                self.free_ns.max(*ready_ns) + lasts_ns
            });
            let next_ns = end_ns.min(self.next_tick_ns);
            if next_ns > until_ns {
                self.now_ns = until_ns.max(self.now_ns);
                return None;
            }
            self.now_ns = next_ns.max(self.now_ns);
            if self.next_tick_ns <= end_ns {
                self.tick();
                continue;
            }
            self.free_ns = end_ns;
            let (_, _, event) = self.waiting.pop_front()?;
            if let Event::Sent(frame) = &event
                && let Some(reply) = self.reaction(frame)
            {
                let lasts_ns = RATES.duration_ns(&reply);
                let ready_ns = self.now_ns + LATENCY_NS;
                self.waiting
                    .push_back((ready_ns, lasts_ns, Event::Frame(reply)));
            }
            return Some(event);
        }
    }
}
