//! The document around a body, its warnings and tables.

use super::text::escape;
use crate::shard::QualityVerdict;

const STYLE: &str = include_str!("style.css");

/// A page with this title, which is safe already.
pub(super) fn document(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         img-src data:; style-src 'unsafe-inline'\">\n\
         <title>{title} \u{2013} relit</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         {body}</body>\n</html>\n"
    )
}

/// A verdict as a mark.
pub(super) fn badge(verdict: QualityVerdict) -> String {
    format!("<b class=\"badge {verdict}\">{verdict}</b>")
}

/// The warnings as a section; empty text if there are none.
pub(super) fn warnings(warnings: &[String]) -> String {
    if warnings.is_empty() {
        return String::new();
    }
    let items: String = warnings
        .iter()
        .map(|text| format!("<li><bdi>{}</bdi></li>\n", escape(text)))
        .collect();
    format!("<section class=\"warnings\">\n<h2>Warnings</h2>\n<ul>\n{items}</ul>\n</section>\n")
}

/// A table of names and values, one row each; empty text if there are none.
pub(super) fn table(heading: &str, rows: &[(String, String)]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let body: String = rows
        .iter()
        .map(|(name, value)| {
            let (name, value) = (escape(name), escape(value));
            format!("<tr><th scope=\"row\">{name}</th><td><bdi>{value}</bdi></td></tr>\n")
        })
        .collect();
    format!("<section>\n<h2>{heading}</h2>\n<table>\n{body}</table>\n</section>\n")
}
