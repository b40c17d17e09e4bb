//! The objects below a URL, by their names relative to it.

use std::error::Error;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use futures_util::TryStreamExt;
use object_store::aws::AmazonS3Builder;
use object_store::azure::MicrosoftAzureBuilder;
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::local::LocalFileSystem;
use object_store::path::Path as Key;
use object_store::{
    ObjectStore, ObjectStoreExt, ObjectStoreScheme, PutPayload, RetryConfig, WriteMultipart,
};
use tokio::runtime::Runtime;
use url::Url;

use relit_data::durable::Partial;

use super::url::{check, without_credentials};
use crate::ExtractError;

/// Bytes that are uploaded at once; a longer object goes up in parts of this size.
const PART: usize = 8 << 20;
/// Parts on the way at the same time.
const PARTS_AT_ONCE: usize = 4;
/// How often and how long a request is repeated.
const RETRIES: usize = 6;
const RETRY_FOR: Duration = Duration::from_secs(60);

/// The objects below a URL.
pub(super) struct Bucket {
    store: Arc<dyn ObjectStore>,
    root: Key,
    /// The URL without credentials, query and final slash.
    shown: String,
    runtime: Runtime,
}

impl Bucket {
    /// The objects below `url`; credentials, endpoint and region come from the environment, by the
    /// store's usual names (`AWS_ACCESS_KEY_ID`, ...).
    pub(super) fn open(url: &Path) -> Result<Self, ExtractError> {
        check(url)?;
        let text = url.to_string_lossy();
        let shown = without_credentials(&text);
        let wrong = |why: &str| {
            ExtractError::Refused(format!(
                "{shown} is not an object store: {why}; give s3://BUCKET/PATH, gs://BUCKET/PATH, az://CONTAINER/PATH or file:///PATH"
            ))
        };
        let parsed = Url::parse(&text).map_err(|error| wrong(&error.to_string()))?;
        let unknown = |_| wrong("its kind is not known");
        let (scheme, _) = ObjectStoreScheme::parse(&parsed).map_err(unknown)?;
        let invalid = |_| wrong("its path cannot be an object's");
        let root = Key::from_url_path(parsed.path()).map_err(invalid)?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .map_err(|error| wrong(&error.to_string()))?;
        let unusable = |error: object_store::Error| wrong(&reason(&error));
        let store = store_of(&scheme, &parsed).map_err(unusable)?;
        let store = store.ok_or_else(|| wrong("its kind is not supported"))?;
        Ok(Self {
            store,
            root,
            shown,
            runtime,
        })
    }

    /// The URL of a name.
    pub(super) fn url(&self, name: &str) -> String {
        match name {
            "" => self.shown.clone(),
            name => format!("{}/{name}", self.shown),
        }
    }

    fn key(&self, name: &str) -> Key {
        let parts = name.split('/').filter(|part| !part.is_empty());
        parts.fold(self.root.clone(), |key, part| key.join(part))
    }

    fn failed(&self, doing: &'static str, name: &str, error: &object_store::Error) -> ExtractError {
        let url = self.url(name);
        let why = reason(error);
        // Listing has no kinds of errors of its own: the store's answer tells.
        let answered = |status: &str| why.contains(&format!("status code: {status}"));
        let is_refused = matches!(
            error,
            object_store::Error::PermissionDenied { .. }
                | object_store::Error::Unauthenticated { .. }
        );
        if matches!(error, object_store::Error::NotFound { .. }) || answered("404") {
            return not_there(&url);
        }
        ExtractError::Refused(if is_refused || answered("403") || answered("401") {
            format!(
                "{url} may not be {doing}: check the credentials in the environment and what they allow"
            )
        } else {
            format!(
                "{url} could not be {doing}: {why}; what was finished is there, run again with --resume"
            )
        })
    }

    /// The names of all objects below the URL with their lengths, sorted. That of an object under the very
    /// URL is empty.
    pub(super) fn list(&self) -> Result<Vec<(String, u64)>, ExtractError> {
        let failed = |error| self.failed("listed", "", &error);
        let below = self.store.list(Some(&self.root));
        let found: Vec<_> = self.runtime.block_on(below.try_collect()).map_err(failed)?;
        let mut named: Vec<(String, u64)> = found
            .iter()
            .filter_map(|object| {
                let parts = object.location.prefix_match(&self.root)?;
                let parts: Vec<_> = parts.map(|part| part.as_ref().to_owned()).collect();
                Some((parts.join("/"), object.size))
            })
            .collect();
        if named.is_empty()
            && let Some(length) = self.length("")?
        {
            named.push((String::new(), length));
        }
        named.sort();
        Ok(named)
    }

    /// The length of an object, if it is there.
    pub(super) fn length(&self, name: &str) -> Result<Option<u64>, ExtractError> {
        match self.runtime.block_on(self.store.head(&self.key(name))) {
            Ok(found) => Ok(Some(found.size)),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(self.failed("read", name, &error)),
        }
    }

    /// Whether there is an object under the name or below it.
    pub(super) fn holds_any(&self, name: &str) -> Result<bool, ExtractError> {
        let key = self.key(name);
        let failed = |error| self.failed("listed", name, &error);
        let mut below = self.store.list(Some(&key));
        let first = self.runtime.block_on(below.try_next()).map_err(failed)?;
        Ok(first.is_some())
    }

    /// Brings an object to a file, which appears when it is whole.
    pub(super) fn download(&self, name: &str, to: &Path) -> Result<(), ExtractError> {
        let local = |doing| ExtractError::io(doing, to);
        if let Some(folder) = to.parent() {
            std::fs::create_dir_all(folder).map_err(ExtractError::io("made", folder))?;
        }
        let mut file = Partial::create(to).map_err(local("created"))?;
        let failed = |error| self.failed("read", name, &error);
        self.runtime.block_on(async {
            let found = self.store.get(&self.key(name)).await.map_err(failed)?;
            let mut pieces = found.into_stream();
            while let Some(piece) = pieces.try_next().await.map_err(failed)? {
                file.write_all(&piece).map_err(local("written"))?;
            }
            Ok::<(), ExtractError>(())
        })?;
        let sealed = file.seal().map_err(local("written"))?;
        sealed.publish().map_err(local("written"))
    }

    /// Brings a file to the store, where it appears when it is whole.
    pub(super) fn upload(&self, from: &Path, name: &str) -> Result<(), ExtractError> {
        let local = |doing| ExtractError::io(doing, from);
        let failed = |error| self.failed("written", name, &error);
        let mut file = File::open(from).map_err(local("read"))?;
        let length = file.metadata().map_err(local("read"))?.len();
        let key = self.key(name);
        if length <= PART as u64 {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).map_err(local("read"))?;
            let put = self.store.put(&key, PutPayload::from(bytes));
            return self.runtime.block_on(put).map(|_| ()).map_err(failed);
        }
        self.runtime.block_on(async {
            let upload = self.store.put_multipart(&key).await.map_err(failed)?;
            let mut upload = WriteMultipart::new_with_chunk_size(upload, PART);
            let mut part = vec![0; PART];
            loop {
                let read = match file.read(&mut part) {
                    Ok(read) => read,
                    Err(error) => {
                        // What was uploaded of it is given up; the error says what matters.
                        let _ = upload.abort().await;
                        return Err(local("read")(error));
                    }
                };
                let Some(bytes @ [_, ..]) = part.get(..read) else {
                    break;
                };
                let waited = upload.wait_for_capacity(PARTS_AT_ONCE).await;
                if let Err(error) = waited {
                    let _ = upload.abort().await;
                    return Err(failed(error));
                }
                upload.write(bytes);
            }
            upload.finish().await.map(|_| ()).map_err(failed)
        })
    }
}

/// That a bucket or object does not exist.
pub(super) fn not_there(url: &str) -> ExtractError {
    ExtractError::Refused(format!(
        "{url} is not there: check the name of the bucket and the path"
    ))
}

/// The store of a URL; `None` for an unsupported kind.
fn store_of(
    scheme: &ObjectStoreScheme,
    url: &Url,
) -> Result<Option<Arc<dyn ObjectStore>>, object_store::Error> {
    // Another part of the program may have chosen a provider already.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let retry = RetryConfig {
        max_retries: RETRIES,
        retry_timeout: RETRY_FOR,
        ..RetryConfig::default()
    };
    Ok(Some(match scheme {
        ObjectStoreScheme::Local => Arc::new(LocalFileSystem::new()),
        ObjectStoreScheme::AmazonS3 => {
            let builder = AmazonS3Builder::from_env().with_url(url.as_str());
            Arc::new(builder.with_retry(retry).build()?)
        }
        ObjectStoreScheme::GoogleCloudStorage => {
            let builder = GoogleCloudStorageBuilder::from_env().with_url(url.as_str());
            Arc::new(builder.with_retry(retry).build()?)
        }
        ObjectStoreScheme::MicrosoftAzure => {
            let builder = MicrosoftAzureBuilder::from_env().with_url(url.as_str());
            Arc::new(builder.with_retry(retry).build()?)
        }
        _ => return Ok(None),
    }))
}

/// The innermost reason in one line, without the body of a store's answer.
fn reason(error: &object_store::Error) -> String {
    let mut innermost: &dyn Error = error;
    while let Some(source) = innermost.source() {
        innermost = source;
    }
    let text = innermost.to_string();
    let line = text.split(['<', '\n']).next().unwrap_or_default();
    line.trim_end_matches([':', ' ']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_url_of_no_object_store_is_refused() {
        for url in ["ftp://host/a", "https://host/a", "s3://"] {
            assert!(Bucket::open(Path::new(url)).is_err(), "{url}");
        }
    }

    #[test]
    fn objects_come_back_as_they_were_uploaded_also_in_parts() {
        let folder = tempfile::tempdir().unwrap();
        let bucket = format!("file://{}/bucket", folder.path().display());
        let bucket = Bucket::open(Path::new(&bucket)).unwrap();
        assert_eq!(bucket.list().unwrap(), []);
        let (from, to) = (folder.path().join("from"), folder.path().join("to/x"));
        for length in [0, 10, PART, 2 * PART + 17] {
            let bytes: Vec<u8> = (0..length).map(|n| (n % 251) as u8).collect();
            std::fs::write(&from, &bytes).unwrap();
            bucket.upload(&from, "a/b.tar").unwrap();
            assert_eq!(
                bucket.list().unwrap(),
                [("a/b.tar".to_owned(), length as u64)]
            );
            bucket.download("a/b.tar", &to).unwrap();
            assert!(std::fs::read(&to).unwrap() == bytes, "{length}");
        }
        assert_eq!(bucket.length("a/c").unwrap(), None);
        assert!(bucket.holds_any("a").unwrap() && !bucket.holds_any("c").unwrap());
        let missing = bucket.download("a/c", &to).unwrap_err();
        assert!(missing.to_string().contains("a/c"), "{missing}");
    }
}
