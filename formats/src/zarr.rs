//! Zarr stores, version 2 and 3, in folders.
//!
//! Arrays and groups are found here, from consolidated metadata where a store has them, else from its folders. Chunks
//! and codecs are left to `zarrs`, the meaning of names and attributes to [`crate::cf`], the maps to
//! [`crate::interpret`].

use std::cell::RefCell;
use std::fs;
use std::io;
use std::ops::Range;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Map, Value};
use zarrs::array::chunk_cache::{ChunkCache, ChunkCacheDecodedLruSizeLimit};
use zarrs::array::{ArrayMetadata, ArraySubset, CodecOptions, ElementOwned};
use zarrs::filesystem::FilesystemStore;

use crate::adapter::{Adapter, MapSeries};
use crate::dataset::{Array, Attribute, Dataset, Dimension, Kind, Variable};
use crate::describe::Description;
use crate::error::{self, Ask, Error, ErrorKind, Reason};
use crate::request::Selection;
use crate::text::{gibibytes, spaced};
use crate::{interpret, zarr_zstd};

/// A Zarr store, or an array of one, that cannot be read.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error("the metadata of {node} in this Zarr store is wrong ({problem}); fetch or write the store again")]
    Metadata { node: String, problem: String },
    #[error("cannot read the array '{array}': the Zarr library says \"{message}\"; check the store with zarr-python")]
    Refused { array: String, message: String },
    #[error(
        "the part of array '{array}' that is needed, or a chunk of it, has {gibibytes:.1} GiB, more memory than there is; select less of it, or rechunk the store"
    )]
    Memory { array: String, gibibytes: f64 },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::Metadata { .. } => ErrorKind::Corrupt,
            Problem::Refused { .. } => ErrorKind::Unreadable,
            Problem::Memory { .. } => ErrorKind::NoMemory,
        }
    }

    fn ask(&self) -> Option<Ask> {
        matches!(self, Problem::Memory { .. }).then_some(Ask::Place { dimension: None, place: None })
    }
}

/// Metadata of a node of version 3; of all nodes, where they are consolidated.
const V3_NODE: &str = "zarr.json";
/// Metadata of a group of version 2.
const V2_GROUP: &str = ".zgroup";
/// Metadata of an array of version 2.
const V2_ARRAY: &str = ".zarray";
/// Attributes of a node of version 2.
const V2_ATTRIBUTES: &str = ".zattrs";
/// Metadata of all nodes of version 2.
const V2_ALL: &str = ".zmetadata";

/// How deep groups are followed: deeper than any that people make, and links may go round in circles.
const DEPTH_MAX: usize = 16;

/// The most bytes of chunks that are kept for the next step: 1 GiB.
const KEPT_MAX: u64 = 1 << 30;

/// Whether a folder is a Zarr store.
pub(crate) fn is_zarr(folder: &Path) -> bool {
    [V3_NODE, V2_GROUP, V2_ARRAY, V2_ALL].iter().any(|name| folder.join(name).is_file())
}

/// The adapter for Zarr stores, whatever their grid.
pub(crate) struct ZarrStore;

impl Adapter for ZarrStore {
    fn name(&self) -> &'static str {
        "Zarr"
    }

    /// No file is one; see [`is_zarr`].
    fn recognises(&self, _: &[u8]) -> bool {
        false
    }

    fn describe(&self, path: &Path) -> Result<Description, Error> {
        let tables = interpret::describe(&Zarr::open(path)?)?;
        Ok(Description { format: self.name(), tables })
    }

    fn open(&self, path: &Path, selection: &Selection) -> Result<Box<dyn MapSeries>, Error> {
        interpret::open(Rc::new(Zarr::open(path)?), selection)
    }
}

/// A Zarr store in a folder.
pub(crate) struct Zarr {
    storage: Arc<FilesystemStore>,
    variables: Vec<Variable>,
    /// For each variable, what `zarrs` needs to know of it.
    arrays: Vec<Stored>,
    /// Paths and attributes of all groups.
    groups: Vec<(String, Vec<(String, Attribute)>)>,
    /// Chunks of the array at this place among the variables, which was the last to be read in parts of chunks.
    kept: RefCell<Option<(usize, Cache)>>,
}

/// Chunks that are decoded, the last ones that were needed.
type Cache = ChunkCacheDecodedLruSizeLimit;

/// The storage of an array.
struct Stored {
    /// The array's path in the store, "/" for a store that is one array.
    path: String,
    /// The array's metadata, without attributes.
    metadata: Value,
    /// The type of its elements, as version 3 calls it.
    element: &'static str,
}

/// An array or group as the store has it.
struct Node {
    /// "/" or such as "/a/b".
    path: String,
    /// The node's metadata; of version 2 without attributes.
    metadata: Value,
    attributes: Map<String, Value>,
    is_array: bool,
}

impl Zarr {
    /// Finds the arrays and groups of a store.
    pub(crate) fn open(folder: &Path) -> Result<Self, Error> {
        zarr_zstd::register();
        let storage = FilesystemStore::new(folder)
            .map_err(|e| Problem::Metadata { node: "the root".to_owned(), problem: spaced(e) })?;
        let mut zarr = Zarr {
            storage: Arc::new(storage),
            variables: vec![],
            arrays: vec![],
            groups: vec![],
            kept: RefCell::new(None),
        };
        let store = folder.file_stem().unwrap_or_default().to_string_lossy();
        for node in nodes(folder)? {
            if node.is_array {
                let (variable, stored) = array(node, &store)?;
                zarr.variables.push(variable);
                zarr.arrays.push(stored);
            } else {
                zarr.groups.push((node.path, attributes(node.attributes)));
            }
        }
        Ok(zarr)
    }
}

impl Dataset for Zarr {
    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn group_attributes(&self, group: &str) -> &[(String, Attribute)] {
        self.groups.iter().find(|(path, _)| path == group).map_or(&[], |(_, attributes)| attributes)
    }

    fn read(&self, variable: &Variable, ranges: &[Range<usize>]) -> Result<Array, Error> {
        let refused = |message: String| Problem::Refused { array: variable.path(), message };
        let place = self.variables.iter().position(|v| v.name == variable.name && v.group == variable.group);
        let stored = &self.arrays[place.ok_or_else(|| refused("there is no such array".to_owned()))?];
        let metadata: ArrayMetadata =
            serde_json::from_value(stored.metadata.clone()).map_err(|e| refused(spaced(e)))?;
        let array = zarrs::array::Array::new_with_metadata(self.storage.clone(), &stored.path, metadata)
            .map_err(|e| refused(spaced(e)))?;

        let chunk = array.chunk_shape(&vec![0; ranges.len()]).map_err(|e| refused(spaced(e)))?;
        let chunk: Vec<_> = chunk.iter().map(|len| len.get()).collect();
        let product = |lens: &mut dyn Iterator<Item = u64>| lens.fold(1u128, |n, len| n.saturating_mul(len.into()));
        let ranges: Vec<_> = ranges.iter().map(|range| range.start as u64..range.end as u64).collect();
        let part = product(&mut ranges.iter().map(|range| range.end - range.start));
        check_memory(variable, part.max(product(&mut chunk.iter().copied())))?;

        // Chunks of several steps are needed again for the next one.
        let again = ranges.iter().zip(&chunk).any(|(range, chunk)| range.end - range.start < *chunk);
        let touched = ranges
            .iter()
            .zip(&chunk)
            .map(|(range, chunk)| (range.end.div_ceil(*chunk) - range.start / chunk).saturating_mul(*chunk));
        let small = product(&mut touched.into_iter()).saturating_mul(8) <= KEPT_MAX.into();
        let sharded = stored.metadata["codecs"].to_string().contains("sharding");
        let mut kept = self.kept.borrow_mut();
        let cache = if again && small && !sharded {
            if kept.as_ref().is_none_or(|(of, _)| Some(*of) != place) {
                *kept = place.map(|place| (place, Cache::new(Arc::new(array.readable()), KEPT_MAX)));
            }
            kept.as_ref().map(|(_, cache)| cache)
        } else {
            None
        };
        let part = Part { array: &array, cache, subset: ArraySubset::new_with_ranges(&ranges), variable };
        Ok(match stored.element {
            "bool" => Array::Whole(part.values::<bool>()?.into_iter().map(i64::from).collect()),
            "int8" => part.whole::<i8>()?,
            "int16" => part.whole::<i16>()?,
            "int32" => part.whole::<i32>()?,
            "int64" => part.whole::<i64>()?,
            "uint8" => part.whole::<u8>()?,
            "uint16" => part.whole::<u16>()?,
            "uint32" => part.whole::<u32>()?,
            "uint64" => {
                let values = part.values::<u64>()?;
                // As real numbers where some are too large, such as fill values.
                match values.iter().map(|&value| i64::try_from(value)).collect() {
                    Ok(whole) => Array::Whole(whole),
                    Err(_) => Array::Real(values.into_iter().map(|value| value as f64).collect()),
                }
            }
            "float32" => Array::Real(part.values::<f32>()?.into_iter().map(f64::from).collect()),
            "float64" => Array::Real(part.values::<f64>()?),
            "string" => Array::Text(part.values::<String>()?),
            _ => return Err(refused("its elements are neither numbers nor text".to_owned()).into()),
        })
    }
}

/// A part of an array that is to be read.
struct Part<'a> {
    array: &'a zarrs::array::Array<FilesystemStore>,
    cache: Option<&'a Cache>,
    subset: ArraySubset,
    variable: &'a Variable,
}

impl Part<'_> {
    fn values<T: ElementOwned>(&self) -> Result<Vec<T>, Error> {
        if self.subset.is_empty() {
            return Ok(Vec::new());
        }
        let read = match self.cache {
            Some(cache) => cache.retrieve_array_subset(&self.subset, &CodecOptions::default()),
            None => self.array.retrieve_array_subset(&self.subset),
        };
        Ok(read.map_err(|e| Problem::Refused { array: self.variable.path(), message: spaced(e) })?)
    }

    fn whole<T: ElementOwned + Into<i64>>(&self) -> Result<Array, Error> {
        Ok(Array::Whole(self.values::<T>()?.into_iter().map(T::into).collect()))
    }
}

/// Whether there is memory for this many elements, for which `zarrs` does not ask.
fn check_memory(variable: &Variable, elements: u128) -> Result<(), Problem> {
    // No element is wider than 8 bytes.
    let bytes = elements.saturating_mul(8);
    let there_is = usize::try_from(bytes).is_ok_and(|bytes| Vec::<u8>::new().try_reserve_exact(bytes).is_ok());
    let too_large = || Problem::Memory { array: variable.path(), gibibytes: gibibytes(bytes as f64) };
    if there_is { Ok(()) } else { Err(too_large()) }
}

/// All nodes of a store, groups before what they hold.
fn nodes(folder: &Path) -> Result<Vec<Node>, Error> {
    if let Some(root) = json(folder, V3_NODE)? {
        let consolidated = root.pointer("/consolidated_metadata/metadata").and_then(Value::as_object).cloned();
        if let Some(consolidated) = consolidated {
            let mut nodes = vec![v3_node("/".to_owned(), root)?];
            for (path, metadata) in consolidated {
                nodes.push(v3_node(format!("/{path}"), metadata)?);
            }
            return Ok(nodes);
        }
    } else if let Some(Value::Object(mut all)) = json(folder, V2_ALL)? {
        let Some(Value::Object(mut all)) = all.remove("metadata") else {
            return Err(wrong(V2_ALL, "it has no object 'metadata'").into());
        };
        let keys: Vec<_> = all.keys().cloned().collect();
        let mut nodes = Vec::new();
        for key in keys {
            let (parent, name) = key.rsplit_once('/').unwrap_or(("", &key));
            if name == V2_GROUP || name == V2_ARRAY {
                let attributes = all.remove(&format!("{}{V2_ATTRIBUTES}", key.trim_end_matches(name)));
                let metadata = all.remove(&key).unwrap_or_default();
                nodes.push(v2_node(format!("/{parent}"), metadata, attributes, name == V2_ARRAY));
            }
        }
        return Ok(nodes);
    }
    let mut nodes = Vec::new();
    walk(folder, "/", &mut nodes)?;
    Ok(nodes)
}

/// Adds the node of a folder, if it is one, and all nodes below.
fn walk(folder: &Path, path: &str, nodes: &mut Vec<Node>) -> Result<(), Error> {
    let node = if let Some(metadata) = json(folder, V3_NODE)? {
        v3_node(path.to_owned(), metadata)?
    } else if let Some(metadata) = json(folder, V2_ARRAY)? {
        v2_node(path.to_owned(), metadata, json(folder, V2_ATTRIBUTES)?, true)
    } else if let Some(metadata) = json(folder, V2_GROUP)? {
        v2_node(path.to_owned(), metadata, json(folder, V2_ATTRIBUTES)?, false)
    } else {
        return Ok(());
    };
    let is_array = node.is_array;
    nodes.push(node);
    if is_array || path.matches('/').count() > DEPTH_MAX {
        return Ok(());
    }
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::io("list the store"))? {
        // A name that is no Unicode is none that Zarr has.
        let name = entry.map_err(Error::io("list the store"))?.file_name().into_string();
        names.extend(name.ok().filter(|name| folder.join(name).is_dir()));
    }
    names.sort();
    for name in names {
        walk(&folder.join(&name), &format!("{}/{name}", path.trim_end_matches('/')), nodes)?;
    }
    Ok(())
}

/// A metadata file, if there is one.
fn json(folder: &Path, name: &str) -> Result<Option<Value>, Error> {
    let bytes = match fs::read(folder.join(name)) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(cause) => return Err(error::Problem::Io { action: "read the store's metadata", cause }.into()),
    };
    let file = || folder.file_name().map(|folder| format!("{}/{name}", folder.to_string_lossy())).unwrap_or_default();
    let json = serde_json::from_slice(&bytes);
    Ok(Some(json.map_err(|e| wrong(&spaced(file()), &format!("it is no JSON: {e}")))?))
}

fn v3_node(path: String, mut metadata: Value) -> Result<Node, Problem> {
    let is_array = match metadata.get("node_type").and_then(Value::as_str) {
        Some("array") => true,
        Some("group") => false,
        _ => return Err(wrong(&spaced(&path), "node_type is neither \"array\" nor \"group\"")),
    };
    let attributes = metadata.get_mut("attributes").map(Value::take);
    Ok(Node { path, metadata, attributes: object(attributes), is_array })
}

fn v2_node(path: String, metadata: Value, attributes: Option<Value>, is_array: bool) -> Node {
    Node { path, metadata, attributes: object(attributes), is_array }
}

fn object(attributes: Option<Value>) -> Map<String, Value> {
    match attributes {
        Some(Value::Object(attributes)) => attributes,
        _ => Map::new(),
    }
}

/// An array as a variable, and its storage; an array that is the whole store has the store's name.
fn array(node: Node, store: &str) -> Result<(Variable, Stored), Problem> {
    let Node { path, mut metadata, attributes: mut given, .. } = node;
    let (group, name) = path.rsplit_once('/').unwrap_or_default();
    let name = if name.is_empty() { store } else { name };
    let wrong = |problem: &str| wrong(&format!("array '{}'", spaced(&path)), problem);
    // Such a path leads out of the store.
    if path != "/" && path[1..].split('/').any(|part| matches!(part, "" | "." | "..")) {
        return Err(wrong("its path is not one of names"));
    }
    let shape = metadata.get("shape").and_then(Value::as_array).ok_or_else(|| wrong("it has no shape"))?;
    let shape: Option<Vec<usize>> = shape.iter().map(|len| usize::try_from(len.as_u64()?).ok()).collect();
    let shape = shape.filter(|shape| shape.iter().try_fold(1usize, |n, &len| n.checked_mul(len)).is_some());
    let shape = shape.ok_or_else(|| wrong(&format!("its shape is {}", metadata["shape"])))?;

    let names = given.remove("_ARRAY_DIMENSIONS");
    let names = metadata.get("dimension_names").cloned().or(names).unwrap_or_default();
    let names = names.as_array().filter(|names| names.len() == shape.len());
    let dimension = |(i, &len): (usize, &usize)| {
        let name = names.and_then(|names| names[i].as_str()).map_or_else(|| format!("dim_{i}"), str::to_owned);
        Dimension { name, len }
    };
    let dimensions: Vec<_> = shape.iter().enumerate().map(dimension).collect();

    let (element, kind) = element(&metadata);
    let mut attributes = attributes(given);
    // In version 2, the value of what was never written is CF's; in version 3 CF's is an attribute of its own.
    let fill = attributes.iter_mut().find(|(name, _)| name == "_FillValue");
    let of_metadata = metadata.get("fill_value").filter(|_| metadata["zarr_format"] == 2);
    match (fill, of_metadata) {
        (Some((_, value)), _) => *value = fill_value(kind, value.clone()),
        (None, Some(fill)) if !fill.is_null() && !fill.is_boolean() => {
            attributes.push(("_FillValue".to_owned(), fill_value(kind, attribute(fill.clone()))));
        }
        _ => (),
    }
    if let Some(codecs) = metadata.get_mut("codecs") {
        name_levels(codecs);
    }
    if let Some(metadata) = metadata.as_object_mut() {
        metadata.remove("attributes");
        // With fewer than two dimensions both orders are the same, and `zarrs` takes "F" badly where there is none.
        if dimensions.len() < 2 && metadata.contains_key("order") {
            metadata.insert("order".to_owned(), "C".into());
        }
    }
    let group = if group.is_empty() { "/" } else { group };
    let variable = Variable { name: name.to_owned(), group: group.to_owned(), kind, dimensions, attributes };
    Ok((variable, Stored { path, metadata, element }))
}

/// Names the level of compression of codecs of numcodecs, which those who read do not need, but which `zarrs` does.
fn name_levels(codecs: &mut Value) {
    for codec in codecs.as_array_mut().into_iter().flatten() {
        let named = codec["name"].as_str().is_some_and(|name| name.starts_with("numcodecs."));
        if let Some(Value::Object(configuration)) = codec.get_mut("configuration") {
            if named && !configuration.contains_key("elementsize") {
                configuration.entry("level").or_insert(1.into());
            }
            if let Some(inner) = configuration.get_mut("codecs") {
                name_levels(inner);
            }
        }
    }
}

/// The type of an array's elements: its name in version 3 (empty for those that hold no field), and its kind.
fn element(metadata: &Value) -> (&'static str, Kind) {
    let given = metadata.get("data_type").or(metadata.get("dtype")).unwrap_or(&Value::Null);
    let given = given.get("name").unwrap_or(given).as_str().unwrap_or_default();
    let integer = |bits, signed| Kind::Integer { bits, signed };
    match given.trim_start_matches(['<', '>', '|', '=']) {
        "bool" | "b1" => ("bool", integer(8, false)),
        "int8" | "i1" => ("int8", integer(8, true)),
        "int16" | "i2" => ("int16", integer(16, true)),
        "int32" | "i4" => ("int32", integer(32, true)),
        "int64" | "i8" => ("int64", integer(64, true)),
        "uint8" | "u1" => ("uint8", integer(8, false)),
        "uint16" | "u2" => ("uint16", integer(16, false)),
        "uint32" | "u4" => ("uint32", integer(32, false)),
        "uint64" | "u8" => ("uint64", integer(64, false)),
        "float32" | "f4" => ("float32", Kind::Real32),
        "float64" | "f8" => ("float64", Kind::Real64),
        "string" | "O" => ("string", Kind::Text),
        _ => ("", Kind::Other),
    }
}

/// A fill value as a number: what JSON has no digits for is text, and xarray writes real ones in base 64.
fn fill_value(kind: Kind, given: Attribute) -> Attribute {
    let real = matches!(kind, Kind::Real32 | Kind::Real64);
    match &given {
        Attribute::Text(text) if real => {
            let bytes = || <[u8; 8]>::try_from(BASE64_STANDARD.decode(text).ok()?).ok();
            let number = match text.as_str() {
                "NaN" => Some(f64::NAN),
                "Infinity" => Some(f64::INFINITY),
                "-Infinity" => Some(f64::NEG_INFINITY),
                _ => bytes().map(f64::from_le_bytes),
            };
            number.map_or(given, |number| Attribute::Real(vec![number]))
        }
        Attribute::Whole(numbers) if real => Attribute::Real(numbers.iter().map(|&n| n as f64).collect()),
        _ => given,
    }
}

fn attributes(given: Map<String, Value>) -> Vec<(String, Attribute)> {
    given.into_iter().map(|(name, value)| (name, attribute(value))).collect()
}

/// A value of JSON as an attribute.
fn attribute(value: Value) -> Attribute {
    let one = std::slice::from_ref(&value);
    let many = value.as_array().filter(|many| !many.is_empty()).map_or(one, Vec::as_slice);
    if let Some(whole) = many.iter().map(Value::as_i64).collect() {
        return Attribute::Whole(whole);
    }
    if let Some(real) = many.iter().map(Value::as_f64).collect() {
        return Attribute::Real(real);
    }
    match value {
        Value::String(text) => Attribute::Text(text),
        value => Attribute::Json(value),
    }
}

fn wrong(node: &str, problem: &str) -> Problem {
    Problem::Metadata { node: node.to_owned(), problem: problem.to_owned() }
}
