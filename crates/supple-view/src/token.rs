//! The secret token in the URL. Other users of the machine can connect to the port, but do not know the token.

use std::io;

/// Number of random bytes of a token.
const BYTES: usize = 16;

/// A secret of 128 random bits, written as 32 hexadecimal digits.
pub struct Token(String);

impl Token {
    /// Creates a token from random numbers of the kernel.
    ///
    /// # Errors
    /// If the kernel provides no random numbers.
    pub fn new() -> io::Result<Token> {
        let mut bytes = [0; BYTES];
        let filled = rustix::rand::getrandom(&mut bytes[..], rustix::rand::GetRandomFlags::empty());
        match filled? {
            BYTES => Ok(Token(
                bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
            )),
            _ => Err(io::Error::other("the kernel gave too few random numbers")),
        }
    }

    /// The digits.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether the text is the token. The duration of the comparison does not depend on the number of equal characters.
    pub fn matches(&self, text: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), text.as_bytes());
        let differing = own.iter().zip(other).fold(0, |bits, (a, b)| bits | (a ^ b));
        own.len() == other.len() && differing == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_whole_token_matches_and_no_two_are_equal() {
        let (token, other) = (
            Token::new().expect("random numbers of the kernel"),
            Token::new().expect("random numbers of the kernel"),
        );
        let text = token.as_str().to_owned();
        assert_eq!(text.len(), 2 * BYTES);
        assert!(token.matches(&text) && !other.matches(&text));
        for wrong in ["", &text[1..], &format!("{text}0"), &text.to_uppercase()] {
            // A token without letters equals its upper-case form.
            assert!(
                !token.matches(wrong) || *wrong == *text,
                "{wrong} against {text}"
            );
        }
    }
}
