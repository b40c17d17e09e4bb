//! The secret that lets a client in.

use std::fmt;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::str::FromStr;

/// Bytes of a random token: 128 bits.
const BYTES: usize = 16;
/// Shortest and longest token that somebody may choose, characters.
const LENGTHS: std::ops::RangeInclusive<usize> = 16..=128;

/// A secret of 16 to 128 letters, digits, `-` and `_`. Its `Debug` does not show it.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

/// Longest file that can hold a token, bytes.
const MAX_FILE_LENGTH: u64 = 256;
/// Permissions that a token's file must not give: to others any, to its group writing.
const FORBIDDEN: u32 = 0o027;
/// What is wrong with a text that is not a token.
const NO_TOKEN: &str =
    "a token has 16 to 128 letters a-z, digits, '-' and '_': leave it out to get a random one";

impl Token {
    /// 128 random bits as 32 hexadecimal digits.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub fn random() -> io::Result<Self> {
        let mut bytes = [0_u8; BYTES];
        getrandom::fill(&mut bytes)?;
        Ok(Self(format!("{:032x}", u128::from_ne_bytes(bytes))))
    }

    /// The token that a file holds, which nobody but its owner and group can read. White space
    /// around it, such as the end of the line, is not part of it.
    ///
    /// # Errors
    /// If it cannot be read, is open to other accounts, or holds no token.
    pub fn from_file(path: &Path) -> io::Result<Self> {
        let failed =
            |error: io::Error| of_file(path, error.kind(), &format!("could not be read: {error}"));
        let invalid = |why: String| of_file(path, io::ErrorKind::InvalidData, &why);
        let file = File::open(path).map_err(failed)?;
        let mode = file.metadata().map_err(failed)?.mode() & 0o777;
        if mode & FORBIDDEN != 0 {
            return Err(invalid(format!(
                "is open to other accounts (mode {mode:03o}): `chmod 600` it, or 640 for a group that may know it"
            )));
        }
        let mut text = String::new();
        file.take(MAX_FILE_LENGTH)
            .read_to_string(&mut text)
            .map_err(failed)?;
        // Editors of Windows begin a file with a byte order mark.
        text.trim_start_matches('\u{feff}')
            .trim()
            .parse()
            .map_err(|wrong| invalid(format!("holds no token: {wrong}")))
    }

    /// The token that a file holds. If the file does not exist, it is made with a random token, for its
    /// owner alone.
    ///
    /// # Errors
    /// As [`Self::from_file`], and where the file cannot be made.
    pub fn from_file_or_new(path: &Path) -> io::Result<Self> {
        match Self::from_file(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            read => return read,
        }
        let made = Self::random().and_then(|token| token.write(path));
        made.map_err(|error| {
            let why = format!("could not be made ({error}): make its folder, or give another file");
            of_file(path, error.kind(), &why)
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
    pub fn reveal(&self) -> &str {
        &self.0
    }

    /// Whether `given` is this token. The time it takes reveals neither where they differ nor how long
    /// the token is: hashes are compared, and theirs is a comparison in constant time.
    pub fn is(&self, given: &str) -> bool {
        blake3::hash(given.as_bytes()) == blake3::hash(self.0.as_bytes())
    }
}

fn of_file(path: &Path, kind: io::ErrorKind, why: &str) -> io::Error {
    io::Error::new(kind, format!("the token's file {} {why}", path.display()))
}

impl FromStr for Token {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let plain = text
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'));
        if plain && LENGTHS.contains(&text.len()) {
            Ok(Self(text.to_owned()))
        } else {
            Err(NO_TOKEN)
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
            assert_eq!(text.parse::<Token>(), Err(NO_TOKEN), "{text:?}");
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
        let kind = |path: &Path| Token::from_file(path).unwrap_err().kind();
        assert_eq!(kind(&path), io::ErrorKind::InvalidData);
        assert_eq!(kind(&folder.path().join("none")), io::ErrorKind::NotFound);
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
        let error = nowhere.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
        assert!(error.to_string().contains("none/token"), "{error}");
    }

    #[test]
    fn a_token_does_not_get_into_logs() {
        let token = Token::random().unwrap();
        assert!(!format!("{token:?}").contains(token.reveal()));
    }
}
