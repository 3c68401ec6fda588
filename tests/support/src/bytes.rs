//! FITS files, made byte by byte.

/// A column of a table: its name, TFORM, the bytes of all rows, and keywords to which its number is appended.
#[derive(Debug)]
pub struct Col<'a> {
    /// TTYPE.
    pub name: &'a str,
    /// TFORM.
    pub form: &'a str,
    /// Of all rows.
    pub bytes: Vec<u8>,
    /// Keywords without the number, and values.
    pub keys: &'a [(&'a str, &'a str)],
}

/// A column without keywords.
pub fn col<'a>(name: &'a str, form: &'a str, bytes: Vec<u8>) -> Col<'a> {
    Col { name, form, bytes, keys: &[] }
}

/// Big-endian bytes.
pub fn f64s(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_be_bytes()).collect()
}

/// Big-endian bytes.
pub fn f32s(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|v| (*v as f32).to_be_bytes()).collect()
}

/// Big-endian bytes.
pub fn i64s(values: &[i64]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_be_bytes()).collect()
}

/// Big-endian bytes.
pub fn i32s(values: &[i32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_be_bytes()).collect()
}

/// Big-endian bytes.
pub fn i16s(values: &[i16]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_be_bytes()).collect()
}

/// Text in quotes, as a header has it.
pub fn quoted(text: &str) -> String {
    format!("'{text:8}'")
}

/// One header, padded to whole blocks.
pub fn header(cards: &[(&str, String)]) -> Vec<u8> {
    let mut out = Vec::new();
    for (key, value) in cards {
        let value = if value.starts_with('\'') { value.clone() } else { format!("{value:>20}") };
        out.extend(format!("{:<80}", format!("{key:<8}= {value}")).bytes());
    }
    out.extend(format!("{:<80}", "END").bytes());
    pad(&mut out, b' ');
    out
}

fn pad(bytes: &mut Vec<u8>, with: u8) {
    bytes.resize(bytes.len().next_multiple_of(2880), with);
}

fn number(value: usize) -> String {
    value.to_string()
}

/// A primary HDU without data.
pub fn primary() -> Vec<u8> {
    header(&[("SIMPLE", "T".to_owned()), ("BITPIX", number(8)), ("NAXIS", number(0))])
}

/// A primary HDU with a picture.
pub fn picture(width: usize, height: usize) -> Vec<u8> {
    let mut out = header(&[
        ("SIMPLE", "T".to_owned()),
        ("BITPIX", number(8)),
        ("NAXIS", number(2)),
        ("NAXIS1", number(width)),
        ("NAXIS2", number(height)),
    ]);
    out.extend(vec![0; width * height]);
    pad(&mut out, 0);
    out
}

/// A binary table.
pub fn table(rows: usize, columns: &[Col<'_>], keys: &[(&str, &str)]) -> Vec<u8> {
    let widths: Vec<_> = columns.iter().map(|c| c.bytes.len() / rows.max(1)).collect();
    let mut cards = vec![
        ("XTENSION", quoted("BINTABLE")),
        ("BITPIX", number(8)),
        ("NAXIS", number(2)),
        ("NAXIS1", number(widths.iter().sum())),
        ("NAXIS2", number(rows)),
        ("PCOUNT", number(0)),
        ("GCOUNT", number(1)),
        ("TFIELDS", number(columns.len())),
    ];
    let mut numbered = Vec::new();
    for (i, c) in (1..).zip(columns) {
        assert_eq!(c.bytes.len() % rows.max(1), 0, "whole rows");
        numbered.push((format!("TTYPE{i}"), quoted(c.name)));
        numbered.push((format!("TFORM{i}"), quoted(c.form)));
        numbered.extend(c.keys.iter().map(|(key, value)| (format!("{key}{i}"), (*value).to_owned())));
    }
    cards.extend(numbered.iter().map(|(key, value)| (key.as_str(), value.clone())));
    for &(key, value) in keys {
        // A key that is there already is changed, to make headers that are wrong.
        match cards.iter_mut().find(|(k, _)| *k == key) {
            Some(card) => card.1 = value.to_owned(),
            None => cards.push((key, value.to_owned())),
        }
    }
    let mut out = header(&cards);
    for row in 0..rows {
        for (c, &width) in columns.iter().zip(&widths) {
            out.extend(&c.bytes[row * width..(row + 1) * width]);
        }
    }
    pad(&mut out, 0);
    out
}

/// A file of an empty primary HDU and one table.
pub fn file(rows: usize, columns: &[Col<'_>], keys: &[(&str, &str)]) -> Vec<u8> {
    [primary(), table(rows, columns, keys)].concat()
}

/// The bytes compressed.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}
