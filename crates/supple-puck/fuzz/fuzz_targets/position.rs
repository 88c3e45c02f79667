//! Position replies.
#![no_main]

mod frame;

use supple_puck::PositionReply;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some(frame) = frame::frame(data) else {
        return;
    };
    if let Ok(reply) = PositionReply::parse(&frame) {
        let again = reply.emit(frame.id().from());
        assert_eq!(PositionReply::parse(&again), Ok(reply));
    }
});
