//! Files of named arrays with named dimensions and attributes, seen in one way whatever holds them: NetCDF, Zarr.
//!
//! The meaning of names and attributes (the CF conventions) is left to [`crate::cf`], the grids to other files.

use std::ops::Range;

use crate::error::{Ask, Error, ErrorKind, Reason};
use crate::text::gibibytes;

/// A file of named arrays.
pub(crate) trait Dataset {
    /// All variables of all groups.
    fn variables(&self) -> &[Variable];

    /// Attributes of a group, such as "/" or "/Grid"; empty where it has none.
    fn group_attributes(&self, group: &str) -> &[(String, Attribute)];

    /// The part of a variable within these ranges of indices, one for each dimension (none for a scalar), in row-major
    /// order and as stored: nothing is unpacked or masked. Only what holds that part is read.
    ///
    /// # Errors
    /// Where the file cannot be read.
    fn read(&self, variable: &Variable, ranges: &[Range<usize>]) -> Result<Array, Error>;
}

/// A named array.
#[derive(Clone, Debug)]
pub(crate) struct Variable {
    /// The name within the group.
    pub(crate) name: String,
    /// The group of the variable: "/" or such as "/Grid".
    pub(crate) group: String,
    /// The kind of the values.
    pub(crate) kind: Kind,
    /// The dimensions, slowest first.
    pub(crate) dimensions: Vec<Dimension>,
    /// The attributes, in the file's order.
    pub(crate) attributes: Vec<(String, Attribute)>,
}

/// A named dimension.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Dimension {
    pub(crate) name: String,
    pub(crate) len: usize,
}

/// How the values of a variable are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Real32,
    Real64,
    Integer {
        bits: u32,
        signed: bool,
    },
    Text,
    /// Compound, opaque and other kinds that hold no field.
    Other,
}

/// The value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Attribute {
    Text(String),
    /// Real numbers, one or many.
    Real(Vec<f64>),
    /// Whole numbers, one or many.
    Whole(Vec<i64>),
    /// Anything else, such as nested JSON in Zarr, as JSON.
    Json(serde_json::Value),
}

/// Problems with the variables of a dataset, whatever it means.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Problem {
    #[error("'{variable}' needs {gibibytes:.1} GiB, more memory than there is; choose a part of it")]
    Memory { variable: String, gibibytes: f64 },
    #[error("variable '{variable}' holds {found}, which is not a field of numbers; choose another variable")]
    VariableKind { variable: String, found: &'static str },
    #[error(
        "variable '{variable}' has {attribute} = {found}, which is not {expected}; correct it, such as with ncatted"
    )]
    AttributeValue { variable: String, attribute: &'static str, found: String, expected: &'static str },
    #[error("there are several variables, so name one: {variables}")]
    SeveralVariables { variables: String },
}

impl Problem {
    /// Too little memory for a variable, or an attribute, of this many bytes.
    pub(crate) fn memory(variable: String, bytes: f64) -> Self {
        Problem::Memory { variable, gibibytes: gibibytes(bytes) }
    }
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::Memory { .. } => ErrorKind::NoMemory,
            Problem::VariableKind { .. } => ErrorKind::NotNumbers,
            Problem::AttributeValue { .. } => ErrorKind::Invalid,
            Problem::SeveralVariables { .. } => ErrorKind::Ambiguous,
        }
    }

    fn ask(&self) -> Option<Ask> {
        match self {
            Problem::Memory { .. } => Some(Ask::Place { dimension: None, place: None }),
            Problem::VariableKind { .. } | Problem::SeveralVariables { .. } => Some(Ask::Variable),
            Problem::AttributeValue { .. } => None,
        }
    }
}

/// Values of a variable.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Array {
    Real(Vec<f64>),
    Whole(Vec<i64>),
    Text(Vec<String>),
}

impl Variable {
    /// The attribute of this name.
    pub(crate) fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, a)| a)
    }

    /// The text of an attribute; nothing where it is absent or no text.
    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        match self.attribute(name)? {
            Attribute::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The path of the variable: its name, after its group's where that is not the root.
    pub(crate) fn path(&self) -> String {
        if self.group == "/" {
            self.name.clone()
        } else {
            format!("{}/{}", self.group.trim_start_matches('/'), self.name)
        }
    }
}
