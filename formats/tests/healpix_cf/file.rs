//! Files told once and written in each format.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Map, Value, json};
use zarrs::array::{Array, ArrayMetadata};
use zarrs::filesystem::FilesystemStore;

/// What a file holds.
#[derive(Clone, Default)]
pub(crate) struct File {
    pub(crate) variables: Vec<Variable>,
    /// Attributes of the root.
    pub(crate) attributes: Map<String, Value>,
}

/// One variable.
#[derive(Clone)]
pub(crate) struct Variable {
    pub(crate) name: String,
    /// Names and lengths of the dimensions.
    pub(crate) dimensions: Vec<(String, usize)>,
    pub(crate) values: Values,
    pub(crate) attributes: Map<String, Value>,
}

/// The values of a variable.
#[derive(Clone)]
pub(crate) enum Values {
    F64(Vec<f64>),
    F32(Vec<f32>),
    I64(Vec<i64>),
    I32(Vec<i32>),
    I16(Vec<i16>),
}

/// Formats to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Netcdf3,
    Netcdf4,
    Zarr2,
    Zarr3,
}

pub(crate) const FORMATS: [Format; 4] = [Format::Netcdf3, Format::Netcdf4, Format::Zarr2, Format::Zarr3];

pub(crate) fn variable(name: &str, dimensions: &[(&str, usize)], values: Values, attributes: Value) -> Variable {
    let dimensions = dimensions.iter().map(|&(name, len)| (name.to_owned(), len)).collect();
    let Value::Object(attributes) = attributes else { panic!("no object") };
    Variable { name: name.to_owned(), dimensions, values, attributes }
}

impl File {
    pub(crate) fn of(variables: impl Into<Vec<Variable>>) -> Self {
        File { variables: variables.into(), attributes: Map::new() }
    }

    /// Writes the file into a folder and gives its path.
    pub(crate) fn write(&self, folder: &Path, format: Format) -> PathBuf {
        let path = folder.join(match format {
            Format::Netcdf3 => "three.nc",
            Format::Netcdf4 => "four.nc",
            Format::Zarr2 => "two.zarr",
            Format::Zarr3 => "three.zarr",
        });
        match format {
            Format::Netcdf3 => self.netcdf(netcdf::create_with(&path, netcdf::Options::default()).unwrap()),
            Format::Netcdf4 => self.netcdf(netcdf::create(&path).unwrap()),
            Format::Zarr2 | Format::Zarr3 => self.zarr(&path, format, &Storage::plain(format)),
        }
        path
    }

    fn netcdf(&self, mut file: netcdf::FileMut) {
        // NetCDF 3 has a mode for definitions, which ends when values are written.
        for (name, value) in &self.attributes {
            file.add_attribute(name, attribute(value)).unwrap();
        }
        for v in &self.variables {
            for (name, len) in &v.dimensions {
                if file.dimension(name).is_none() {
                    file.add_dimension(name, *len).unwrap();
                }
            }
            let dimensions: Vec<_> = v.dimensions.iter().map(|(name, _)| name.as_str()).collect();
            let mut variable = match &v.values {
                Values::F64(_) => file.add_variable::<f64>(&v.name, &dimensions),
                Values::F32(_) => file.add_variable::<f32>(&v.name, &dimensions),
                Values::I64(_) => file.add_variable::<i64>(&v.name, &dimensions),
                Values::I32(_) => file.add_variable::<i32>(&v.name, &dimensions),
                Values::I16(_) => file.add_variable::<i16>(&v.name, &dimensions),
            }
            .unwrap();
            for (name, value) in &v.attributes {
                match (name.as_str(), &v.values) {
                    // It has the type of the variable.
                    ("_FillValue", Values::I16(_)) => {
                        variable.put_attribute(name, value.as_i64().unwrap() as i16).unwrap()
                    }
                    ("_FillValue", Values::F32(_)) => {
                        variable.put_attribute(name, value.as_f64().unwrap() as f32).unwrap()
                    }
                    _ => variable.put_attribute(name, attribute(value)).unwrap(),
                };
            }
        }
        let _ = file.enddef();
        for v in &self.variables {
            let mut variable = file.variable_mut(&v.name).unwrap();
            match &v.values {
                Values::F64(values) => variable.put_values(values, ..),
                Values::F32(values) => variable.put_values(values, ..),
                Values::I64(values) => variable.put_values(values, ..),
                Values::I32(values) => variable.put_values(values, ..),
                Values::I16(values) => variable.put_values(values, ..),
            }
            .unwrap();
        }
        file.close().unwrap();
    }

    /// Writes a Zarr store.
    pub(crate) fn zarr(&self, path: &Path, format: Format, storage: &Storage) {
        std::fs::create_dir_all(path).unwrap();
        let put = |file: &str, value: Value| std::fs::write(path.join(file), value.to_string()).unwrap();
        if format == Format::Zarr2 {
            put(".zgroup", json!({ "zarr_format": 2 }));
            put(".zattrs", Value::Object(self.attributes.clone()));
        } else {
            put("zarr.json", json!({ "zarr_format": 3, "node_type": "group", "attributes": self.attributes }));
        }
        let store = Arc::new(FilesystemStore::new(path).unwrap());
        for v in &self.variables {
            let metadata: ArrayMetadata = serde_json::from_value(v.zarr(format, storage)).unwrap();
            let array = Array::new_with_metadata(store.clone(), &format!("/{}", v.name), metadata).unwrap();
            array.store_metadata().unwrap();
            let all = array.subset_all();
            match &v.values {
                Values::F64(values) => array.store_array_subset(&all, values),
                Values::F32(values) => array.store_array_subset(&all, values),
                Values::I64(values) => array.store_array_subset(&all, values),
                Values::I32(values) => array.store_array_subset(&all, values),
                Values::I16(values) => array.store_array_subset(&all, values),
            }
            .unwrap();
        }
    }
}

/// How arrays of a Zarr store are stored.
#[derive(Clone)]
pub(crate) struct Storage {
    /// The longest chunk along any dimension.
    pub(crate) chunk: usize,
    /// The longest chunk along time.
    pub(crate) steps: usize,
    /// Version 2: the compressor; version 3: all codecs.
    pub(crate) codecs: Value,
    /// Version 2: filters.
    pub(crate) filters: Value,
    /// Version 2: the order of dimensions in a chunk.
    pub(crate) order: &'static str,
    /// Version 2: whether numbers begin with their highest byte.
    pub(crate) big_endian: bool,
}

impl Storage {
    /// Without compression.
    pub(crate) fn plain(format: Format) -> Self {
        let bytes = json!([{ "name": "bytes", "configuration": { "endian": "little" } }]);
        let codecs = if format == Format::Zarr3 { bytes } else { Value::Null };
        Storage { chunk: 20, steps: 20, codecs, filters: Value::Null, order: "C", big_endian: false }
    }
}

impl Variable {
    /// The metadata of the array.
    fn zarr(&self, format: Format, storage: &Storage) -> Value {
        let (two, three) = match self.values {
            Values::F64(_) => ("f8", "float64"),
            Values::F32(_) => ("f4", "float32"),
            Values::I64(_) => ("i8", "int64"),
            Values::I32(_) => ("i4", "int32"),
            Values::I16(_) => ("i2", "int16"),
        };
        let shape: Vec<_> = self.dimensions.iter().map(|(_, len)| *len).collect();
        let longest = |name: &str| if name == "time" { storage.steps } else { storage.chunk };
        let chunks: Vec<_> = self.dimensions.iter().map(|(name, len)| longest(name).min(*len)).collect();
        let names: Vec<_> = self.dimensions.iter().map(|(name, _)| name.clone()).collect();
        let mut attributes = self.attributes.clone();
        // As xarray writes them.
        let real = matches!(self.values, Values::F64(_) | Values::F32(_));
        if format == Format::Zarr2 {
            let fill = attributes.remove("_FillValue").unwrap_or(if real { json!("NaN") } else { Value::Null });
            // What is read copes with it, but zarrs cannot write it.
            let order = if shape.is_empty() { "C" } else { storage.order };
            attributes.insert("_ARRAY_DIMENSIONS".to_owned(), json!(names));
            json!({
                "zarr_format": 2, "shape": shape, "chunks": chunks, "fill_value": fill, "order": order,
                "dtype": format!("{}{two}", if storage.big_endian { '>' } else { '<' }),
                "compressor": storage.codecs, "filters": storage.filters, "attributes": attributes,
            })
        } else {
            json!({
                "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": three,
                "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": chunks } },
                "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
                "fill_value": if real { json!("NaN") } else { json!(0) }, "codecs": storage.codecs,
                "attributes": attributes, "dimension_names": names,
            })
        }
    }
}

/// A value of JSON as an attribute of NetCDF.
fn attribute(value: &Value) -> netcdf::AttributeValue {
    match value {
        Value::String(text) => text.as_str().into(),
        Value::Bool(truth) => i8::from(*truth).into(),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => (whole as i32).into(),
            None => number.as_f64().unwrap().into(),
        },
        other => other.to_string().into(),
    }
}
