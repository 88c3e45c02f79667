//! Bit rates of a bus.

use crate::frame::{CanFrame, FrameFormat};
use crate::timing::{Bits, FrameLayout};
use core::fmt;

const NS_PER_S: u64 = 1_000_000_000;

/// Bit rates of a bus: the nominal rate (arbitration phase, and classic frames as a whole) and the rate of the data phase (from ESI
/// to the delimiter of the checksum) of FD frames with a bit rate switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitRates {
    /// Nominal rate \[bit/s\], not zero.
    pub nominal_bit_per_s: u32,
    /// Rate of the data phase \[bit/s\], not zero; `None` on a bus that carries classic frames only.
    pub data_bit_per_s: Option<u32>,
}

impl BitRates {
    /// Classic CAN at 1 Mbit/s.
    pub const CLASSIC_1M: BitRates = BitRates {
        nominal_bit_per_s: 1_000_000,
        data_bit_per_s: None,
    };
    /// CAN FD at 1 Mbit/s and 5 Mbit/s.
    pub const FD_1M_5M: BitRates = BitRates {
        nominal_bit_per_s: 1_000_000,
        data_bit_per_s: Some(5_000_000),
    };

    /// Whether the bus carries FD frames.
    pub const fn has_fd(&self) -> bool {
        self.data_bit_per_s.is_some()
    }

    /// Returns the fastest format on this bus: FD with a bit rate switch if the bus has a data rate, otherwise classic.
    pub const fn fastest_format(&self) -> FrameFormat {
        if self.has_fd() {
            FrameFormat::Fd {
                bit_rate_switch: true,
            }
        } else {
            FrameFormat::Classic
        }
    }

    /// Returns the duration of these bits \[ns\]; the duration of each phase is rounded up.
    pub const fn bits_ns(&self, bits: Bits) -> u64 {
        let data_bit_per_s = match self.data_bit_per_s {
            Some(rate) => rate,
            None => self.nominal_bit_per_s,
        };
        let nominal = bits.nominal as u64 * NS_PER_S;
        let data = bits.data as u64 * NS_PER_S;
        nominal.div_ceil(at_least_one(self.nominal_bit_per_s))
            + data.div_ceil(at_least_one(data_bit_per_s))
    }

    /// Duration of a frame with its stuff bits and the interframe space \[ns\].
    pub fn duration_ns(&self, frame: &CanFrame) -> u64 {
        self.bits_ns(Bits::of(frame))
    }

    /// Shortest duration of a frame of this layout \[ns\].
    pub const fn min_ns(&self, layout: FrameLayout) -> u64 {
        self.bits_ns(layout.min_bits())
    }

    /// Longest duration of a frame of this layout \[ns\], with all possible stuff bits.
    pub const fn max_ns(&self, layout: FrameLayout) -> u64 {
        self.bits_ns(layout.max_bits())
    }
}

const fn at_least_one(rate: u32) -> u64 {
    if rate == 0 { 1 } else { rate as u64 }
}

impl fmt::Display for BitRates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mega = |rate: u32| f64::from(rate) * 1e-6;
        match self.data_bit_per_s {
            None => write!(f, "classic CAN at {} Mbit/s", mega(self.nominal_bit_per_s)),
            Some(data) => write!(
                f,
                "CAN FD at {} and {} Mbit/s",
                mega(self.nominal_bit_per_s),
                mega(data)
            ),
        }
    }
}
