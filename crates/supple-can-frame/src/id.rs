//! Ids of frames: 11 bits (standard) or 29 bits (extended).

use core::cmp::Ordering;
use core::fmt;

/// Bit of [`CanId`] that marks an extended id.
const EXTENDED: u32 = 1 << 31;
/// Largest ids.
const MAX_STANDARD: u32 = 0x7ff;
const MAX_EXTENDED: u32 = 0x1fff_ffff;
/// Number of bits that an extended id has in addition to the 11 bits of a standard id.
const EXTENSION_BITS: u32 = 18;

/// Id of a frame. Ids are ordered by priority on the bus: the lowest id wins the arbitration, and a standard id wins over
/// an extended id whose first 11 bits are equal to it.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct CanId(u32);

/// Error: the number is too large for this format of id.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CanIdError {
    /// A standard id is at most 0x7FF.
    Standard(u32),
    /// An extended id is at most 0x1FFF_FFFF.
    Extended(u32),
}

impl fmt::Display for CanIdError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CanIdError::Standard(raw) => {
                write!(f, "message id is {raw:#x}, it must be at most 0x7ff")
            }
            CanIdError::Extended(raw) => {
                write!(f, "extended id is {raw:#x}, it must be at most 0x1fffffff")
            }
        }
    }
}

impl core::error::Error for CanIdError {}

impl CanId {
    /// Creates a standard id of 11 bits.
    ///
    /// # Errors
    /// [`CanIdError::Standard`] for a number above 0x7FF.
    pub const fn standard(raw: u32) -> Result<CanId, CanIdError> {
        if raw > MAX_STANDARD {
            return Err(CanIdError::Standard(raw));
        }
        Ok(CanId(raw))
    }

    /// Creates an extended id of 29 bits.
    ///
    /// # Errors
    /// [`CanIdError::Extended`] for a number above 0x1FFF_FFFF.
    pub const fn extended(raw: u32) -> Result<CanId, CanIdError> {
        if raw > MAX_EXTENDED {
            return Err(CanIdError::Extended(raw));
        }
        Ok(CanId(raw | EXTENDED))
    }

    /// Creates a standard id from the low 11 bits of a number; ignores higher bits.
    pub const fn standard_masked(raw: u16) -> CanId {
        CanId(raw as u32 & MAX_STANDARD)
    }

    /// Returns the id as a number, 0 to 0x7FF or 0 to 0x1FFF_FFFF.
    pub const fn raw(self) -> u32 {
        self.0 & !EXTENDED
    }

    /// Whether the id has 29 bits.
    pub const fn is_extended(self) -> bool {
        self.0 & EXTENDED != 0
    }

    /// The number of a standard id; `None` for an extended one.
    pub const fn as_standard(self) -> Option<u16> {
        if self.is_extended() {
            None
        } else {
            Some(self.0 as u16)
        }
    }

    /// Returns the bits of the arbitration field after the start bit as a number. After the first 11 bits, a standard id has
    /// two dominant bits and an extended id two recessive bits.
    const fn arbitration(self) -> u64 {
        let raw = self.raw() as u64;
        if self.is_extended() {
            let base = raw >> EXTENSION_BITS;
            let extension = raw & ((1 << EXTENSION_BITS) - 1);
            base << (EXTENSION_BITS + 2) | 0b11 << EXTENSION_BITS | extension
        } else {
            raw << (EXTENSION_BITS + 2)
        }
    }
}

impl Ord for CanId {
    fn cmp(&self, other: &CanId) -> Ordering {
        self.arbitration().cmp(&other.arbitration())
    }
}

impl PartialOrd for CanId {
    fn partial_cmp(&self, other: &CanId) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl fmt::Debug for CanId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Writes three hexadecimal digits, or eight for an extended id, as the CAN tools of Linux do.
impl fmt::Display for CanId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_extended() {
            write!(f, "{:08x}", self.raw())
        } else {
            write!(f, "{:03x}", self.raw())
        }
    }
}
