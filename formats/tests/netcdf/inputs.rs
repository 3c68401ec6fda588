//! NetCDF files to read, made with libnetcdf from a list of what is in them.

use std::path::{Path, PathBuf};

use netcdf::{AttributeValue, Options};

/// The variants of the format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Format {
    Classic,
    Offset64,
    Data64,
    Netcdf4,
    Netcdf4Classic,
}

impl Format {
    fn options(self) -> Options {
        match self {
            Format::Classic => Options::empty(),
            Format::Offset64 => Options::_64BIT_OFFSET,
            Format::Data64 => Options::_64BIT_DATA,
            Format::Netcdf4 => Options::NETCDF4,
            Format::Netcdf4Classic => Options::NETCDF4 | Options::CLASSIC,
        }
    }
}

/// What a variable holds.
#[derive(Clone)]
pub(crate) enum Data {
    F64(Vec<f64>),
    F32(Vec<f32>),
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U64(Vec<u64>),
    Text(Vec<&'static str>),
}

/// A variable, by its path.
#[derive(Clone)]
pub(crate) struct Var {
    pub(crate) path: String,
    pub(crate) dimensions: Vec<&'static str>,
    pub(crate) data: Data,
    pub(crate) attributes: Vec<(&'static str, AttributeValue)>,
}

/// A file.
#[derive(Clone)]
pub(crate) struct Nc {
    pub(crate) format: Format,
    /// By their paths; one of length 0 is unlimited.
    pub(crate) dimensions: Vec<(String, usize)>,
    pub(crate) variables: Vec<Var>,
}

pub(crate) fn var(
    path: &str,
    dimensions: &[&'static str],
    data: Data,
    attributes: &[(&'static str, AttributeValue)],
) -> Var {
    Var { path: path.to_owned(), dimensions: dimensions.to_vec(), data, attributes: attributes.to_vec() }
}

pub(crate) fn text(value: &str) -> AttributeValue {
    value.into()
}

/// A file in a folder of its own.
pub(crate) struct Scratch {
    _folder: tempfile::TempDir,
    pub(crate) path: PathBuf,
}

impl Nc {
    pub(crate) fn new(dimensions: &[(&str, usize)], variables: Vec<Var>) -> Self {
        let dimensions = dimensions.iter().map(|(name, len)| ((*name).to_owned(), *len)).collect();
        Nc { format: Format::Netcdf4, dimensions, variables }
    }

    /// The variable at this path.
    pub(crate) fn var(&mut self, path: &str) -> &mut Var {
        self.variables.iter_mut().find(|v| v.path == path).unwrap()
    }

    pub(crate) fn write(&self, path: &Path) {
        let mut file = netcdf::create_with(path, self.format.options()).unwrap();
        let group = |path: &str| path.rsplit_once('/').map(|(group, _)| group.to_owned());
        let mut groups: Vec<_> = self.variables.iter().filter_map(|v| group(&v.path)).collect();
        groups.extend(self.dimensions.iter().filter_map(|(path, _)| group(path)));
        groups.sort();
        groups.dedup();
        for group in groups {
            file.add_group(&group).unwrap();
        }
        for (name, len) in &self.dimensions {
            file.add_dimension(name, *len).unwrap();
        }
        for Var { path, dimensions, data, attributes } in &self.variables {
            let mut variable = match data {
                Data::F64(_) => file.add_variable::<f64>(path, dimensions),
                Data::F32(_) => file.add_variable::<f32>(path, dimensions),
                Data::I8(_) => file.add_variable::<i8>(path, dimensions),
                Data::U8(_) => file.add_variable::<u8>(path, dimensions),
                Data::I16(_) => file.add_variable::<i16>(path, dimensions),
                Data::U64(_) => file.add_variable::<u64>(path, dimensions),
                Data::Text(_) => file.add_variable_with_type(path, dimensions, &netcdf::types::NcVariableType::String),
            }
            .unwrap();
            for (name, value) in attributes {
                variable.put_attribute(name, value.clone()).unwrap_or_else(|e| panic!("{path}:{name}: {e}"));
            }
        }
        if self.format != Format::Netcdf4 {
            file.enddef().unwrap();
        }
        for Var { path, data, dimensions, .. } in &self.variables {
            let mut variable = file.variable_mut(path).unwrap();
            let lens: Vec<usize> = dimensions.iter().map(|name| self.len(name, data)).collect();
            let extents = lens.iter().map(|&len| (0..len).into()).collect::<Vec<netcdf::Extent>>();
            match data {
                Data::F64(values) => variable.put_values(values, extents),
                Data::F32(values) => variable.put_values(values, extents),
                Data::I8(values) => variable.put_values(values, extents),
                Data::U8(values) => variable.put_values(values, extents),
                Data::I16(values) => variable.put_values(values, extents),
                Data::U64(values) => variable.put_values(values, extents),
                Data::Text(values) => {
                    let put = |(i, value): (usize, &&str)| variable.put_string(value, [i]);
                    values.iter().enumerate().try_for_each(put)
                }
            }
            .unwrap_or_else(|e| panic!("{path}: {e}"));
        }
        file.close().unwrap();
    }

    /// The length of a dimension; of an unlimited one what the data make it.
    fn len(&self, name: &str, data: &Data) -> usize {
        let is = |path: &str| path.rsplit('/').next() == Some(name);
        match self.dimensions.iter().find(|(path, _)| is(path)).unwrap().1 {
            0 => match data {
                Data::F64(values) => values.len(),
                _ => panic!("unlimited dimensions are for one-dimensional doubles"),
            },
            len => len,
        }
    }

    pub(crate) fn scratch(&self) -> Scratch {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("field.nc");
        self.write(&path);
        Scratch { _folder: folder, path }
    }
}

/// A file of these bytes.
pub(crate) fn scratch(bytes: &[u8]) -> Scratch {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("field.nc");
    std::fs::write(&path, bytes).unwrap();
    Scratch { _folder: folder, path }
}
