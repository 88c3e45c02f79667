//! Duration of a frame on the bus.
//!
//! A data frame with an 11-bit id has 44 bits besides its payload, and 3 bits of interframe space. Start bit,
//! id, control field, payload and checksum are stuffed: after five equal bits an opposite one is inserted, which
//! counts towards the next five.

use crate::frame::CanFrame;

/// Bits per second of the arm's bus; a bit is a microsecond.
pub const BIT_RATE: u32 = 1_000_000;

const UNSTUFFED_BITS: u32 = 47;
const HEAD_BITS: u32 = 19;
const CHECK_BITS: u32 = 15;
const CHECK_POLYNOMIAL: u16 = 0x4599;

/// Bits of a frame of `dlc` bytes without any stuffing.
pub const fn min_bits(dlc: u8) -> u32 {
    UNSTUFFED_BITS + 8 * dlc as u32
}

/// Bits of a frame of `dlc` bytes with maximum stuffing.
pub const fn max_bits(dlc: u8) -> u32 {
    let stuffed = HEAD_BITS + 8 * dlc as u32 + CHECK_BITS;
    min_bits(dlc) + (stuffed - 1) / 4
}

/// Bits of this frame, including stuffing and the interframe space.
pub fn bits(frame: &CanFrame) -> u32 {
    // Start bit, id, then remote, extended and reserved bits, all zero, then the length.
    let head = u32::from(frame.id().raw()) << 7 | u32::from(frame.dlc());
    let mut stream = Stream::default();
    stream.push(head, HEAD_BITS);
    for &byte in frame.payload() {
        stream.push(u32::from(byte), 8);
    }
    stream.push(u32::from(stream.check), CHECK_BITS);
    min_bits(frame.dlc()) + stream.stuffing
}

#[derive(Default)]
struct Stream {
    check: u16,
    last: Option<bool>,
    run: u32,
    stuffing: u32,
}

impl Stream {
    fn push(&mut self, value: u32, bits: u32) {
        for shift in (0..bits).rev() {
            let bit = value >> shift & 1 == 1;
            self.update_check(bit);
            self.run = if self.last == Some(bit) {
                self.run + 1
            } else {
                1
            };
            self.last = Some(bit);
            if self.run == 5 {
                self.stuffing += 1;
                self.last = Some(!bit);
                self.run = 1;
            }
        }
    }

    fn update_check(&mut self, bit: bool) {
        let carry = self.check >> 14 & 1 == 1;
        self.check = self.check << 1 & 0x7fff;
        if carry != bit {
            self.check ^= CHECK_POLYNOMIAL;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Stream;

    /// The published check value of CRC-15/CAN.
    #[test]
    fn checksum_matches_crc_15_can() {
        let mut stream = Stream::default();
        for &byte in b"123456789" {
            stream.push(u32::from(byte), 8);
        }
        assert_eq!(stream.check, 0x059e);
    }

    #[test]
    fn stuff_bits_count_towards_the_next_five() {
        let stuffing = |value, bits| {
            let mut stream = Stream::default();
            stream.push(value, bits);
            stream.stuffing
        };
        assert_eq!(stuffing(0b0000, 4), 0);
        assert_eq!(stuffing(0b00000, 5), 1);
        // After 00000 a 1 is stuffed, which makes five with the four 1 that follow.
        assert_eq!(stuffing(0b0_0000_1111, 9), 2);
        assert_eq!(stuffing(0b0_0000_0111, 9), 1);
    }
}
