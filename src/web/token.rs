//! The secret that lets a client in.

use std::fmt;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Bytes of a random token: 128 bits.
const BYTES: usize = 16;
/// Shortest and longest token that somebody may choose, characters.
const LENGTHS: std::ops::RangeInclusive<usize> = 16..=128;

/// A secret of 16 to 128 letters, digits, `-` and `_`. Its `Debug` does not show it.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

/// Longest file that can hold a token, bytes.
const LONGEST_FILE: u64 = 256;
/// Permissions that a token's file must not give: to others any, to its group writing.
const FORBIDDEN: u32 = 0o027;

/// Why a text is no token.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a token has 16 to 128 letters a-z, digits, '-' and '_': leave it out to get a random one")]
pub struct InvalidToken;

/// Why a file gives no token.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TokenFileError {
    /// It cannot be read.
    #[error("the token's file {path} could not be read")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// It was not there, and cannot be made.
    #[error("the token's file {path} could not be made: make its folder, or give another file")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// Other accounts can read or change it.
    #[error(
        "the token's file {path} is open to other accounts (mode {mode:03o}): `chmod 600` it, or 640 for a group that may know it"
    )]
    Exposed {
        /// The file.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// What it holds is no token.
    #[error("the token's file {path} holds no token")]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What a token is.
        source: InvalidToken,
    },
}

impl Token {
    /// 128 random bits as 32 hexadecimal digits.
    ///
    /// # Errors
    /// Where the system has no random numbers.
    pub fn random() -> io::Result<Self> {
        let mut bytes = [0_u8; BYTES];
        getrandom::fill(&mut bytes)?;
        Ok(Self(format!("{:032x}", u128::from_ne_bytes(bytes))))
    }

    /// The token that a file holds, which nobody but its owner and group can read. White space
    /// around it, such as the end of the line, is no part of it.
    ///
    /// # Errors
    /// [`TokenFileError`].
    pub fn from_file(path: &Path) -> Result<Self, TokenFileError> {
        let failed = |source| TokenFileError::Read {
            path: path.to_owned(),
            source,
        };
        let file = File::open(path).map_err(failed)?;
        let mode = file.metadata().map_err(failed)?.mode() & 0o777;
        if mode & FORBIDDEN != 0 {
            let path = path.to_owned();
            return Err(TokenFileError::Exposed { path, mode });
        }
        let mut text = String::new();
        file.take(LONGEST_FILE)
            .read_to_string(&mut text)
            .map_err(failed)?;
        // Editors of Windows begin a file with a byte order mark.
        text.trim_start_matches('\u{feff}')
            .trim()
            .parse()
            .map_err(|source| TokenFileError::Invalid {
                path: path.to_owned(),
                source,
            })
    }

    /// The token that a file holds. Where there is no such file, it is made with a random token, for its
    /// owner alone.
    ///
    /// # Errors
    /// [`TokenFileError`].
    pub fn from_file_or_new(path: &Path) -> Result<Self, TokenFileError> {
        match Self::from_file(path) {
            Err(TokenFileError::Read { source, .. })
                if source.kind() == io::ErrorKind::NotFound => {}
            read => return read,
        }
        let made = Self::random().and_then(|token| token.write(path));
        made.map_err(|source| TokenFileError::Write {
            path: path.to_owned(),
            source,
        })?;
        // Another process may have been first: what lies there counts.
        Self::from_file(path)
    }

    /// Writes the token to a file that appears whole, and replaces none.
    fn write(&self, path: &Path) -> io::Result<()> {
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let mut file = tempfile::NamedTempFile::new_in(folder.unwrap_or(Path::new(".")))?;
        writeln!(file, "{}", self.0)?;
        file.as_file().sync_all()?;
        match file.persist_noclobber(path) {
            Err(error) if error.error.kind() != io::ErrorKind::AlreadyExists => Err(error.error),
            _ => Ok(()),
        }
    }

    /// The secret itself.
    #[must_use]
    pub fn reveal(&self) -> &str {
        &self.0
    }

    /// Whether `given` is this token. The time it takes reveals neither where they differ nor how long
    /// the token is: hashes are compared, and theirs is a comparison in constant time.
    pub fn is(&self, given: &str) -> bool {
        blake3::hash(given.as_bytes()) == blake3::hash(self.0.as_bytes())
    }
}

impl FromStr for Token {
    type Err = InvalidToken;

    fn from_str(text: &str) -> Result<Self, InvalidToken> {
        let plain = text
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'));
        if plain && LENGTHS.contains(&text.len()) {
            Ok(Self(text.to_owned()))
        } else {
            Err(InvalidToken)
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
            assert_eq!(text.parse::<Token>(), Err(InvalidToken), "{text:?}");
        }
    }

    #[test]
    fn a_tokens_file_is_read_only_where_it_is_kept_from_other_accounts() {
        use std::fs::{self, Permissions};
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        fs::write(&path, "0123456789abcdef\n").unwrap();
        for (mode, is_taken) in [
            (0o600, true),
            (0o400, true),
            (0o640, true),
            (0o644, false),
            (0o660, false),
            (0o602, false),
        ] {
            fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
            let read = Token::from_file(&path);
            assert_eq!(read.is_ok(), is_taken, "{mode:o}: {read:?}");
        }
        fs::set_permissions(&path, Permissions::from_mode(0o600)).unwrap();
        fs::write(&path, "\u{feff}0123456789abcdef\r\n").unwrap();
        assert!(Token::from_file(&path).is_ok());
        fs::write(&path, "short").unwrap();
        let read = Token::from_file(&path);
        assert!(
            matches!(read, Err(TokenFileError::Invalid { .. })),
            "{read:?}"
        );
        let none = Token::from_file(&folder.path().join("none"));
        assert!(matches!(none, Err(TokenFileError::Read { .. })), "{none:?}");
    }

    #[test]
    fn a_tokens_file_is_made_once_and_for_its_owner_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        let token = Token::from_file_or_new(&path).unwrap();
        let mode = std::fs::metadata(&path).unwrap().mode() & 0o777;
        assert_eq!(mode, 0o600);
        assert_eq!(Token::from_file_or_new(&path).unwrap(), token);
        let nowhere = Token::from_file_or_new(&folder.path().join("none/token"));
        assert!(
            matches!(nowhere, Err(TokenFileError::Write { .. })),
            "{nowhere:?}"
        );
    }

    #[test]
    fn a_token_does_not_get_into_logs() {
        let token = Token::random().unwrap();
        assert!(!format!("{token:?}").contains(token.reveal()));
    }
}
