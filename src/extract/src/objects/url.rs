//! URLs of object stores: told from paths, and shown without credentials.

use std::path::Path;

#[cfg(any(feature = "object-store", test))]
use super::ExtractError;

/// Whether a path is a URL, such as `s3://bucket/sessions`.
pub fn is_url(path: &Path) -> bool {
    let Some((scheme, _)) = path.to_str().and_then(|text| text.split_once("://")) else {
        return false;
    };
    let valid = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
    scheme.starts_with(|c: char| c.is_ascii_alphabetic()) && scheme.chars().all(valid)
}

/// That a URL holds no credentials, which would be printed and recorded.
#[cfg(any(feature = "object-store", test))]
pub(super) fn check(url: &Path) -> Result<(), ExtractError> {
    let text = url.to_string_lossy();
    let rest = text.split_once("://").map_or("", |(_, rest)| rest);
    let host = rest.split('/').next().unwrap_or_default();
    if host.contains('@') || rest.contains('?') {
        Err(ExtractError::Refused(format!(
            "{} has credentials or a query: put them into the environment",
            without_credentials(&text)
        )))
    } else {
        Ok(())
    }
}

/// A URL as it may be printed.
pub(super) fn without_credentials(url: &str) -> String {
    let url = url.split(['?', '#']).next().unwrap_or_default();
    let url = url.trim_end_matches('/');
    let Some((scheme, rest)) = url.split_once("://") else {
        return url.to_owned();
    };
    let (host, path) = rest.split_once('/').unwrap_or((rest, ""));
    let host = host.rsplit('@').next().unwrap_or_default();
    match path {
        "" => format!("{scheme}://{host}"),
        path => format!("{scheme}://{host}/{path}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn credentials_in_a_url_are_refused_and_not_printed() {
        for url in ["s3://key:secret@bucket/a", "s3://bucket/a?sig=secret"] {
            let text = check(Path::new(url)).unwrap_err().to_string();
            assert!(
                text.contains("s3://bucket/a") && !text.contains("secret"),
                "{text}"
            );
        }
        check(Path::new("s3://bucket/a@b")).unwrap();
    }

    #[test]
    fn a_url_is_told_from_a_path() {
        for url in ["s3://bucket/a", "az://c", "file:///tmp"] {
            assert!(is_url(Path::new(url)), "{url}");
        }
        for path in ["a/b", "/s3:/x", "C:\\a", "://a", "1a://b"] {
            assert!(!is_url(Path::new(path)), "{path}");
        }
    }
}
