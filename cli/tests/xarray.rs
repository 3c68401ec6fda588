//! NetCDF files for xarray, by the interpreter that `LONGAN_PYTHON` names, else `python3`.

use std::process::Command;

use super::cli::{Folder, Layout};

#[test]
fn xarray_opens_cubes() {
    let Some(python) = longan_support::python_with("xarray") else { return };
    let folder = Folder::new();
    let layout = Layout { steps: 3, ..Layout::of(10.0) };
    layout.write(&folder.path("series.nc"), |step, latitude, longitude| {
        let longitude = (longitude + 5.0 * step as f64).to_radians();
        if latitude < -60.0 { f64::NAN } else { latitude.to_radians().cos() * longitude.sin() + 280.0 }
    });
    folder.done("map series.nc -o map.nc --measure evq,w1 --window 20,30 --nside-out 8");
    folder.done("map series.nc -o tables.fits --measure evq,w1 --window 20,30 --nside-out 8");
    folder.done("regrid series.nc -o regridded.nc --nside 8");
    // The values, in the order of steps and pixels.
    let script = r#"
import numpy as np, xarray as xr
with xr.open_dataset("map.nc") as data:
    assert set(data.data_vars) - {"healpix"} == {
        "EVQ_WINDOW_20", "W1_WINDOW_20", "EVQ_WINDOW_30", "W1_WINDOW_30", "input_mean", "input_sigma"}, data
    assert data.EVQ_WINDOW_20.dims == ("time", "cell") and data.EVQ_WINDOW_20.shape == (3, 768)
    assert (data.time.dt.strftime("%Y-%m-%d") == ["1997-12-01", "1997-12-02", "1997-12-03"]).all()
    assert data.W1_WINDOW_30.attrs["units"] == "rad" and "windows of 30 degrees" in data.W1_WINDOW_30.attrs["long_name"]
    assert data.attrs["Conventions"] == "CF-1.13" and data.attrs["window"] == "20, 30"
    mapping = data[data.EVQ_WINDOW_20.attrs.get("grid_mapping", data.EVQ_WINDOW_20.encoding.get("grid_mapping"))]
    assert mapping.attrs["grid_mapping_name"] == "healpix" and mapping.attrs["refinement_level"] == 3
    assert (data.cell == np.arange(768)).all() and data.cell.attrs["standard_name"] == "healpix_index"
    assert data.EVQ_WINDOW_20.isnull().any() and data.EVQ_WINDOW_20.notnull().any()
    np.save("evq.npy", data.EVQ_WINDOW_20.values)
with xr.open_dataset("regridded.nc") as data:
    assert data.t.attrs["units"] == "K" and data.t.attrs["long_name"] == "Temperature"
    assert abs(float(data.t.mean()) - 280) < 1, data.t.mean()
"#;
    let output = Command::new(&python).args(["-c", script]).current_dir(folder.path("")).output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !err.contains("Warning"), "{err}");
    // NumPy's format: a header whose length stands in its ninth and tenth byte, then doubles.
    let bytes = std::fs::read(folder.path("evq.npy")).unwrap();
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let values: Vec<f64> = bytes[start..].chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    for (step, values) in values.chunks(768).enumerate() {
        // The windows of a step follow each other.
        let table = folder.read_hdu("tables.fits", "EVQ", Some(2 * step + 1));
        assert_eq!(longan_support::difference(values, table.values()), 0.0);
    }
}
