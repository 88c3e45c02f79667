//! Words of bounded length, written without an allocation.

use core::fmt::{self, Write};
use iceoryx2::prelude::ZeroCopySend;

/// Most bytes of a text.
const BYTES: usize = 252;

/// UTF-8 of at most 252 bytes; longer words are cut at a character.
#[derive(Clone, Copy, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.Text.v1")]
pub struct Text {
    length: u32,
    bytes: [u8; BYTES],
}

impl Text {
    /// No words.
    pub const EMPTY: Text = Text {
        length: 0,
        bytes: [0; BYTES],
    };

    /// What a value displays.
    pub fn of(value: &dyn fmt::Display) -> Text {
        let mut text = Text::EMPTY;
        // Writing stops at the last byte and never fails.
        let _ = write!(text, "{value}");
        text
    }

    /// The words.
    pub fn as_str(&self) -> &str {
        let length = usize::try_from(self.length).map_or(BYTES, |length| length.min(BYTES));
        match core::str::from_utf8(&self.bytes[..length]) {
            Ok(words) => words,
            Err(error) => {
                core::str::from_utf8(&self.bytes[..error.valid_up_to()]).unwrap_or_default()
            }
        }
    }
}

impl Write for Text {
    fn write_str(&mut self, words: &str) -> fmt::Result {
        let start = self.as_str().len();
        let mut take = words.len().min(BYTES - start);
        while !words.is_char_boundary(take) {
            take -= 1;
        }
        self.bytes[start..start + take].copy_from_slice(&words.as_bytes()[..take]);
        self.length = (start + take) as u32;
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
        f.write_str(self.as_str())
    }
}
