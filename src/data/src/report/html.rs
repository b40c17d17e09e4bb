//! The document around a body, and text that is safe inside HTML, for any name of a
//! session, an object or a path.

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

/// `text` for an element's content or a quoted attribute: markup is escaped, and characters that
/// HTML does not allow or that change the writing direction are replaced by U+FFFD.
pub(super) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\n' | '\t' => safe.push(' '),
            c if c.is_control() || is_noncharacter(c) || is_direction_override(c) => {
                safe.push('\u{fffd}');
            }
            c => safe.push(c),
        }
    }
    safe
}

fn is_noncharacter(c: char) -> bool {
    matches!(c, '\u{fdd0}'..='\u{fdef}') || u32::from(c) & 0xfffe == 0xfffe
}

fn is_direction_override(c: char) -> bool {
    matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// `no duplicates`, `1 duplicate`, `2 duplicates`, the number in bold.
pub(super) fn counted(count: usize, noun: &str) -> String {
    match count {
        0 => format!("no {noun}s"),
        1 => format!("<b>1</b> {noun}"),
        _ => format!("<b>{count}</b> {noun}s"),
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_a_name_becomes_text() {
        let safe = escape("<b onclick='x'>\"&amp;\"</b>");
        assert_eq!(
            safe,
            "&lt;b onclick=&#39;x&#39;&gt;&quot;&amp;amp;&quot;&lt;/b&gt;"
        );
    }

    #[test]
    fn other_scripts_pass_and_control_characters_do_not() {
        assert_eq!(escape("Schüssel 碗 🐄"), "Schüssel 碗 🐄");
        assert_eq!(
            escape("a\0b\u{202e}c\nd\u{ffff}"),
            "a\u{fffd}b\u{fffd}c d\u{fffd}"
        );
    }
}
