//! Fields on grids of latitude and longitude, and HEALPix maps, in files of all layouts.

use std::fs;
use std::path::Path;

use netcdf::{AttributeValue, Options};

/// How a field is laid out in a NetCDF file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// Distance of latitudes and of longitudes in degrees.
    pub(crate) spacing: f64,
    /// Latitudes from the north.
    pub(crate) down: bool,
    /// The first longitude.
    pub(crate) from: f64,
    /// Longitudes slower than latitudes.
    pub(crate) turned: bool,
    /// In a group.
    pub(crate) grouped: bool,
    /// As 16-bit integers of this unit.
    pub(crate) packed: Option<f64>,
    /// NetCDF 3.
    pub(crate) classic: bool,
    /// Number of steps, a day apart; 0: no time.
    pub(crate) steps: usize,
    /// Steps in a chunk, compressed.
    pub(crate) chunk: Option<usize>,
}

impl Layout {
    pub(crate) fn of(spacing: f64) -> Self {
        let (packed, chunk) = (None, None);
        Layout {
            spacing,
            down: false,
            from: 0.0,
            turned: false,
            grouped: false,
            packed,
            classic: false,
            steps: 0,
            chunk,
        }
    }

    fn latitudes(&self) -> Vec<f64> {
        let rows = (180.0 / self.spacing).round() as usize;
        let mut latitudes: Vec<_> = (0..rows).map(|i| -90.0 + (i as f64 + 0.5) * self.spacing).collect();
        if self.down {
            latitudes.reverse();
        }
        latitudes
    }

    fn longitudes(&self) -> Vec<f64> {
        let columns = (360.0 / self.spacing).round() as usize;
        (0..columns).map(|i| self.from + (i as f64 + 0.5) * self.spacing).collect()
    }

    /// Writes a field, a function of step, latitude and longitude in degrees; NaN is missing.
    pub(crate) fn write(&self, path: &Path, field: impl Fn(usize, f64, f64) -> f64) {
        const MISSING: i16 = -32768;
        let (latitudes, longitudes) = (self.latitudes(), self.longitudes());
        let options = if self.classic { Options::_64BIT_OFFSET } else { Options::NETCDF4 };
        let mut file = netcdf::create_with(path, options).unwrap();
        let prefix = if self.grouped { "Grid/" } else { "" };
        if self.grouped {
            file.add_group("Grid").unwrap();
        }
        let times: Vec<f64> = (0..self.steps).map(|step| step as f64).collect();
        let mut axes = vec![("lat", "degrees_north", &latitudes), ("lon", "degrees_east", &longitudes)];
        if self.steps > 0 {
            axes.push(("time", "days since 1997-12-01", &times));
        }
        for (name, _, values) in &axes {
            file.add_dimension(&format!("{prefix}{name}"), values.len()).unwrap();
        }
        for (name, unit, _) in &axes {
            let mut axis = file.add_variable::<f64>(&format!("{prefix}{name}"), &[name]).unwrap();
            axis.put_attribute("units", *unit).unwrap();
        }
        let mut dimensions = if self.turned { vec!["lon", "lat"] } else { vec!["lat", "lon"] };
        if self.steps > 0 {
            dimensions.insert(0, "time");
        }
        let name = format!("{prefix}t");
        let mut variable = match self.packed {
            None => file.add_variable::<f64>(&name, &dimensions),
            Some(_) => file.add_variable::<i16>(&name, &dimensions),
        }
        .unwrap();
        let mut attributes: Vec<(&str, AttributeValue)> =
            vec![("units", "K".into()), ("long_name", "Temperature".into())];
        if let Some(unit) = self.packed {
            attributes.push(("scale_factor", (-unit).into()));
            attributes.push(("add_offset", 1.0.into()));
            attributes.push(("_FillValue", MISSING.into()));
        }
        for (name, value) in attributes {
            variable.put_attribute(name, value).unwrap();
        }
        if let Some(chunk) = self.chunk {
            variable.set_chunking(&[chunk, latitudes.len().div_ceil(2), longitudes.len()]).unwrap();
            variable.set_compression(1, true).unwrap();
        }
        if self.classic {
            file.enddef().unwrap();
        }
        for (name, _, values) in &axes {
            file.variable_mut(&format!("{prefix}{name}")).unwrap().put_values(values, ..).unwrap();
        }
        let mut values = Vec::new();
        for step in 0..self.steps.max(1) {
            let (slow, fast) = if self.turned { (&longitudes, &latitudes) } else { (&latitudes, &longitudes) };
            for &a in slow {
                let of = |&b: &f64| if self.turned { field(step, b, a) } else { field(step, a, b) };
                values.extend(fast.iter().map(of));
            }
        }
        let mut variable = file.variable_mut(&name).unwrap();
        match self.packed {
            None => variable.put_values(&values, ..).unwrap(),
            Some(unit) => {
                let pack = |v: &f64| if v.is_nan() { MISSING } else { ((v - 1.0) / -unit).round() as i16 };
                variable.put_values(&values.iter().map(pack).collect::<Vec<_>>(), ..).unwrap();
            }
        }
        file.close().unwrap();
        super::unlock(path);
    }
}

/// A Zarr store of arrays of doubles without compression: name, shape, values, attributes, names of dimensions.
pub(crate) type Array<'a> = (&'a str, &'a [usize], &'a [f64], serde_json::Value, &'a [&'a str]);

/// Writes a Zarr store of version 2 or 3, one chunk for each array.
pub(crate) fn zarr(path: &Path, version: u8, arrays: &[Array<'_>]) {
    let write = |name: &str, value: serde_json::Value| fs::write(path.join(name), value.to_string()).unwrap();
    fs::create_dir(path).unwrap();
    match version {
        2 => write(".zgroup", serde_json::json!({"zarr_format": 2})),
        _ => write("zarr.json", serde_json::json!({"zarr_format": 3, "node_type": "group", "attributes": {}})),
    }
    for (name, shape, values, attributes, dimensions) in arrays {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let origin = vec!["0"; shape.len()];
        let mut attributes = attributes.clone();
        if version == 2 {
            fs::create_dir(path.join(name)).unwrap();
            attributes["_ARRAY_DIMENSIONS"] = (*dimensions).into();
            write(
                &format!("{name}/.zarray"),
                serde_json::json!({
                    "zarr_format": 2, "shape": shape, "chunks": shape, "dtype": "<f8", "compressor": null,
                    "fill_value": null, "order": "C", "filters": null,
                }),
            );
            write(&format!("{name}/.zattrs"), attributes);
            fs::write(path.join(name).join(if origin.is_empty() { "0".to_owned() } else { origin.join(".") }), bytes)
                .unwrap();
        } else {
            let key = [&["c"], &origin[..]].concat().join("/");
            let chunk = path.join(name).join(key);
            fs::create_dir_all(chunk.parent().unwrap()).unwrap();
            write(
                &format!("{name}/zarr.json"),
                serde_json::json!({
                    "zarr_format": 3, "node_type": "array", "shape": shape, "data_type": "float64",
                    "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": shape}},
                    "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
                    "fill_value": "NaN", "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}],
                    "attributes": attributes, "dimension_names": dimensions,
                }),
            );
            fs::write(chunk, bytes).unwrap();
        }
    }
}
