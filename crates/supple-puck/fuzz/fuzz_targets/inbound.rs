//! Any frame that reaches the host.
#![no_main]

mod frame;

use supple_puck::{Inbound, timing};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some(frame) = frame::frame(data) else {
        return;
    };
    if let Ok((node, _)) = Inbound::parse(&frame) {
        assert_eq!(node, frame.id().from());
    }
    let bits = timing::bits(&frame);
    assert!(bits >= timing::least_bits(frame.dlc()) && bits <= timing::most_bits(frame.dlc()));
});
