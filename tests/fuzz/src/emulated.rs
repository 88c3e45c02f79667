//! Fuzz targets of an emulated arm: lines for the socket of its pendant, and frames on its bus.

use std::sync::OnceLock;
use supple_bus::virtual_time::EmulatedNodes;
use supple_bus::{CAN_FRAME_BYTES, DecodedFrame, EncodedFrame};
use supple_core::Vector;
use supple_emu::{Emulator, EmulatorConfig, answer_pendant};
use supple_model::Description;
use supple_plant::PlantConfig;

/// Time between two frames, and after each line \[ns\].
const FRAME_NS: u64 = 100_000;
const LINE_NS: u64 = 1_000_000;
/// Maximum number of lines and frames per input.
const LINES: usize = 8;
const FRAMES: usize = 64;

fn emulator() -> Emulator<4> {
    static PARTS: OnceLock<(PlantConfig<4>, Vector<4>)> = OnceLock::new();
    let (plant, home_rad) = PARTS.get_or_init(|| {
        let description = Description::asset("wam4").expect("built in");
        let plant = PlantConfig::from_description(&description).expect("four joints");
        (plant, description.home().expect("four joints"))
    });
    let config = EmulatorConfig {
        // The arm has its position reference and starts in idle.
        zeroed: true,
        ..EmulatorConfig::wam(4)
    };
    Emulator::new(config, plant.clone(), *home_rad, 0).expect("a valid arm")
}

/// Sends lines to the pendant, each followed by an interval of time.
pub fn pendant_line(data: &[u8]) {
    let Ok(text) = core::str::from_utf8(data) else {
        return;
    };
    let mut emulator = emulator();
    for line in text.lines().take(LINES) {
        let answer = answer_pendant(&mut emulator, line.trim());
        let value: Result<serde_json::Value, _> = serde_json::from_str(&answer);
        assert!(value.is_ok() && !answer.contains('\n'), "{answer}");
        run(&mut emulator, LINE_NS);
    }
}

/// Reads raw frames of a host, 16 bytes each: sends data frames, and only decodes and encodes error frames.
pub fn arm_bus(data: &[u8]) {
    let mut emulator = emulator();
    for raw in data.chunks_exact(CAN_FRAME_BYTES).take(FRAMES) {
        match DecodedFrame::decode(raw) {
            DecodedFrame::Data(frame) => {
                assert_eq!(
                    DecodedFrame::decode(&EncodedFrame::of_data(&frame)),
                    DecodedFrame::Data(frame)
                );
                emulator.receive_from_host(&frame);
            }
            DecodedFrame::Fault(fault) => {
                assert_eq!(
                    DecodedFrame::decode(&EncodedFrame::of_fault(fault)),
                    DecodedFrame::Fault(fault)
                );
            }
            DecodedFrame::Unsupported => {}
        }
        run(&mut emulator, FRAME_NS);
        let torque_nm = emulator.motor_torque_nm();
        assert!(torque_nm.iter().all(|torque| torque.is_finite()));
    }
}

/// Advances the emulator by a time; it pauses at each frame that a node sends.
fn run(emulator: &mut Emulator<4>, ns: u64) {
    let until_ns = emulator.now_ns() + ns;
    while emulator.run_until(until_ns).is_some() {}
    assert_eq!(emulator.now_ns(), until_ns);
}
