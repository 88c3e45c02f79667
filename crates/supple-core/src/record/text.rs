//! Text of bounded length, written without an allocation.

use core::fmt::{self, Write};

/// Returns the longest beginning of `bytes` that is UTF-8.
pub fn valid_utf8(bytes: &[u8]) -> &str {
    let length = match core::str::from_utf8(bytes) {
        Ok(text) => return text,
        Err(error) => error.valid_up_to(),
    };
    core::str::from_utf8(&bytes[..length]).unwrap_or_default()
}

/// UTF-8 of at most [`Text::MAX_BYTES`] bytes; a longer text is cut at a character.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Text {
    length: usize,
    bytes: [u8; Text::MAX_BYTES],
}

impl Text {
    /// Maximum length.
    pub const MAX_BYTES: usize = 256;

    /// No text.
    pub const EMPTY: Text = Text {
        length: 0,
        bytes: [0; Text::MAX_BYTES],
    };

    /// Creates the text that [`fmt::Display`] writes for `value`.
    pub fn from_display(value: &dyn fmt::Display) -> Text {
        let mut text = Text::EMPTY;
        // Writing stops at the last byte and never fails.
        let _ = write!(text, "{value}");
        text
    }

    /// Creates a text from untrusted bytes, cut before the first byte that is not UTF-8.
    pub(super) fn from_utf8_lossy(bytes: &[u8; Text::MAX_BYTES], length: u64) -> Text {
        let length = usize::try_from(length).map_or(Text::MAX_BYTES, |n| n.min(Text::MAX_BYTES));
        let mut text = Text::EMPTY;
        let _ = text.write_str(valid_utf8(&bytes[..length]));
        text
    }

    /// Returns the text.
    pub fn as_str(&self) -> &str {
        core::str::from_utf8(&self.bytes[..self.length]).unwrap_or_default()
    }
}

impl Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut take = text.len().min(Text::MAX_BYTES - self.length);
        while !text.is_char_boundary(take) {
            take -= 1;
        }
        self.bytes[self.length..self.length + take].copy_from_slice(&text.as_bytes()[..take]);
        self.length += take;
        Ok(())
    }
}

impl fmt::Debug for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}
