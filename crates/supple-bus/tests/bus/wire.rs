//! `struct can_frame`: every frame round-trips, and the parser accepts any sixteen bytes without a panic.

use crate::property::config;
use proptest::prelude::*;
use supple_bus::{BusFault, DecodedFrame, EncodedFrame};
use supple_can_frame::{CanFrame, CanId};

proptest! {
    #![proptest_config(config(256, 20_260_303))]

    #[test]
    fn data_frames_round_trip(id in 0u32..0x800, payload in proptest::collection::vec(any::<u8>(), 0..=8)) {
        let frame = CanFrame::from_raw(id, &payload).unwrap();
        prop_assert_eq!(DecodedFrame::decode(&EncodedFrame::of_data(&frame)), DecodedFrame::Data(frame));
    }

    #[test]
    fn fd_frames_round_trip(
        id in 0u32..0x2000_0000,
        extended in any::<bool>(),
        bit_rate_switch in any::<bool>(),
        dlc in 0usize..16,
        bytes in any::<[u8; 32]>(),
    ) {
        let id = if extended { CanId::extended(id) } else { CanId::standard(id & 0x7ff) };
        let length = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64][dlc];
        let payload = [bytes, bytes].concat();
        let frame = CanFrame::fd(id.unwrap(), bit_rate_switch, &payload[..length]).unwrap();
        let raw = EncodedFrame::of_data(&frame);
        prop_assert_eq!(raw.len(), 72);
        prop_assert_eq!(DecodedFrame::decode(&raw), DecodedFrame::Data(frame));
        prop_assert_eq!(DecodedFrame::decode(&raw[..71]), DecodedFrame::Unsupported);
    }

    #[test]
    fn parsed_data_frames_are_re_encoded_identically(
        raw in any::<[u8; 16]>(),
        fd in any::<bool>(),
        head in any::<[u8; 8]>(),
        bytes in any::<[u8; 32]>(),
    ) {
        let raw = if fd { [&head[..], &bytes, &bytes].concat() } else { raw.to_vec() };
        if let DecodedFrame::Data(frame) = DecodedFrame::decode(&raw) {
            prop_assert_eq!(DecodedFrame::decode(&EncodedFrame::of_data(&frame)), DecodedFrame::Data(frame));
        }
    }

    /// Remote requests are not supported.
    #[test]
    fn remote_requests_are_unsupported(id in 0u32..0x800) {
        let mut raw = [0; 16];
        raw[..4].copy_from_slice(&(id | 0x4000_0000u32).to_ne_bytes());
        prop_assert_eq!(DecodedFrame::decode(&raw), DecodedFrame::Unsupported);
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
    assert_eq!(EncodedFrame::of_data(&frame)[..], expected);

    let error = |class: u32, controller: u8| {
        let mut raw = [0; 16];
        raw[..4].copy_from_slice(&(0x2000_0000 | class).to_ne_bytes());
        raw[4] = 8;
        raw[9] = controller;
        DecodedFrame::decode(&raw)
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
        assert_eq!(error(class, controller), DecodedFrame::Fault(fault));
    }
    assert_eq!(error(0, 0), DecodedFrame::Unsupported);
}
