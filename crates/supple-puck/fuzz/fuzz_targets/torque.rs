//! Packed torques.
#![no_main]

mod frame;

use supple_puck::{GroupId, PackedTorques};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some(frame) = frame::frame(data) else {
        return;
    };
    if let Ok(torques) = PackedTorques::parse(&frame) {
        let again = torques.emit(GroupId::LOWER_TORQUES);
        assert_eq!(again.payload(), frame.payload());
    }
});
