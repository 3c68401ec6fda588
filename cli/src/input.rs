//! The map of a file that is analysed: the options that choose and regrid it, and its mask.
//!
//! The content of files, and the way to HEALPix, is left to [`longan_formats`].

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use longan::ThresholdUnit;
use longan_formats::{
    self as formats, About, Ask, At, Error, Field, MapSeries, MemoryEstimate, Place, Selection, Target,
};
use longan_grid::{CoordinateSystem, Gather, Healpix, Map, Method, Regrid};

use super::mismatch::{Together, of_coordinates};
use super::options::{Running, Topic, between, finite, nside, shown, whole};
use super::remedies::of_mask;

/// Which map of a file, how it comes to HEALPix, and which pixels of it.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Input")]
pub(crate) struct Input {
    /// Variable or column: its name, whatever its case and with - or _, or its number counted from 0 as healpy does [default: the first of a FITS table; of
    /// other files the only one].
    #[arg(long = "variable", visible_aliases = ["field", "column"], value_name = "NAME|NUMBER", value_parser = field)]
    pub(crate) field: Option<Field>,
    /// Place along a dimension, by the value of its coordinate or by its number from 0, such as level=500,
    /// time=1997-12 or time=#0; may be repeated. Without a place in time there is a map for each step.
    #[arg(long, value_name = "DIM=VALUE|DIM=#N", value_parser = place)]
    pub(crate) select: Vec<At>,
    /// Number of the FITS extension, 0 for the primary one [default: the first with a map].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole::<usize>)]
    pub(crate) hdu: Option<usize>,
    /// Nside to bring fields on other grids, points, surfaces and multi-order (UNIQ) maps to [default: that closest to
    /// their spacing; that of the finest cells].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = nside)]
    nside: Option<usize>,
    #[command(flatten)]
    regrid: RegridOptions,
    /// Mask, of any format, ordering and Nside: a coarser one counts for all pixels within its own, of a finer one the
    /// mean counts, in which a missing value is 0. Pixels below the mask threshold are left out.
    #[arg(long, short, value_name = "FILE", help_heading = "Mask")]
    pub(crate) mask: Option<PathBuf>,
    /// Variable or column of the mask file [default: as for --variable].
    #[arg(long, visible_alias = "mask-variable", value_name = "NAME|NUMBER", requires = "mask", value_parser = field)]
    #[arg(help_heading = "Mask")]
    pub(crate) mask_field: Option<Field>,
    /// Place along a dimension of the mask file, as for --select.
    #[arg(long, value_name = "DIM=VALUE|DIM=#N", requires = "mask", value_parser = place, help_heading = "Mask")]
    mask_select: Vec<At>,
    /// Pixels whose mask value is below this are masked.
    #[arg(long, value_name = "X", default_value_t = 0.9, allow_negative_numbers = true, value_parser = finite)]
    #[arg(help_heading = "Mask")]
    pub(crate) mask_threshold: f64,
    /// Take files that name different coordinate systems (COORDSYS) together all the same, as if they were in one.
    #[arg(long)]
    pub(crate) ignore_coordsys: bool,
}

/// How what is not HEALPix comes to be.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Other grids, points and surfaces")]
struct RegridOptions {
    /// Latitude-longitude grids: the mean over each pixel (exact overlaps, which keep integrals), between the four grid
    /// points about its centre (nothing beyond the outermost ones of a region), or the grid point nearest to it
    /// [default: conservative; bilinear where the grid's spacing is more than 1.41 times the side of a pixel, as
    /// conservative draws the outlines of cells there].
    #[arg(long, value_name = "METHOD")]
    method: Option<MethodOption>,
    /// Latitude-longitude grids: pixels with a smaller share of valid values than this, from 0 to 1, are masked.
    #[arg(long, value_name = "SHARE", default_value_t = 0.5)]
    #[arg(allow_negative_numbers = true, value_parser = |t: &str| between(t, 0.0, 1.0))]
    min_valid: f64,
    /// Points: the mean of those in a pixel, all weighted by a Gaussian of this full width at half maximum in degrees,
    /// such as gaussian:5, or the nearest [default: mean; where the typical distance between points is more than 1.41
    /// times the side of a pixel, a Gaussian of twice that distance, as most pixels hold no point there].
    #[arg(long, value_name = "mean|gaussian:FWHM|nearest", value_parser = gather)]
    gather: Option<Gather>,
    /// Points: pixels farther than this from any are masked, in degrees [default: twice the typical distance between
    /// points].
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = |t: &str| between(t, 0.0, 180.0))]
    reach: Option<f64>,
    /// Surfaces, and points given as x,y,z: where they are seen from, in the file's unit [default: surfaces from the
    /// mean of their vertices, points from the mean of the points].
    #[arg(long, value_name = "x,y,z", allow_hyphen_values = true, value_parser = centre)]
    centre: Option<[f64; 3]>,
    /// Surfaces: take the outermost layer where the sight from the centre meets several.
    #[arg(long)]
    allow_folds: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum MethodOption {
    Conservative,
    Bilinear,
    Nearest,
}

impl Input {
    /// The selection of each file.
    fn selection(&self) -> Selection {
        let RegridOptions { method, min_valid, gather, reach, centre, allow_folds } = self.regrid;
        let method = method.map(|method| match method {
            MethodOption::Conservative => Method::Conservative,
            MethodOption::Bilinear => Method::Bilinear,
            MethodOption::Nearest => Method::Nearest,
        });
        Selection {
            field: self.field.clone(),
            hdu: self.hdu,
            nside: self.nside,
            at: self.select.clone(),
            regrid: Regrid { method, min_valid, gather, reach, centre, allow_folds },
        }
    }

    /// The mask, if there is one, once it is clear that it can be read.
    pub(crate) fn mask(&self, running: &Running) -> anyhow::Result<Option<Mask>> {
        // The cells of a mask are what they are, however fine the pixels.
        let regrid = Regrid { method: Some(Method::Conservative), gather: Some(Gather::Mean), ..Regrid::default() };
        let selection =
            Selection { field: self.mask_field.clone(), at: self.mask_select.clone(), regrid, ..Selection::default() };
        let mask = |path: &PathBuf| {
            let maps = formats::open(path, &selection).map_err(of_mask)?;
            let (system, mut settings) = (maps.about().coordinates, maps.place());
            settings.push(format!("threshold={}", self.mask_threshold));
            Ok(Mask {
                settings,
                path: path.clone(),
                selection,
                threshold: self.mask_threshold,
                system: system.filter(|_| !self.ignore_coordsys),
                running: running.clone(),
                map: Mutex::default(),
            })
        };
        self.mask.as_ref().map(mask).transpose()
    }

    /// Refuses maps whose units differ where thresholds are in the map's unit. Files that cannot be read are passed over:
    /// the run complains of each later.
    pub(crate) fn check_units(&self, paths: &[PathBuf], unit: ThresholdUnit) -> anyhow::Result<()> {
        if unit == ThresholdUnit::Sigma || paths.len() < 2 {
            return Ok(());
        }
        let mut together = Together::new(false, true);
        let opened = paths.iter().filter_map(|path| Some((path, self.open(path).ok()?)));
        opened.into_iter().try_for_each(|(path, series)| together.add(path, &series.about()))
    }

    /// The maps of a file.
    pub(crate) fn open(&self, path: &Path) -> Result<Series, Error> {
        let maps = formats::open(path, &self.selection())?;
        Ok(Series { path: path.to_owned(), maps })
    }
}

/// The maps of a file, one or one for each step in time.
pub(crate) struct Series {
    path: PathBuf,
    maps: Box<dyn MapSeries>,
}

impl Series {
    /// The number of maps.
    pub(crate) fn steps(&self) -> usize {
        self.maps.times().len().max(1)
    }

    /// Name, unit and sphere of the maps.
    pub(crate) fn about(&self) -> About {
        self.maps.about()
    }

    /// The memory that one map takes, where that is known before one is read.
    pub(crate) fn memory(&self) -> Option<MemoryEstimate> {
        self.maps.memory()
    }

    /// The place of the maps in their file.
    pub(crate) fn place(&self) -> Vec<String> {
        self.maps.place()
    }

    /// The grid that maps are brought to, and how.
    pub(crate) fn target(&mut self) -> Result<Target, Error> {
        self.maps.target().map_err(|e| e.with_path(&self.path))
    }

    /// Reads the map of a step and masks it.
    pub(crate) fn read(&mut self, step: usize, mask: Option<&Mask>) -> anyhow::Result<Map> {
        if let Some(mask) = mask {
            mask.check(&self.path, &self.maps.about())?;
        }
        let mut map = self.maps.read(step).map_err(|e| e.with_path(&self.path))?;
        if let Some(mask) = mask {
            mask.apply(&self.path, &mut map)?;
        }
        Ok(map)
    }
}

/// A mask, which several threads may share.
pub(crate) struct Mask {
    path: PathBuf,
    selection: Selection,
    threshold: f64,
    /// The place in the file and the threshold, in words.
    pub(crate) settings: Vec<String>,
    /// The coordinate system that the mask names, if that matters.
    system: Option<CoordinateSystem>,
    running: Running,
    /// The mask on the grid of the last map.
    map: Mutex<Option<Arc<Map>>>,
}

impl Mask {
    /// Refuses a map of a file in other coordinates.
    pub(crate) fn check(&self, path: &Path, about: &About) -> anyhow::Result<()> {
        let mask = format!("the mask {}", shown(&self.path));
        match of_coordinates(("the map", about.coordinates), (&mask, self.system)) {
            Some(mismatch) => bail!("{}: {mismatch}", shown(path)),
            None => Ok(()),
        }
    }

    /// Masks a map of a file.
    fn apply(&self, path: &Path, map: &mut Map) -> anyhow::Result<()> {
        let mask = self.on(map.grid()).map_err(|e| of_mask(e.with_path(path)))?;
        map.apply_mask(&mask, self.threshold).with_context(|| shown(path))
    }

    /// The mask on a grid, read unless that of the last map was the same. Other threads wait for the mask rather than
    /// read it too.
    fn on(&self, grid: Healpix) -> Result<Arc<Map>, Error> {
        let mut last = self.map.lock().unwrap_or_else(PoisonError::into_inner);
        let mask = match last.take().filter(|mask| mask.grid() == grid) {
            Some(mask) => mask,
            None => Arc::new(self.brought_to(grid)?),
        };
        *last = Some(mask.clone());
        Ok(mask)
    }

    /// The mask on a grid, read anew, with a warning where it is not the mask's own.
    fn brought_to(&self, grid: Healpix) -> Result<Map, Error> {
        let mask = self.read(grid.nside())?;
        let (own, nside) = (mask.grid().nside(), grid.nside());
        if own == nside {
            return Ok(mask);
        }
        let how = match own < nside {
            true => "each pixel of the map takes the mask's value at its centre",
            false => "each pixel of the map takes the mean of the mask's pixels in it",
        };
        self.running.warn_once(
            Topic::MaskNside,
            format_args!("{}: the mask has Nside {own} and the map Nside {nside}, so {how}", shown(&self.path)),
        );
        Ok(mask.as_mask_on(grid)?)
    }

    /// The mask at an Nside; at its own where it cannot be brought there.
    fn read(&self, nside: usize) -> Result<Map, Error> {
        let selection = Selection { nside: Some(nside), ..self.selection.clone() };
        match formats::read(&self.path, &selection) {
            // It has an Nside that it is not brought away from.
            Err(error) if error.ask() == Some(&Ask::Nside) => formats::read(&self.path, &self.selection),
            read => read,
        }
    }
}

/// A field.
pub(crate) fn field(text: &str) -> Result<Field, std::convert::Infallible> {
    text.parse()
}

/// A place along a dimension.
pub(crate) fn place(text: &str) -> Result<At, String> {
    let form = "not of the form DIM=VALUE or DIM=#NUMBER, such as level=500 or time=#0";
    let (dimension, place) = text.split_once('=').ok_or(form)?;
    let (dimension, place) = (dimension.trim().to_owned(), place.trim());
    if dimension.is_empty() || place.is_empty() {
        return Err(form.to_owned());
    }
    let place = match place.strip_prefix('#') {
        Some(index) => Place::Index(whole(index).map_err(|e| format!("'{index}' is {e}"))?),
        None => Place::Value(place.to_owned()),
    };
    Ok(At { dimension, place })
}

fn gather(text: &str) -> Result<Gather, String> {
    match text.split_once(':') {
        None if text == "mean" => Ok(Gather::Mean),
        None if text == "nearest" => Ok(Gather::Nearest),
        Some(("gaussian", width)) => {
            let fwhm = between(width, 0.0, 180.0).ok().filter(|fwhm| *fwhm > 0.0);
            Ok(Gather::Gaussian { fwhm: fwhm.ok_or_else(|| format!("'{width}' is not above 0 and at most 180"))? })
        }
        _ => Err("not mean, nearest or gaussian:FWHM, such as gaussian:5".to_owned()),
    }
}

fn centre(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text.split(',').map(|x| finite(x.trim())).collect::<Result<_, _>>()?;
    numbers.try_into().map_err(|_| "not three numbers, such as 0,0,0".to_owned())
}
