//! What a published data set has beside it: `README.md` for people, `croissant.json` for programs, `SHA256SUMS`.
//!
//! The metadata follow Croissant 1.0 (ML Commons): every shard and table as a file with its checksum, and the tables'
//! rows as records. They are made out of `dataset.json` and the tables; only checksums need the shards.

mod croissant;
mod facts;
mod readme;

use std::fs::File;
use std::io::{self, Read, Write as _};
use std::path::Path;

use relit_data::durable::write_whole;
use relit_data::shard::{Dataset, Layout, Overview, ShardError};
use sha2::{Digest as _, Sha256};

use self::facts::SummedFile;
use crate::ExtractError;

pub use self::facts::CardFacts;

/// How a README.md begins that a card wrote.
const MARKER: &str = "<!-- Written by relit-extract card. -->\n";
/// The files that are written.
const FILES: [&str; 3] = ["README.md", "croissant.json", "SHA256SUMS"];
/// Bytes that are read at a time.
const PIECE: usize = 1 << 20;

/// Writes the files that describe the data set in `out`: their names. `progress` is told how many files are summed of how
/// many.
///
/// # Errors
/// Where the folder holds no data set, a file that it lists cannot be read or is not what it says, a README.md is there that
/// no card wrote, or a file cannot be written.
pub fn write_card(
    out: &Path,
    facts: &CardFacts,
    progress: &dyn Fn(u64, u64),
) -> Result<[&'static str; 3], ExtractError> {
    let dataset = Dataset::read(out)?;
    let overview = Overview::read(out)?;
    let page = out.join(FILES[0]);
    if std::fs::read(&page).is_ok_and(|own| !own.starts_with(MARKER.as_bytes())) {
        return Err(ExtractError::OwnReadme(page));
    }
    // Checksums of what is damaged would make it look whole.
    for session in &dataset.sessions {
        dataset.check_integrity(out, &session.id)?;
    }
    let names = listed(out, &dataset)?;
    let mut files = Vec::with_capacity(names.len());
    for name in names {
        let path = out.join(&name);
        let (bytes, sha256) = summed(&path).map_err(|source| ShardError::Io {
            doing: "read",
            path,
            source,
        })?;
        files.push(SummedFile {
            name,
            bytes,
            sha256,
        });
        progress(files.len() as u64, files.capacity() as u64);
    }
    let write = |name: &str, content: &str| {
        write_whole(&out.join(name), content.as_bytes()).map_err(|source| ShardError::Io {
            doing: "write",
            path: out.join(name),
            source,
        })
    };
    let sums: String = files
        .iter()
        .map(|file| format!("{}  {}\n", file.sha256, file.name))
        .collect();
    let page = readme::readme(facts, &overview, &dataset, &files);
    write(FILES[0], &format!("{MARKER}{page}"))?;
    write(FILES[1], &croissant::metadata(facts, &dataset, &files))?;
    write(FILES[2], &sums)?;
    Ok(FILES)
}

/// The files of a data set, relative to its folder, sorted: `dataset.json`, tables, reports, shards, and in the layout
/// `relit` every image.
fn listed(out: &Path, dataset: &Dataset) -> Result<Vec<String>, ShardError> {
    let mut names = vec![Dataset::FILE.to_owned()];
    for session in &dataset.sessions {
        names.push(session.table.file.clone());
        names.extend(session.report.iter().map(|report| report.file.clone()));
    }
    for shard in &dataset.shards {
        let others = shard.mask.iter().chain(&shard.mean_img);
        names.extend(others.map(|file| file.file.clone()));
        match dataset.settings.layout {
            Layout::Webdataset => names.push(shard.file.clone()),
            Layout::Relit => {
                let read = |source| ShardError::Io {
                    doing: "read",
                    path: out.join(&shard.file),
                    source,
                };
                for entry in std::fs::read_dir(out.join(&shard.file)).map_err(read)? {
                    let image = entry.map_err(read)?.file_name();
                    names.push(format!("{}/{}", shard.file, image.to_string_lossy()));
                }
            }
        }
    }
    names.sort();
    Ok(names)
}

/// Length and SHA-256 of a file: what Croissant and `sha256sum` know, which do not know BLAKE3.
fn summed(path: &Path) -> io::Result<(u64, String)> {
    let mut file = File::open(path)?;
    let mut hasher = Sha256::new();
    let mut piece = vec![0; PIECE];
    let mut bytes = 0;
    loop {
        let read = file.read(&mut piece)?;
        if read == 0 {
            break;
        }
        bytes += read as u64;
        hasher.write_all(&piece[..read])?;
    }
    let hex = hasher
        .finalize()
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect();
    Ok((bytes, hex))
}
