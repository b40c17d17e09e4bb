//! Text that is safe inside HTML, for any name of a session, an object or a path, and numbers in words.

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

/// `value` with at most `decimals` decimals and no trailing zeros.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    if text == "-0" {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}

/// A fraction as percent, `0.05` as `5 %`.
pub(super) fn percent(fraction: f64) -> String {
    format!("{} %", number(fraction * 100.0, 2))
}

/// An angle, `12.34` as `12.3°`.
pub(super) fn degrees(angle: f64) -> String {
    format!("{angle:.1}°")
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

    #[test]
    fn numbers_have_no_trailing_zeros() {
        assert_eq!(number(5.0, 2), "5");
        assert_eq!(number(0.19, 2), "0.19");
        assert_eq!(number(100.0, 0), "100");
        assert_eq!(number(-0.001, 2), "0");
        assert_eq!(percent(1.0 / 3.0), "33.33 %");
    }
}
