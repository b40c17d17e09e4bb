//! The secret that lets a client in.

use std::fmt;
use std::io;
use std::str::FromStr;

use rustix::rand::{GetRandomFlags, getrandom};

/// Bytes of a random token: 128 bits.
const BYTES: usize = 16;
/// Shortest and longest token that somebody may choose, characters.
const LENGTHS: std::ops::RangeInclusive<usize> = 16..=128;

/// A secret of 16 to 128 letters, digits, `-` and `_`. Its `Debug` does not show it.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

/// Why a text is no token.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a token has 16 to 128 letters a-z, digits, '-' and '_': leave it out to get a random one")]
pub struct BadToken;

impl Token {
    /// 128 random bits as 32 hexadecimal digits.
    ///
    /// # Errors
    /// Where the system has no random numbers.
    pub fn random() -> io::Result<Self> {
        let mut bytes = [0_u8; BYTES];
        let got = getrandom(&mut bytes, GetRandomFlags::empty())?;
        if got != BYTES {
            return Err(io::Error::other("too few random bytes"));
        }
        Ok(Self(
            bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        ))
    }

    /// The secret itself.
    #[must_use]
    pub fn reveal(&self) -> &str {
        &self.0
    }

    /// Whether `given` is this token. The time it takes tells neither where they differ nor how long
    /// the token is: hashes are compared, and theirs is a comparison in constant time.
    pub(super) fn is(&self, given: &str) -> bool {
        blake3::hash(given.as_bytes()) == blake3::hash(self.0.as_bytes())
    }
}

impl FromStr for Token {
    type Err = BadToken;

    fn from_str(text: &str) -> Result<Self, BadToken> {
        let plain = text
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'));
        if plain && LENGTHS.contains(&text.len()) {
            Ok(Self(text.to_owned()))
        } else {
            Err(BadToken)
        }
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_tokens_differ_and_can_be_given_back() {
        let (one, other) = (Token::random().unwrap(), Token::random().unwrap());
        assert_ne!(one, other);
        assert_eq!(one.reveal().len(), 32);
        assert_eq!(one.reveal().parse::<Token>().unwrap(), one);
    }

    #[test]
    fn only_the_whole_token_is_the_token() {
        let token: Token = "0123456789abcdef".parse().unwrap();
        assert!(token.is("0123456789abcdef"));
        for wrong in [
            "",
            "0123456789abcde",
            "0123456789abcdeF",
            "0123456789abcdef ",
        ] {
            assert!(!token.is(wrong), "{wrong:?}");
        }
    }

    #[test]
    fn what_could_be_guessed_or_breaks_a_url_is_refused() {
        for text in [
            "",
            "short",
            "0123456789 abcdef",
            "0123456789abcdef&x=1",
            "ä0123456789abcdef",
        ] {
            assert_eq!(text.parse::<Token>(), Err(BadToken), "{text:?}");
        }
    }

    #[test]
    fn a_token_does_not_get_into_logs() {
        let token = Token::random().unwrap();
        assert!(!format!("{token:?}").contains(token.reveal()));
    }
}
