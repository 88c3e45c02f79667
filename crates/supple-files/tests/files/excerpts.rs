//! What a message quotes of a file.

use supple_files::{EXCERPT_CHARACTERS, excerpt};

#[test]
fn a_value_is_quoted_whole_up_to_its_limit() {
    for value in [
        "",
        "1.5",
        &"x".repeat(EXCERPT_CHARACTERS),
        &"\u{e4}".repeat(EXCERPT_CHARACTERS),
    ] {
        assert_eq!(excerpt(value), value);
    }
}

/// Also where a character has several bytes, in every position of the cut.
#[test]
fn a_longer_value_is_cut_between_characters_and_its_length_is_stated() {
    for lead in 0..4 {
        let value = format!("{}{}", "a".repeat(lead), "\u{1f980}".repeat(1_000_000));
        let quoted = excerpt(&value);
        let kept: String = value.chars().take(EXCERPT_CHARACTERS).collect();
        assert_eq!(
            quoted,
            format!("{kept}... ({} characters)", lead + 1_000_000)
        );
    }
}
