//! Header entries of FITS files, and attributes of other files seen in the same way.

/// One entry of a header.
#[derive(Clone, Debug, PartialEq)]
pub struct Card {
    /// The keyword, one to eight of A-Z, 0-9, '-' and '_'.
    pub key: String,
    /// The value.
    pub value: CardValue,
    /// The meaning in words; may be empty. It is cut where the line ends.
    pub comment: String,
}

/// The value of a header entry.
#[derive(Clone, Debug, PartialEq)]
pub enum CardValue {
    /// Text of any length. What is not printable ASCII is written as in a Rust string, such as `\u{e9}`.
    Text(String),
    /// A number; those that are not finite, which FITS cannot hold, are written as text.
    Real(f64),
    /// A whole number.
    Integer(i64),
    /// True or false.
    Logical(bool),
}
