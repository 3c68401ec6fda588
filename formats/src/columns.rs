//! Named columns of values at points, and the choice of the one that is to become a map.
//!
//! Columns of coordinates and colours are left to the adapters.

use crate::describe::{Description, FieldDescription, GridDescription, TableDescription, TablePlace};
use crate::error::{Ask, ErrorKind, Reason};
use crate::names::is_alike;
use crate::request::{self, Field, Selection};
use crate::text::shortened;

/// Problems with columns, and with the values in them.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Problem {
    #[error("there is no column {field}; the columns of values are {columns}")]
    UnknownColumn { field: String, columns: String },
    #[error("several columns could be the map: {columns}; choose one by its name or number")]
    SeveralColumns { columns: String },
    #[error("there is no column of numbers besides {coordinates}; name the column of values")]
    NoValueColumn { coordinates: String },
    #[error("the points have no dimension '{dimension}' to choose from; leave the choice out, or pick the rows first")]
    NoDimension { dimension: String },
    #[error(transparent)]
    Request(#[from] request::Problem),
    #[error("{place} has '{text}' as '{column}', which is not {expected}; correct it")]
    BadNumber { place: String, column: String, text: String, expected: &'static str },
    #[error("column '{column}' has no value at any point; choose another")]
    NoValues { column: String },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::UnknownColumn { .. } => ErrorKind::Unknown,
            Problem::SeveralColumns { .. } => ErrorKind::Ambiguous,
            Problem::NoValueColumn { .. } => ErrorKind::NoMap,
            Problem::NoDimension { .. } => ErrorKind::NotApplicable,
            Problem::Request(problem) => problem.kind(),
            Problem::BadNumber { .. } => ErrorKind::Invalid,
            Problem::NoValues { .. } => ErrorKind::NoValues,
        }
    }

    fn ask(&self) -> Option<Ask> {
        match self {
            Problem::NoDimension { dimension } => Some(Ask::Place { dimension: Some(dimension.clone()), place: None }),
            Problem::Request(problem) => problem.ask(),
            Problem::BadNumber { .. } => None,
            _ => Some(Ask::Variable),
        }
    }

    fn found(&self) -> Option<String> {
        match self {
            Problem::BadNumber { place, text, .. } => Some(format!("'{text}' in {place}")),
            Problem::NoValues { .. } => Some("without values".to_owned()),
            _ => None,
        }
    }
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    /// The heading, as the file has it.
    pub(crate) heading: String,
    /// The name, which is the heading without a unit.
    pub(crate) name: String,
    /// The unit, where the heading has one.
    pub(crate) unit: Option<String>,
    /// Whether the column holds values that can be a map. Other columns are taken only if asked for by name.
    pub(crate) values: bool,
}

/// Number of the column that holds a field: the column of this name, or of this number among those of values. Unless a
/// field is given it is the only column of values.
pub(crate) fn choose(columns: &[Column], field: Option<&Field>) -> Result<usize, Problem> {
    let candidates: Vec<usize> = (0..columns.len()).filter(|&i| columns[i].values).collect();
    let several = || Problem::SeveralColumns { columns: listed(columns) };
    match field {
        None if candidates.len() > 1 => Err(several()),
        None => candidates.first().copied().ok_or_else(|| Problem::NoValueColumn {
            coordinates: columns.iter().map(|c| format!("'{}'", shortened(&c.heading))).collect::<Vec<_>>().join(", "),
        }),
        Some(field) => {
            let found = match field {
                Field::Name(name) => named(columns, name),
                Field::Number(number) => {
                    candidates.get(*number).map_or_else(|| named(columns, &number.to_string()), |&i| vec![i])
                }
            };
            match found[..] {
                [] => Err(Problem::UnknownColumn { field: field.to_string(), columns: listed(columns) }),
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

/// The description of a file with these columns.
pub(crate) fn describe(format: &'static str, grid: GridDescription, columns: &[Column]) -> Description {
    let field =
        |c: &Column| FieldDescription { name: c.name.clone(), unit: c.unit.clone(), long_name: None, quantity: None };
    let fields = columns.iter().filter(|c| c.values).map(field).collect();
    let table =
        TableDescription { place: TablePlace::File {}, grid, dimensions: Vec::new(), fields, cards: Vec::new() };
    Description { format, tables: vec![table] }
}

/// Whether a selection is one of points, which have neither dimensions nor HDUs.
pub(crate) fn check(selection: &Selection) -> Result<(), Problem> {
    selection.without_hdu()?;
    let at = selection.at.first();
    at.map_or(Ok(()), |at| Err(Problem::NoDimension { dimension: shortened(&at.dimension) }))
}

/// The columns of values with their numbers, for people.
fn listed(columns: &[Column]) -> String {
    let values = columns.iter().filter(|c| c.values).enumerate();
    let listed: Vec<_> = values.map(|(i, c)| format!("{i} '{}'", shortened(&c.name))).collect();
    if listed.is_empty() { "none".to_owned() } else { listed.join(", ") }
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

    fn chosen(field: &str) -> Result<usize, Problem> {
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
        assert!(matches!(chosen("depth"), Err(Problem::SeveralColumns { .. })));
        let Err(Problem::UnknownColumn { columns, .. }) = chosen("height") else { panic!() };
        assert_eq!(columns, "0 'Depth', 1 'depth', 2 '2024', 3 'depth'");
    }

    #[test]
    fn the_only_column_needs_no_name() {
        assert!(matches!(choose(&columns(), None), Err(Problem::SeveralColumns { .. })));
        assert_eq!(choose(&columns()[..2], None).unwrap(), 1);
        assert!(matches!(choose(&columns()[..1], None), Err(Problem::NoValueColumn { .. })));
    }
}
