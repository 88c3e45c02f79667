//! A data frame: id, format and payload.

use crate::id::{CanId, CanIdError};
use core::fmt;

/// Maximum payload of a classic frame \[bytes\].
pub const MAX_CLASSIC_BYTES: usize = 8;
/// Maximum payload of an FD frame \[bytes\].
pub const MAX_FD_BYTES: usize = 64;

/// Payload lengths of the data length codes 9 to 15 of an FD frame \[bytes\]. For codes 0 to 8, the length equals the code.
const LONG_LENGTHS: [u8; 7] = [12, 16, 20, 24, 32, 48, 64];

/// Format of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameFormat {
    /// Classic CAN 2.0: at most 8 bytes, one bit rate.
    Classic,
    /// CAN FD: at most 64 bytes.
    Fd {
        /// The data phase is sent at the data bit rate (BRS).
        bit_rate_switch: bool,
    },
}

/// A data frame of classic CAN or CAN FD.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct CanFrame {
    id: CanId,
    format: FrameFormat,
    length: u8,
    // Bytes from `length` on are always zero, so that the derived equality compares the payload alone.
    bytes: [u8; MAX_FD_BYTES],
}

/// Error: not a valid frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The id is too large.
    Id(CanIdError),
    /// A classic frame cannot carry a payload of this many bytes; the maximum is eight.
    TooLong(usize),
    /// An FD frame cannot carry a payload of this many bytes, only 0 to 8, 12, 16, 20, 24, 32, 48 or 64.
    FdLength(usize),
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FrameError::Id(error) => write!(f, "{error}"),
            FrameError::TooLong(length) => {
                write!(
                    f,
                    "payload has {length} bytes, a classic frame carries at most 8"
                )
            }
            FrameError::FdLength(length) => write!(
                f,
                "payload has {length} bytes, an FD frame carries 0 to 8, 12, 16, 20, 24, 32, 48 or 64"
            ),
        }
    }
}

impl core::error::Error for FrameError {}

impl From<CanIdError> for FrameError {
    fn from(error: CanIdError) -> FrameError {
        FrameError::Id(error)
    }
}

impl CanFrame {
    /// Creates a classic frame with a payload of at most eight bytes.
    ///
    /// # Errors
    /// [`FrameError::TooLong`] for a longer payload.
    pub fn new(id: impl Into<CanId>, payload: &[u8]) -> Result<CanFrame, FrameError> {
        if payload.len() > MAX_CLASSIC_BYTES {
            return Err(FrameError::TooLong(payload.len()));
        }
        Ok(CanFrame::with(id.into(), FrameFormat::Classic, payload))
    }

    /// Creates a classic frame with a standard id from the number that a CAN driver reports, without the driver's flags.
    ///
    /// # Errors
    /// [`FrameError`] for an id above 0x7FF or a payload of more than eight bytes.
    pub fn from_raw(id: u32, payload: &[u8]) -> Result<CanFrame, FrameError> {
        CanFrame::new(CanId::standard(id)?, payload)
    }

    /// Creates an FD frame; with `bit_rate_switch` its data phase is sent at the data bit rate.
    ///
    /// # Errors
    /// [`FrameError::FdLength`] for a payload length other than 0 to 8, 12, 16, 20, 24, 32, 48 or 64 bytes.
    pub fn fd(
        id: impl Into<CanId>,
        bit_rate_switch: bool,
        payload: &[u8],
    ) -> Result<CanFrame, FrameError> {
        let length = payload.len();
        let valid = length <= MAX_CLASSIC_BYTES
            || LONG_LENGTHS.iter().any(|long| usize::from(*long) == length);
        if !valid {
            return Err(FrameError::FdLength(length));
        }
        let format = FrameFormat::Fd { bit_rate_switch };
        Ok(CanFrame::with(id.into(), format, payload))
    }

    /// Creates a frame of the given format.
    ///
    /// # Errors
    /// The same as those of [`CanFrame::new`] and [`CanFrame::fd`].
    pub fn of_format(
        id: impl Into<CanId>,
        format: FrameFormat,
        payload: &[u8],
    ) -> Result<CanFrame, FrameError> {
        match format {
            FrameFormat::Classic => CanFrame::new(id, payload),
            FrameFormat::Fd { bit_rate_switch } => CanFrame::fd(id, bit_rate_switch, payload),
        }
    }

    /// Creates a classic frame; the compiler checks the payload length.
    pub const fn of<const N: usize>(id: CanId, payload: [u8; N]) -> CanFrame {
        const { assert!(N <= MAX_CLASSIC_BYTES) };
        let mut bytes = [0; MAX_FD_BYTES];
        let mut i = 0;
        while i < N {
            bytes[i] = payload[i];
            i += 1;
        }
        CanFrame {
            id,
            format: FrameFormat::Classic,
            length: N as u8,
            bytes,
        }
    }

    /// Returns an FD frame with the same id and payload.
    pub const fn to_fd(self, bit_rate_switch: bool) -> CanFrame {
        CanFrame {
            format: FrameFormat::Fd { bit_rate_switch },
            ..self
        }
    }

    fn with(id: CanId, format: FrameFormat, payload: &[u8]) -> CanFrame {
        let mut bytes = [0; MAX_FD_BYTES];
        for (to, from) in bytes.iter_mut().zip(payload) {
            *to = *from;
        }
        CanFrame {
            id,
            format,
            length: payload.len().min(MAX_FD_BYTES) as u8,
            bytes,
        }
    }

    /// Message id.
    pub const fn id(&self) -> CanId {
        self.id
    }

    /// Format.
    pub const fn format(&self) -> FrameFormat {
        self.format
    }

    /// Whether this is an FD frame.
    pub const fn is_fd(&self) -> bool {
        matches!(self.format, FrameFormat::Fd { .. })
    }

    /// Data length code, 0 to 15; up to 8 it is the number of bytes.
    pub const fn dlc(&self) -> u8 {
        let mut code = 0;
        while code < LONG_LENGTHS.len() {
            if LONG_LENGTHS[code] == self.length {
                return code as u8 + 9;
            }
            code += 1;
        }
        self.length
    }

    /// Payload, 0 to 64 bytes.
    pub fn payload(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }
}

/// Returns the number of payload bytes of an FD frame from its data length code; a code above 15 is read as 15.
pub(crate) const fn fd_length(dlc: u8) -> u8 {
    if dlc <= MAX_CLASSIC_BYTES as u8 {
        return dlc;
    }
    let code = dlc as usize - 9;
    if code < LONG_LENGTHS.len() {
        LONG_LENGTHS[code]
    } else {
        MAX_FD_BYTES as u8
    }
}

impl fmt::Debug for CanFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let format = match self.format {
            FrameFormat::Classic => "",
            FrameFormat::Fd {
                bit_rate_switch: false,
            } => " fd",
            FrameFormat::Fd {
                bit_rate_switch: true,
            } => " fd/brs",
        };
        write!(f, "{}{format} {:02x?}", self.id, self.payload())
    }
}
