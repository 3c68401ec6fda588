//! Named columns of values at points, and the choice of the one that is to become a map.
//!
//! What else columns may be (coordinates, colours) is left to the adapters.

use crate::names::is_alike;
use crate::{Description, Error, Field, FieldDescription, GridDescription, Selection, TableDescription, TablePlace};

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    /// Its heading, as the file has it.
    pub(crate) heading: String,
    /// Its name, which is the heading without a unit.
    pub(crate) name: String,
    /// Its unit, where the heading has one.
    pub(crate) unit: Option<String>,
    /// Whether it holds values that can be a map. Others are taken only if asked for by name.
    pub(crate) values: bool,
}

/// Number of the column that holds a field: that of this name, or the one of this number among those of values. Unless
/// given it is the only one of values.
pub(crate) fn choose(columns: &[Column], field: Option<&Field>) -> Result<usize, Error> {
    let candidates: Vec<usize> = (0..columns.len()).filter(|&i| columns[i].values).collect();
    let several = || Error::SeveralColumns { columns: listed(columns) };
    match field {
        None if candidates.len() > 1 => Err(several()),
        None => candidates.first().copied().ok_or_else(|| Error::NoValueColumn {
            coordinates: columns.iter().map(|c| format!("'{}'", shown(&c.heading))).collect::<Vec<_>>().join(", "),
        }),
        Some(field) => {
            let found = match field {
                Field::Name(name) => named(columns, name),
                Field::Number(number) => {
                    candidates.get(*number).map_or_else(|| named(columns, &number.to_string()), |&i| vec![i])
                }
            };
            match found[..] {
                [] => Err(Error::UnknownColumn { field: field.to_string(), columns: listed(columns) }),
                [i] => Ok(i),
                _ => Err(several()),
            }
        }
    }
}

/// The columns of a name: of those that match best.
fn named(columns: &[Column], name: &str) -> Vec<usize> {
    let name = name.trim();
    let matches: [&dyn Fn(&Column) -> bool; 4] =
        [&|c| c.heading == name, &|c| c.name == name, &|c| is_alike(&c.heading, name), &|c| is_alike(&c.name, name)];
    let found = matches.iter().map(|matches| (0..columns.len()).filter(|&i| matches(&columns[i])).collect::<Vec<_>>());
    found.into_iter().find(|found| !found.is_empty()).unwrap_or_default()
}

/// What a file holds whose columns are these.
pub(crate) fn describe(format: &'static str, grid: GridDescription, columns: &[Column]) -> Description {
    let field = |c: &Column| FieldDescription { name: c.name.clone(), unit: c.unit.clone(), long_name: None };
    let fields = columns.iter().filter(|c| c.values).map(field).collect();
    let table =
        TableDescription { place: TablePlace::File {}, grid, dimensions: Vec::new(), fields, cards: Vec::new() };
    Description { format, tables: vec![table] }
}

/// Whether a selection is one of points, which have neither dimensions nor HDUs.
pub(crate) fn check(selection: &Selection) -> Result<(), Error> {
    if let Some(hdu) = selection.hdu {
        return Err(Error::NoHdus { hdu });
    }
    let at = selection.at.first();
    at.map_or(Ok(()), |at| Err(Error::NoDimension { dimension: shown(&at.dimension) }))
}

/// The columns of values with their numbers, for people.
fn listed(columns: &[Column]) -> String {
    let values = columns.iter().filter(|c| c.values).enumerate();
    let listed: Vec<_> = values.map(|(i, c)| format!("{i} '{}'", shown(&c.name))).collect();
    if listed.is_empty() { "none".to_owned() } else { listed.join(", ") }
}

/// Text of a file as part of one sentence: on one line and not too long.
pub(crate) fn shown(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String = text.chars().take(LONGEST).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if shown.len() < text.len() && text.chars().count() > LONGEST {
        shown.push('…');
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> Vec<Column> {
        let column = |name: &str, unit: Option<&str>, values| Column {
            heading: unit.map_or(name.to_owned(), |unit| format!("{name} [{unit}]")),
            name: name.to_owned(),
            unit: unit.map(str::to_owned),
            values,
        };
        vec![
            column("x", None, false),
            column("Depth", Some("mm"), true),
            column("depth", None, true),
            column("2024", None, true),
            column("depth", None, true),
        ]
    }

    fn chosen(field: &str) -> Result<usize, Error> {
        choose(&columns(), Some(&field.parse().unwrap()))
    }

    #[test]
    fn names_and_numbers_choose_a_column() {
        assert_eq!(chosen("Depth").unwrap(), 1);
        assert_eq!(chosen("depth [MM]").unwrap(), 1);
        assert_eq!(chosen("X").unwrap(), 0);
        assert_eq!(chosen("0").unwrap(), 1);
        assert_eq!(chosen("2").unwrap(), 3);
        assert_eq!(chosen("2024").unwrap(), 3);
        assert!(matches!(chosen("depth"), Err(Error::SeveralColumns { .. })));
        let Err(Error::UnknownColumn { columns, .. }) = chosen("height") else { panic!() };
        assert_eq!(columns, "0 'Depth', 1 'depth', 2 '2024', 3 'depth'");
    }

    #[test]
    fn the_only_column_needs_no_name() {
        assert!(matches!(choose(&columns(), None), Err(Error::SeveralColumns { .. })));
        assert_eq!(choose(&columns()[..2], None).unwrap(), 1);
        assert!(matches!(choose(&columns()[..1], None), Err(Error::NoValueColumn { .. })));
    }

    #[test]
    fn text_is_shown_on_one_short_line() {
        assert_eq!(shown("a\nb"), "a\u{fffd}b");
        assert_eq!(shown(&"é".repeat(100)).chars().count(), 61);
    }
}
