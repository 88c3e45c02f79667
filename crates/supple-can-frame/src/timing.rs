//! Number of bits of a frame on the bus.
//!
//! A classic data frame with a standard id has 44 bits besides its payload, and 3 bits of interframe space. Start
//! bit, id, control field, payload and checksum are stuffed: after five equal bits an opposite one is inserted, which
//! counts towards the next five.
//!
//! An FD frame is stuffed in the same way up to the end of its payload; the stuff count and the checksum have a fixed
//! stuff bit before every four bits. With the bit rate switch, all bits from the error state indicator to the
//! checksum's delimiter are sent at the data rate. Source: ISO 11898-1:2015.

use crate::frame::{CanFrame, FrameFormat, fd_length};

/// Bit rate of an arm's classic CAN bus \[bit/s\]: one bit takes one microsecond.
pub const BIT_RATE: u32 = 1_000_000;

/// Bits that are never stuffed: delimiter of the checksum, acknowledgement and its delimiter, end of frame,
/// interframe space.
const TAIL_BITS: u32 = 1 + 2 + 7 + 3;
/// Classic: start bit, id, remote and extended bits, reserved bits, length.
const HEAD_BITS: u32 = 19;
const EXTENDED_HEAD_BITS: u32 = 39;
const CHECK_BITS: u32 = 15;
const CHECK_POLYNOMIAL: u16 = 0x4599;

/// FD: start bit to bit rate switch.
const FD_ARBITRATION_BITS: u32 = 17;
const FD_EXTENDED_ARBITRATION_BITS: u32 = 36;
/// FD: error state indicator and length.
const FD_CONTROL_BITS: u32 = 5;
/// FD: stuff count and checksum with their fixed stuff bits, for payloads up to 16 bytes and for longer ones.
const FD_SHORT_CHECK_BITS: u32 = 4 + 17 + 6;
const FD_LONG_CHECK_BITS: u32 = 4 + 21 + 7;
const FD_SHORT_BYTES: u8 = 16;

/// Numbers of bits at the nominal rate and at the data rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bits {
    /// Bits at the nominal rate.
    pub nominal: u32,
    /// Bits at the data rate.
    pub data: u32,
}

/// Properties of a frame that determine its number of bits, except its contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameLayout {
    /// Format.
    pub format: FrameFormat,
    /// Whether the id has 29 bits.
    pub extended: bool,
    /// Data length code, 0 to 8, or 0 to 15 for an FD frame.
    pub dlc: u8,
}

impl FrameLayout {
    /// Layout of a frame with a standard id.
    pub const fn standard(format: FrameFormat, dlc: u8) -> FrameLayout {
        FrameLayout {
            format,
            extended: false,
            dlc,
        }
    }

    /// Layout of this frame.
    pub const fn of(frame: &CanFrame) -> FrameLayout {
        FrameLayout {
            format: frame.format(),
            extended: frame.id().is_extended(),
            dlc: frame.dlc(),
        }
    }

    /// Returns the number of bits without stuff bits that depend on the contents.
    pub const fn min_bits(&self) -> Bits {
        match self.format {
            FrameFormat::Classic => Bits {
                nominal: self.classic_stuffed_bits() + TAIL_BITS,
                data: 0,
            },
            FrameFormat::Fd { bit_rate_switch } => self.fd_bits(bit_rate_switch, 0, 0),
        }
    }

    /// Returns the number of bits with the maximum number of stuff bits.
    pub const fn max_bits(&self) -> Bits {
        match self.format {
            FrameFormat::Classic => {
                let stuffed = self.classic_stuffed_bits();
                Bits {
                    nominal: stuffed + TAIL_BITS + (stuffed - 1) / 4,
                    data: 0,
                }
            }
            FrameFormat::Fd { bit_rate_switch } => {
                let arbitration = self.fd_arbitration_bits();
                let nominal = (arbitration - 1) / 4;
                let all = (arbitration + self.fd_payload_bits() - 1) / 4;
                self.fd_bits(bit_rate_switch, nominal, all - nominal)
            }
        }
    }

    /// Returns the number of bits of a classic frame that are subject to bit stuffing.
    const fn classic_stuffed_bits(&self) -> u32 {
        let head = if self.extended {
            EXTENDED_HEAD_BITS
        } else {
            HEAD_BITS
        };
        let bytes = if self.dlc > 8 { 8 } else { self.dlc };
        head + 8 * bytes as u32 + CHECK_BITS
    }

    const fn fd_arbitration_bits(&self) -> u32 {
        if self.extended {
            FD_EXTENDED_ARBITRATION_BITS
        } else {
            FD_ARBITRATION_BITS
        }
    }

    /// Returns the number of bits after the bit rate switch that are subject to bit stuffing.
    const fn fd_payload_bits(&self) -> u32 {
        FD_CONTROL_BITS + 8 * fd_length(self.dlc) as u32
    }

    const fn fd_bits(&self, bit_rate_switch: bool, nominal_stuff: u32, data_stuff: u32) -> Bits {
        let check = if fd_length(self.dlc) <= FD_SHORT_BYTES {
            FD_SHORT_CHECK_BITS
        } else {
            FD_LONG_CHECK_BITS
        };
        // The delimiter of the checksum is the last bit at the data rate.
        let data = self.fd_payload_bits() + check + 1 + data_stuff;
        let nominal = self.fd_arbitration_bits() + TAIL_BITS - 1 + nominal_stuff;
        if bit_rate_switch {
            Bits { nominal, data }
        } else {
            Bits {
                nominal: nominal + data,
                data: 0,
            }
        }
    }
}

impl Bits {
    /// Counts the bits of this frame, including stuff bits and the interframe space.
    pub fn of(frame: &CanFrame) -> Bits {
        let layout = FrameLayout::of(frame);
        let mut stream = Stream::default();
        match frame.format() {
            FrameFormat::Classic => {
                let dlc = u64::from(frame.dlc());
                stream.push_id(frame);
                // Reserved bits are zero.
                stream.push(dlc, if layout.extended { 6 } else { 5 });
                stream.push_payload(frame);
                stream.push(u64::from(stream.check), CHECK_BITS);
                Bits {
                    nominal: layout.min_bits().nominal + stream.stuffing,
                    data: 0,
                }
            }
            FrameFormat::Fd { bit_rate_switch } => {
                stream.push_id(frame);
                // FD format, reserved bit, bit rate switch.
                stream.push(0b100 | u64::from(bit_rate_switch), 3);
                let nominal = stream.stuffing;
                // The error state indicator is dominant in the frame of an error-active node.
                stream.push(u64::from(frame.dlc()), FD_CONTROL_BITS);
                stream.push_payload(frame);
                // The first fixed stuff bit takes the place of a stuff bit after the payload.
                let data = stream.stuffing - nominal - u32::from(stream.ended_with_stuffing);
                layout.fd_bits(bit_rate_switch, nominal, data)
            }
        }
    }

    /// Returns the number of bits at both rates together.
    pub const fn total(self) -> u32 {
        self.nominal + self.data
    }
}

/// Returns the number of bits of a classic frame of `dlc` bytes with a standard id, without stuff bits.
pub const fn min_bits(dlc: u8) -> u32 {
    FrameLayout::standard(FrameFormat::Classic, dlc)
        .min_bits()
        .nominal
}

/// Returns the number of bits of a classic frame of `dlc` bytes with a standard id and the maximum number of stuff bits.
pub const fn max_bits(dlc: u8) -> u32 {
    FrameLayout::standard(FrameFormat::Classic, dlc)
        .max_bits()
        .nominal
}

/// Returns the number of bits of this frame at both rates together, including stuff bits and the interframe space.
pub fn bits(frame: &CanFrame) -> u32 {
    Bits::of(frame).total()
}

#[derive(Default)]
struct Stream {
    check: u16,
    last: Option<bool>,
    run: u32,
    stuffing: u32,
    ended_with_stuffing: bool,
}

impl Stream {
    /// Start bit and id with the remote bit and the identifier extension.
    fn push_id(&mut self, frame: &CanFrame) {
        let id = frame.id();
        let raw = u64::from(id.raw());
        if id.is_extended() {
            self.push(raw >> 18, 12);
            // Substitute remote bit and identifier extension are recessive.
            self.push(0b11, 2);
            self.push(raw & 0x3_ffff, 18);
            self.push(0, 1);
        } else {
            self.push(raw, 12);
            // The remote bit and the identifier extension are dominant.
            self.push(0, 2);
        }
    }

    fn push_payload(&mut self, frame: &CanFrame) {
        for &byte in frame.payload() {
            self.push(u64::from(byte), 8);
        }
    }

    fn push(&mut self, value: u64, bits: u32) {
        for shift in (0..bits).rev() {
            let bit = value >> shift & 1 == 1;
            self.update_check(bit);
            self.run = if self.last == Some(bit) {
                self.run + 1
            } else {
                1
            };
            self.last = Some(bit);
            self.ended_with_stuffing = self.run == 5;
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

    /// Compares with the published check value of CRC-15/CAN.
    #[test]
    fn checksum_matches_crc_15_can() {
        let mut stream = Stream::default();
        for &byte in b"123456789" {
            stream.push(u64::from(byte), 8);
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
