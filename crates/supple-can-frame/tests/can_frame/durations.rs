//! Numbers of bits and durations, compared with published bounds and with a second implementation that lists every bit.

use proptest::prelude::*;
use supple_can_frame::timing::{Bits, FrameLayout, bits, max_bits, min_bits};
use supple_can_frame::{BitRates, CanFrame, CanId, FrameFormat};

const FD: FrameFormat = FrameFormat::Fd {
    bit_rate_switch: true,
};

fn extended(dlc: u8) -> FrameLayout {
    FrameLayout {
        format: FD,
        extended: true,
        dlc,
    }
}

#[test]
fn bit_counts_equal_the_bounds_of_the_standard() {
    // 8 bytes: 111 to 135 bits with a standard id, 131 to 160 with an extended one.
    assert_eq!((min_bits(8), max_bits(8)), (111, 135));
    let extended = FrameLayout {
        extended: true,
        ..FrameLayout::standard(FrameFormat::Classic, 8)
    };
    assert_eq!(extended.min_bits().nominal, 131);
    assert_eq!(extended.max_bits().nominal, 160);
    let fd = FrameLayout::standard(FD, 8);
    let [min, max] = [fd.min_bits(), fd.max_bits()].map(|b| (b.nominal, b.data));
    assert_eq!((min, max), ((29, 97), (33, 114)));
}

/// Compares the durations of command and reply of seven motors with known bounds \[us\]: 8 bytes each; 48 and 24 bytes
/// with an extended id in the command; 20 and 16 bytes.
#[test]
fn cycles_of_seven_motors_take_their_known_times() {
    let us = |rates: BitRates, shapes: [FrameLayout; 2]| {
        let sum =
            |ns: fn(&BitRates, FrameLayout) -> u64| shapes.map(|s| ns(&rates, s)).iter().sum();
        let round = |ns: u64| (7.0 * ns as f64 * 1e-3).round() as u64;
        (
            round(sum(|rates, layout| rates.min_ns(layout))),
            round(sum(|rates, layout| rates.max_ns(layout))),
        )
    };
    let (classic, fd) = (BitRates::CLASSIC_1M, BitRates::FD_1M_5M);
    let eight = |format| [FrameLayout::standard(format, 8); 2];
    assert_eq!(us(classic, eight(FrameFormat::Classic)), (1554, 1890));
    assert_eq!(us(fd, eight(FD)), (678, 781));
    let lengths = |command, reply| [extended(command), FrameLayout::standard(FD, reply)];
    assert_eq!(us(fd, lengths(14, 12)), (1452, 1742));
    assert_eq!(us(fd, lengths(11, 10)), (1042, 1231));
}

/// An FD bus sends classic frames and FD frames without a bit rate switch at the nominal rate.
#[test]
fn only_frames_with_the_switch_use_the_data_rate() {
    let id = CanId::standard(0x123).unwrap();
    let classic = CanFrame::new(id, &[0x55; 8]).unwrap();
    let rates = BitRates::FD_1M_5M;
    assert_eq!(
        rates.duration_ns(&classic),
        u64::from(bits(&classic)) * 1_000
    );
    let slow = CanFrame::fd(id, false, &[0x55; 8]).unwrap();
    let fast = CanFrame::fd(id, true, &[0x55; 8]).unwrap();
    assert_eq!(Bits::of(&slow).data, 0);
    assert_eq!(rates.duration_ns(&slow), u64::from(bits(&slow)) * 1_000);
    assert!(rates.duration_ns(&fast) < rates.duration_ns(&slow) / 2);
}

/// Lists the bits of an FD frame from the start bit to the end of its payload, without stuff bits.
fn fd_head(frame: &CanFrame, bit_rate_switch: bool) -> Vec<bool> {
    let mut written = vec![false];
    let mut write = |value: u32, count: u32| {
        written.extend((0..count).rev().map(|i| value >> i & 1 == 1));
    };
    let raw = frame.id().raw();
    if frame.id().is_extended() {
        write(raw >> 18, 11);
        write(0b11, 2);
        write(raw & 0x3_ffff, 18);
        write(0b0, 1);
    } else {
        write(raw, 11);
        write(0b00, 2);
    }
    // FD format, reserved bit, bit rate switch, error state.
    write(0b100 | u32::from(bit_rate_switch), 3);
    write(0, 1);
    write(u32::from(frame.dlc()), 4);
    for byte in frame.payload() {
        write(u32::from(*byte), 8);
    }
    written
}

/// Counts the bits including stuff bits; after the last bit, a fixed stuff bit takes the place of a stuff bit.
fn stuffed(bits: &[bool]) -> usize {
    let mut sent: Vec<bool> = Vec::new();
    for (index, bit) in bits.iter().enumerate() {
        sent.push(*bit);
        let last = &sent[sent.len().saturating_sub(5)..];
        let five = last.len() == 5 && last.iter().all(|other| other == bit);
        if five && index + 1 < bits.len() {
            sent.push(!bit);
        }
    }
    sent.len()
}

proptest! {
    #![proptest_config(crate::property::config(512, 20_261_102))]

    #[test]
    fn fd_bit_counts_equal_those_of_the_listed_bits(
        raw in 0u32..0x2000_0000,
        is_extended in any::<bool>(),
        bit_rate_switch in any::<bool>(),
        dlc in 0usize..16,
        // Runs of equal bits are frequent.
        bytes in proptest::collection::vec(prop_oneof![Just(0u8), Just(0xff), any::<u8>()], 64),
    ) {
        let length = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64][dlc];
        let id = if is_extended { CanId::extended(raw) } else { CanId::standard(raw >> 18) };
        let frame = CanFrame::fd(id.unwrap(), bit_rate_switch, &bytes[..length]).unwrap();
        // Stuff count, checksum and their fixed stuff bits; delimiter, acknowledgement, end, interframe space.
        let check = if length <= 16 { 4 + 17 + 6 } else { 4 + 21 + 7 };
        let expected = stuffed(&fd_head(&frame, bit_rate_switch)) + check + 13;
        prop_assert_eq!(bits(&frame) as usize, expected);
        let (found, layout) = (Bits::of(&frame), FrameLayout::of(&frame));
        let (min, max) = (layout.min_bits(), layout.max_bits());
        prop_assert!(min.nominal <= found.nominal && min.data <= found.data);
        prop_assert!(found.nominal <= max.nominal && found.total() <= max.total());
        let rates = BitRates::FD_1M_5M;
        prop_assert!((rates.min_ns(layout)..=rates.max_ns(layout)).contains(&rates.duration_ns(&frame)));
    }

    #[test]
    fn classic_bits_are_within_their_bounds(
        raw in 0u32..0x2000_0000,
        is_extended in any::<bool>(),
        bytes in proptest::collection::vec(prop_oneof![Just(0u8), Just(0xff), any::<u8>()], 0..=8),
    ) {
        let id = if is_extended { CanId::extended(raw) } else { CanId::standard(raw >> 18) };
        let frame = CanFrame::new(id.unwrap(), &bytes).unwrap();
        let layout = FrameLayout::of(&frame);
        let range = layout.min_bits().nominal..=layout.max_bits().nominal;
        prop_assert!(range.contains(&bits(&frame)));
    }
}
