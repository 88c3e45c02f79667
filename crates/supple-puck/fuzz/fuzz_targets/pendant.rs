//! The pendant's word.
#![no_main]

use supple_puck::safety::{PenWord, Pendant};

libfuzzer_sys::fuzz_target!(|data: [u8; 4]| {
    let word = PenWord(u32::from_le_bytes(data));
    if let Ok(pendant) = Pendant::parse(word) {
        assert_eq!(pendant.emit().0, word.0 & PenWord::MASK);
        pendant.segments.character();
    }
});
