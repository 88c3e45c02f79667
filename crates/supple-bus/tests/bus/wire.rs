//! `struct can_frame`: every frame round-trips, and the parser accepts any sixteen bytes without a panic.

use crate::property::config;
use proptest::prelude::*;
use supple_bus::{BusFault, WireFrame};
use supple_puck::CanFrame;

proptest! {
    #![proptest_config(config(256, 20_260_303))]

    #[test]
    fn data_frames_round_trip(id in 0u32..0x800, payload in proptest::collection::vec(any::<u8>(), 0..=8)) {
        let frame = CanFrame::from_raw(id, &payload).unwrap();
        prop_assert_eq!(WireFrame::parse(&WireFrame::data(&frame)), WireFrame::Data(frame));
    }

    #[test]
    fn parsed_data_frames_are_re_encoded_identically(raw in any::<[u8; 16]>()) {
        if let WireFrame::Data(frame) = WireFrame::parse(&raw) {
            prop_assert_eq!(WireFrame::parse(&WireFrame::data(&frame)), WireFrame::Data(frame));
        }
    }

    /// Extended ids and remote requests are not supported on this bus.
    #[test]
    fn flagged_ids_are_unsupported(id in 0u32..0x800, remote in any::<bool>()) {
        let flag = if remote { 0x4000_0000 } else { 0x8000_0000u32 };
        let mut raw = [0; 16];
        raw[..4].copy_from_slice(&(id | flag).to_ne_bytes());
        prop_assert_eq!(WireFrame::parse(&raw), WireFrame::Unsupported);
    }
}

/// Layout and numbers of `linux/can.h` and `linux/can/error.h`.
#[test]
fn layout_matches_the_kernel() {
    let frame = CanFrame::from_raw(0x423, &[0x00, 0x10, 0x00]).unwrap();
    let mut expected = [0; 16];
    expected[..4].copy_from_slice(&0x423u32.to_ne_bytes());
    expected[4] = 3;
    expected[8..11].copy_from_slice(&[0x00, 0x10, 0x00]);
    assert_eq!(WireFrame::data(&frame), expected);

    let error = |class: u32, controller: u8| {
        let mut raw = [0; 16];
        raw[..4].copy_from_slice(&(0x2000_0000 | class).to_ne_bytes());
        raw[4] = 8;
        raw[9] = controller;
        WireFrame::parse(&raw)
    };
    for (class, controller, fault) in [
        (0x040, 0, BusFault::BusOff),
        (0x020, 0, BusFault::NoAcknowledge),
        (0x100, 0, BusFault::Restarted),
        (0x004, 0x01, BusFault::Overrun),
        (0x004, 0x08, BusFault::Warning),
        (0x004, 0x20, BusFault::Passive),
        // The most severe of several: bus-off over a missing acknowledgement.
        (0x060, 0, BusFault::BusOff),
    ] {
        assert_eq!(error(class, controller), WireFrame::Fault(fault));
    }
    assert_eq!(error(0, 0), WireFrame::Unsupported);
}
