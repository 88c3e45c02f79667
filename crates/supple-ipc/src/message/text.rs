//! Text of a message: [`supple_core::record::Text`] with a layout for shared memory.

use core::fmt;
use iceoryx2::prelude::ZeroCopySend;
use supple_core::record::{self, valid_utf8};

/// Maximum length of a text \[bytes\].
const BYTES: usize = 252;

/// UTF-8 text of at most 252 bytes; a longer text is truncated at a character boundary.
#[derive(Clone, Copy, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.Text.v1")]
pub struct Text {
    length: u32,
    bytes: [u8; BYTES],
}

impl Text {
    /// The empty text.
    pub const EMPTY: Text = Text {
        length: 0,
        bytes: [0; BYTES],
    };

    /// Formats a value.
    pub fn of(value: &dyn fmt::Display) -> Text {
        let formatted = record::Text::from_display(value);
        let bytes = formatted.as_str().as_bytes();
        let whole = valid_utf8(&bytes[..bytes.len().min(BYTES)]);
        let mut text = Text::EMPTY;
        text.bytes[..whole.len()].copy_from_slice(whole.as_bytes());
        text.length = whole.len() as u32;
        text
    }

    /// The text as a string.
    pub fn as_str(&self) -> &str {
        let length = usize::try_from(self.length).map_or(BYTES, |length| length.min(BYTES));
        valid_utf8(&self.bytes[..length])
    }
}

impl fmt::Debug for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
