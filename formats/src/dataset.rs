//! Files of named arrays with named dimensions and attributes, seen in one way whatever holds them: NetCDF, Zarr.
//!
//! What names and attributes mean (the CF conventions) is left to [`crate::cf`], what a grid is to the adapters.

use std::ops::Range;

use crate::Error;

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
    /// Its name within its group.
    pub(crate) name: String,
    /// The group that it is in: "/" or such as "/Grid".
    pub(crate) group: String,
    /// What it holds.
    pub(crate) kind: Kind,
    /// Its dimensions, slowest first.
    pub(crate) dimensions: Vec<Dimension>,
    /// Its attributes, in the file's order.
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
