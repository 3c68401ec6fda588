//! Header entries of the files that the program writes.

use longan_formats::{Card, CardValue};

/// A header entry.
pub(crate) fn card(key: &str, value: CardValue, comment: &str) -> Card {
    Card { key: key.to_owned(), value, comment: comment.to_owned() }
}

/// A text entry.
pub(crate) fn text(key: &str, value: impl Into<String>, comment: &str) -> Card {
    card(key, CardValue::Text(value.into()), comment)
}

/// A real entry.
pub(crate) fn real(key: &str, value: f64, comment: &str) -> Card {
    card(key, CardValue::Real(value), comment)
}

/// An integer entry.
pub(crate) fn integer(key: &str, value: usize, comment: &str) -> Card {
    card(key, CardValue::Integer(value as i64), comment)
}

/// Name and version of this program.
pub(crate) fn creator() -> Card {
    text("CREATOR", concat!("longan ", env!("CARGO_PKG_VERSION")), "program that wrote this file")
}

/// A keyword with a number, within the eight characters of FITS: FORMULA1 to FORMULA9, FORMUL10 and so on.
pub(crate) fn numbered(keyword: &str, number: usize) -> String {
    let number = number.to_string();
    let room = 8usize.saturating_sub(number.len()).min(keyword.len());
    format!("{}{number}", &keyword[..room])
}
