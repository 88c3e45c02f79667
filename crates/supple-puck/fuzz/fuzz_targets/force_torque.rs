//! Frames of the force/torque sensor.
#![no_main]

mod frame;

use supple_puck::force_torque::{Quantity, SensorReading};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some(frame) = frame::frame(data) else {
        return;
    };
    for quantity in [Quantity::Force, Quantity::Torque, Quantity::Acceleration] {
        if let Ok(reading) = SensorReading::parse(quantity, &frame) {
            let again = reading.emit(frame.id().from());
            assert_eq!(again.payload(), frame.payload());
            assert_eq!(quantity.counts(reading.components()), Ok(reading.counts));
        }
    }
});
