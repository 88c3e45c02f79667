//! Tests of ids, payload lengths and data length codes.

use proptest::prelude::*;
use supple_can_frame::{CanFrame, CanId, FrameError, FrameFormat};

/// Payload lengths of an FD frame by data length code, ISO 11898-1:2015, table 5.
const FD_LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

#[test]
fn fd_frames_accept_only_the_payload_lengths_of_the_standard() {
    let id = CanId::standard(1).unwrap();
    for length in 0..=80 {
        let payload = vec![0xa5; length];
        let frame = CanFrame::fd(id, true, &payload);
        match FD_LENGTHS.iter().position(|valid| *valid == length) {
            Some(code) => {
                let frame = frame.unwrap();
                assert_eq!(usize::from(frame.dlc()), code);
                assert_eq!(frame.payload(), payload);
            }
            None => assert_eq!(frame, Err(FrameError::FdLength(length))),
        }
        let classic = CanFrame::new(id, &payload);
        assert_eq!(classic.is_ok(), length <= 8);
    }
}

#[test]
fn ids_above_their_range_are_rejected() {
    assert!(CanId::standard(0x7ff).is_ok() && CanId::extended(0x1fff_ffff).is_ok());
    let standard = CanId::standard(0x800).unwrap_err().to_string();
    assert_eq!(standard, "message id is 0x800, it must be at most 0x7ff");
    let extended = CanId::extended(0x2000_0000).unwrap_err().to_string();
    assert!(extended.contains("0x20000000"), "{extended}");
}

#[test]
fn frames_of_two_formats_or_kinds_of_id_differ() {
    let (standard, extended) = (CanId::standard(5).unwrap(), CanId::extended(5).unwrap());
    let classic = CanFrame::new(standard, &[1]).unwrap();
    assert_ne!(classic, CanFrame::new(extended, &[1]).unwrap());
    assert_ne!(classic, CanFrame::fd(standard, false, &[1]).unwrap());
    assert_eq!(classic.to_fd(true).payload(), classic.payload());
    assert_eq!(classic.format(), FrameFormat::Classic);
    assert_eq!(extended.as_standard(), None);
    assert_eq!(standard.as_standard(), Some(5));
}

/// Lists the bits of the arbitration field. The lower list wins the arbitration, because zero is dominant.
fn arbitration_bits(id: CanId) -> Vec<bool> {
    let raw = id.raw();
    let bits = |value: u32, count: u32| (0..count).rev().map(move |i| value >> i & 1 == 1);
    if id.is_extended() {
        let base = bits(raw >> 18, 11).chain([true, true]);
        base.chain(bits(raw, 18)).collect()
    } else {
        bits(raw, 11).chain([false, false]).collect()
    }
}

proptest! {
    #![proptest_config(crate::property::config(512, 20_261_101))]

    #[test]
    fn ids_are_ordered_as_on_the_bus(
        a in 0u32..0x2000_0000, b in 0u32..0x2000_0000, kinds in any::<(bool, bool)>(), same_base in any::<bool>()
    ) {
        let b = if same_base { a & 0x1ffc_0000 | b & 0x3_ffff } else { b };
        let id = |raw: u32, extended: bool| match extended {
            true => CanId::extended(raw).unwrap(),
            false => CanId::standard(raw >> 18).unwrap(),
        };
        let (a, b) = (id(a, kinds.0), id(b, kinds.1));
        prop_assert_eq!(a.cmp(&b), arbitration_bits(a).cmp(&arbitration_bits(b)));
        prop_assert_eq!(a == b, a.cmp(&b).is_eq());
    }
}
