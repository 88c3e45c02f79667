//! Property messages and replies, and what their ids stand for.
#![no_main]

mod frame;

use supple_puck::property::Reply;
use supple_puck::{PropertyMessage, PropertyTable, PuckKind};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some(frame) = frame::frame(data) else {
        return;
    };
    let Ok(message) = PropertyMessage::parse(&frame) else {
        assert!(Reply::parse(&frame).is_err());
        return;
    };
    assert_eq!(message.emit(frame.id().from(), frame.id().to()), frame);
    if let PropertyMessage::Set(id, value) = message {
        for kind in [PuckKind::Motor, PuckKind::Safety, PuckKind::ForceTorque] {
            if let Ok(table) = PropertyTable::of_firmware(kind, value.get()) {
                table.slot(id);
            }
        }
    }
});
