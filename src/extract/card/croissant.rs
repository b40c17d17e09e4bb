//! The metadata for programs: Croissant 1.0, JSON-LD.

use relit_data::shard::{Dataset, Layout};
use serde_json::{Value, json};

use super::facts::{CardFacts, SummedFile};

/// Columns of the tables that are described as fields: name, type, meaning.
const FIELDS: [(&str, &str, &str); 12] = [
    ("session", "sc:Text", "the session's id"),
    ("object", "sc:Text", "the object's name"),
    (
        "index",
        "sc:Integer",
        "which sample of the turn this is, from 0",
    ),
    (
        "source_frame",
        "sc:Integer",
        "position of the frame in the video",
    ),
    (
        "t_us",
        "sc:Integer",
        "time stamp of the frame, microseconds",
    ),
    ("angle_deg", "sc:Float", "angle of the table, degrees"),
    (
        "duplicate",
        "sc:Boolean",
        "another sample shows the same frame",
    ),
    ("mask_px", "sc:Integer", "source pixels of the object"),
    (
        "saturated_fraction",
        "sc:Float",
        "part of them that is saturated in all channels",
    ),
    (
        "spec_net",
        "sc:Boolean",
        "saturated_fraction is above the gate",
    ),
    (
        "mean_r",
        "sc:Float",
        "mean 8-bit sRGB value of the object, red",
    ),
    (
        "sharpness",
        "sc:Float",
        "variance of the Laplacian of luma over the object",
    ),
];

/// The content of `croissant.json`.
pub(super) fn metadata(facts: &CardFacts, dataset: &Dataset, files: &[SummedFile]) -> String {
    let creators: Vec<Value> = facts
        .creators
        .iter()
        .map(|name| json!({ "@type": "sc:Person", "name": name }))
        .collect();
    let tables: Vec<&str> = dataset
        .sessions
        .iter()
        .map(|session| session.table.file.as_str())
        .collect();
    let mut document = json!({
        "@context": context(),
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": facts.name,
        "description": facts.description,
        "license": facts.license_url(),
        "url": facts.url,
        "creator": creators,
        "datePublished": facts.published,
        "version": facts.version,
        "distribution": files.iter().map(distribution).collect::<Vec<_>>(),
        "recordSet": tables.iter().map(|table| records(table)).collect::<Vec<_>>(),
    });
    if let Some(cite) = &facts.cite {
        document["citeAs"] = cite.as_str().into();
    }
    if dataset.settings.layout == Layout::Webdataset {
        document["keywords"] = json!(["relighting", "photometric stereo", "webdataset"]);
    }
    let mut text = format!("{document:#}");
    text.push('\n');
    text
}

fn distribution(file: &SummedFile) -> Value {
    json!({
        "@type": "cr:FileObject",
        "@id": file.name,
        "name": file.name,
        "contentUrl": file.name,
        "contentSize": format!("{} B", file.bytes),
        "encodingFormat": encoding(&file.name),
        "sha256": file.sha256,
    })
}

fn encoding(name: &str) -> &'static str {
    match name.rsplit('.').next() {
        Some("tar") => "application/x-tar",
        Some("parquet") => "application/x-parquet",
        Some("json") => "application/json",
        Some("html") => "text/html",
        _ => "image/png",
    }
}

/// The records of a table.
fn records(table: &str) -> Value {
    let set = table.strip_suffix(".parquet").unwrap_or(table);
    let fields: Vec<Value> = FIELDS
        .iter()
        .map(|(name, kind, meaning)| {
            json!({
                "@type": "cr:Field",
                "@id": format!("{set}/{name}"),
                "name": format!("{set}/{name}"),
                "description": meaning,
                "dataType": kind,
                "source": { "fileObject": { "@id": table }, "extract": { "column": name } },
            })
        })
        .collect();
    json!({
        "@type": "cr:RecordSet",
        "@id": set,
        "name": set,
        "description": "one record a sample",
        "key": { "@id": format!("{set}/index") },
        "field": fields,
    })
}

/// The context that Croissant 1.0 prescribes.
fn context() -> Value {
    json!({
        "@language": "en",
        "@vocab": "https://schema.org/",
        "citeAs": "cr:citeAs",
        "column": "cr:column",
        "conformsTo": "dct:conformsTo",
        "cr": "http://mlcommons.org/croissant/",
        "rai": "http://mlcommons.org/croissant/RAI/",
        "data": { "@id": "cr:data", "@type": "@json" },
        "dataType": { "@id": "cr:dataType", "@type": "@vocab" },
        "dct": "http://purl.org/dc/terms/",
        "examples": { "@id": "cr:examples", "@type": "@json" },
        "extract": "cr:extract",
        "field": "cr:field",
        "fileProperty": "cr:fileProperty",
        "fileObject": "cr:fileObject",
        "fileSet": "cr:fileSet",
        "format": "cr:format",
        "includes": "cr:includes",
        "isLiveDataset": "cr:isLiveDataset",
        "jsonPath": "cr:jsonPath",
        "key": "cr:key",
        "md5": "cr:md5",
        "parentField": "cr:parentField",
        "path": "cr:path",
        "recordSet": "cr:recordSet",
        "references": "cr:references",
        "regex": "cr:regex",
        "repeated": "cr:repeated",
        "replace": "cr:replace",
        "sc": "https://schema.org/",
        "separator": "cr:separator",
        "source": "cr:source",
        "subField": "cr:subField",
        "transform": "cr:transform",
    })
}
