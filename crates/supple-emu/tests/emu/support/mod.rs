//! A host that exchanges frames with the emulated arm as raw ids and bytes, without the codec of `supple-puck`.

use supple_bus::virtual_time::{DirectBus, EmulatedNodes};
use supple_bus::{Bus, Event};
use supple_can_frame::CanFrame;
use supple_emu::{ButtonPress, Emulator, EmulatorConfig};
use supple_model::Description;
use supple_plant::PlantConfig;

pub const MS: u64 = 1_000_000;

/// Property ids of the newest firmware.
pub const VERS: u8 = 0;
pub const STAT: u8 = 5;
pub const MODE: u8 = 8;
pub const MT: u8 = 43;
pub const P: u8 = 48;
/// Property ids of the safety module.
pub const ZERO: u8 = 42;
pub const PEN: u8 = 43;
pub const VL1: u8 = 45;
pub const VL2: u8 = 46;
pub const IFAULT: u8 = 55;
pub const MODULE: u8 = 10;

/// Modes of the safety module on the bus.
pub const E_STOP: i32 = 0;
pub const IDLE: i32 = 1;
pub const ACTIVE: i32 = 2;

pub fn frame(id: u32, payload: &[u8]) -> CanFrame {
    CanFrame::from_raw(id, payload).unwrap()
}

pub struct Host(DirectBus<Emulator<4>>);

impl Host {
    /// Creates an arm in its home pose, in emergency stop.
    pub fn new(config: EmulatorConfig) -> Host {
        let description = Description::asset("wam4").unwrap();
        let plant = PlantConfig::<4>::from_description(&description).unwrap();
        let home_rad = description.home::<4>().unwrap();
        Host(DirectBus(
            Emulator::new(config, plant, home_rad, 0).unwrap(),
        ))
    }

    /// Creates an arm in idle, whose pucks are awake and have their position reference.
    pub fn awake() -> Host {
        Host::new(EmulatorConfig {
            zeroed: true,
            ..EmulatorConfig::wam(4)
        })
    }

    /// Creates an active arm, in torque mode.
    pub fn active() -> Host {
        let mut host = Host::awake();
        host.press(ButtonPress::Activate);
        host.cycles(5);
        assert_eq!(host.module_mode(), ACTIVE);
        host
    }

    pub fn arm(&self) -> &Emulator<4> {
        &self.0.0
    }

    pub fn arm_mut(&mut self) -> &mut Emulator<4> {
        &mut self.0.0
    }

    pub fn now_ns(&self) -> u64 {
        self.arm().now_ns()
    }

    pub fn press(&mut self, press: ButtonPress) {
        self.arm_mut().press(press);
    }

    pub fn send(&mut self, id: u32, payload: &[u8]) {
        self.0.send(&frame(id, payload)).unwrap();
    }

    /// Receives all events within a time.
    pub fn listen(&mut self, duration_ns: u64) -> Vec<(u64, Event)> {
        let until_ns = self.now_ns() + duration_ns;
        let mut events = Vec::new();
        while let Some(event) = self.0.receive_until(until_ns).unwrap() {
            events.push((self.now_ns(), event));
        }
        events
    }

    /// Receives the frames of other nodes within a time, as id and payload.
    pub fn receive_frames(&mut self, duration_ns: u64) -> Vec<(u32, Vec<u8>)> {
        let events = self.listen(duration_ns).into_iter();
        events
            .filter_map(|(_, event)| match event {
                Event::Frame(frame) => Some((frame.id().raw(), frame.payload().to_vec())),
                _ => None,
            })
            .collect()
    }

    /// Requests a property; returns the payload of the reply, `None` after a millisecond.
    pub fn get(&mut self, node: u8, property: u8) -> Option<Vec<u8>> {
        self.send(u32::from(node), &[property]);
        let from = |id: u32| id & 0x3e0 == u32::from(node) << 5;
        let received = self.receive_frames(MS).into_iter();
        received
            .filter(|(id, _)| from(*id))
            .map(|(_, payload)| payload)
            .next()
    }

    /// Reads a property of 16 or 32 bits.
    pub fn value(&mut self, node: u8, property: u8) -> i32 {
        let reply = self.get(node, property).expect("a reply");
        assert_eq!(reply[..2], [property | 0x80, 0]);
        match reply.len() {
            4 => i32::from(i16::from_le_bytes([reply[2], reply[3]])),
            6 => i32::from_le_bytes([reply[2], reply[3], reply[4], reply[5]]),
            length => panic!("{length} bytes"),
        }
    }

    pub fn set(&mut self, node: u8, property: u8, value: i32) {
        let [a, b, c, d] = value.to_le_bytes();
        self.send(u32::from(node), &[property | 0x80, 0, a, b, c, d]);
        self.listen(MS / 5);
    }

    /// Requests the positions of the whole arm every millisecond, without sending torques.
    pub fn cycles(&mut self, cycles: usize) {
        for _ in 0..cycles {
            self.send(0x404, &[P]);
            self.listen(MS);
        }
    }

    pub fn module_mode(&mut self) -> i32 {
        self.value(MODULE, MODE)
    }

    /// Reads the five three-bit fields of the pendant word: velocity, torque, voltage, heartbeat, other.
    pub fn lamps(&mut self) -> [i32; 5] {
        let word = self.value(MODULE, PEN);
        core::array::from_fn(|field| word >> (3 * field) & 0b111)
    }
}

/// Values of a field of the pendant word.
pub const SAFE: i32 = 0b001;
pub const WARNING: i32 = 0b010;
pub const FAULT: i32 = 0b100;

/// Packs four torques after the property: 14 bits each, the most significant bit first.
pub fn packed(torques: [i32; 4]) -> [u8; 8] {
    let word = torques
        .iter()
        .fold(0xaa_u64, |word, t| word << 14 | (*t as u64 & 0x3fff));
    word.to_be_bytes()
}
