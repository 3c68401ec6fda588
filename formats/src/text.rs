//! Texts of files and systems as parts of one sentence.

use std::fmt::Display;

/// A name, or a part of a file, on one line: control characters are shown as U+FFFD.
pub(crate) fn on_one_line(text: impl Display) -> String {
    text.to_string().replace(char::is_control, "\u{fffd}")
}

/// Words of a library, or a list, on one line: control characters become spaces.
pub(crate) fn spaced(text: impl Display) -> String {
    text.to_string().replace(char::is_control, " ")
}

/// A part of a file on one line, cut where it is long.
pub(crate) fn shortened(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut short = on_one_line(text.chars().take(LONGEST).collect::<String>());
    if text.chars().count() > LONGEST {
        short.push('…');
    }
    short
}

/// A number of bytes in GiB.
pub(crate) fn gibibytes(bytes: f64) -> f64 {
    bytes / f64::from(1 << 30)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_shown_on_one_short_line() {
        assert_eq!(shortened("a\nb"), "a\u{fffd}b");
        assert_eq!(shortened(&"é".repeat(100)).chars().count(), 61);
        assert_eq!(shortened(&"é".repeat(60)).chars().count(), 60);
    }
}
