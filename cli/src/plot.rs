//! `longan plot`: a picture of a map.
//!
//! The drawing itself is left to [`longan_picture`].

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, bail};
use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum};
use longan::measures::Quantity;
use longan::{Body, Thresholds, contour_lines};
use longan_formats::{self as formats, At, Field, Selection};
use longan_grid::{Map, Sphere};
use longan_picture::projection::{self, Equirectangular, Gnomonic, Hammer, Mollweide, Orthographic, Projection};
use longan_picture::{
    Circle, Colouring, Colours, Mark, Options, Orientation, Overlays, Rods, View, WIDTHS, draw, superscript,
};

use super::input::{Input, Mask, field, place};
use super::mismatch::of_coordinates;
use super::misused::misused;
use super::options::{Running, check_apart, finite, shown};
use super::picture_format::{Form, save};
use super::quantity::{meaning, of_column};
use super::regridding;
use super::remedies::of_contours;

/// A picture of a map: PNG, or SVG whose lines and letters stay sharp at any size.
///
/// The coordinate system decides which way east is, the values which colours they have: about zero where they lie on both
/// sides of it, around a circle for directions. All of it can be chosen.
#[derive(Args, Debug)]
#[command(mut_arg("centre", |arg| arg.long("seen-from")))]
#[command(after_help = "\
Examples:
  longan plot sky.fits -o sky.png --mask mask.fits --range -300,300
  longan plot evq.fits -o evq.svg --title 'Windows of 6 degrees' --circle 83.6,22,6
  longan plot evq.fits -o centre.png --projection gnomonic --centre 0,0 --size 30 --mark 0,0,'Galactic centre'
  longan plot out.fits -o directions.png --column EVQ --rods EVQ_DIRECTION
  longan plot evq.fits -o bodies.png --contour shapes.fits --contour-threshold 0.5
  longan plot era5.nc -o z.png --variable z --select level=500 --projection orthographic --centre 0,45
  longan plot rain.nc -o rain.png --log --colours cividis --centre 180,0

Angles are in degrees: longitude eastwards, latitude northwards.")]
pub(crate) struct Arguments {
    /// File of a map: FITS, NetCDF, Zarr, CSV, PLY.
    #[arg(value_name = "MAP")]
    input_file: PathBuf,
    /// File to write: .png or .svg.
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// How the sphere is laid out: mollweide and hammer keep areas, orthographic shows both halves as seen from afar,
    /// gnomonic a part in which great circles are straight.
    #[arg(long, value_name = "NAME", default_value = "mollweide", help_heading = "View")]
    projection: ProjectionOption,
    /// Longitude and latitude in the middle, in degrees; of both halves that of the left one.
    #[arg(id = "middle", long = "centre", visible_alias = "center", value_name = "lon,lat", default_value = "0,0")]
    #[arg(allow_hyphen_values = true, value_parser = middle, help_heading = "View")]
    middle: (f64, f64),
    /// Side of a gnomonic picture in degrees, up to 120 [default: 20].
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = finite, help_heading = "View")]
    size: Option<f64>,
    /// East to the left, as the sky is seen from inside, or to the right, as on the Earth [default: earth for grids of
    /// latitude and longitude, points, surfaces, and NetCDF that names no celestial coordinates; else sky].
    #[arg(long, value_name = "SIDE", help_heading = "View")]
    orientation: Option<OrientationOption>,
    /// Values at the ends of the colour bar; either may be left out, as in 0, [default: the 1st and 99th percentiles
    /// of what is seen, the same to both sides of zero where values are of both signs].
    #[arg(long, value_name = "lo,hi", allow_hyphen_values = true, value_parser = range, help_heading = "Colours")]
    range: Option<(Option<f64>, Option<f64>)>,
    /// Let colours follow the logarithm.
    #[arg(long, help_heading = "Colours")]
    log: bool,
    /// Colour map [default: viridis; blue-red for values on both sides of zero; cyclic for directions].
    #[arg(long, visible_alias = "colors", value_name = "NAME", ignore_case = true, help_heading = "Colours")]
    #[arg(value_parser = PossibleValuesParser::new(Colours::ALL.map(|(_, name)| name)))]
    colours: Option<String>,
    /// Text above the map [default: the field's long name, or its name, and its time].
    #[arg(long, value_name = "TEXT", help_heading = "Texts and lines")]
    title: Option<String>,
    /// Text below the colour bar [default: the field's name and unit].
    #[arg(long, value_name = "TEXT", help_heading = "Texts and lines")]
    label: Option<String>,
    /// Width of the picture in pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 1600, allow_negative_numbers = true)]
    #[arg(value_parser = width, help_heading = "Texts and lines")]
    width: usize,
    /// Draw no meridians and parallels.
    #[arg(long, help_heading = "Texts and lines")]
    no_graticule: bool,
    /// Draw the coastlines of the Earth [default: on maps of the Earth only].
    #[arg(long, overrides_with = "no_coastlines", help_heading = "Overlays")]
    coastlines: bool,
    /// Draw no coastlines.
    #[arg(long, help_heading = "Overlays")]
    no_coastlines: bool,
    /// Circle of radius r, in degrees, such as that of a window; may be repeated.
    #[arg(long, value_name = "lon,lat,r", allow_hyphen_values = true, value_parser = circle, help_heading = "Overlays")]
    circle: Vec<Circle>,
    /// Marked point, with a name if one is given; may be repeated.
    #[arg(long, value_name = "lon,lat[,NAME]", allow_hyphen_values = true, value_parser = mark)]
    #[arg(help_heading = "Overlays")]
    mark: Vec<Mark>,
    /// File of the map whose contours are drawn, of any Nside [default: MAP, masked as it is].
    #[arg(long, value_name = "FILE", requires = "contour_threshold", help_heading = "Overlays")]
    contour: Option<PathBuf>,
    /// Thresholds of the contours, in the map's unit: the very lines that longan measures.
    #[arg(long, value_name = "a,b,c|lo:hi:n", allow_hyphen_values = true, help_heading = "Overlays")]
    contour_threshold: Option<Thresholds>,
    /// Variable or column of the contours' file [default: as for --variable].
    #[arg(long, visible_alias = "contour-column", value_name = "NAME|NUMBER", requires = "contour", value_parser = field)]
    #[arg(help_heading = "Overlays")]
    contour_variable: Option<Field>,
    /// Place along a dimension of the contours' file, as for --select.
    #[arg(long, value_name = "DIM=VALUE|DIM=#N", requires = "contour", value_parser = place, help_heading = "Overlays")]
    contour_select: Vec<At>,
    /// Column of directions of the same file, such as EVQ_DIRECTION or PSI2_DIRECTION, drawn as rods without heads; others,
    /// such as PSI4_DIRECTION, as stars.
    #[arg(long, value_name = "NAME|NUMBER", value_parser = field, help_heading = "Overlays")]
    rods: Option<Field>,
    #[command(flatten)]
    input: Input,
    /// Replace an existing picture.
    #[arg(long, help_heading = "Output")]
    overwrite: bool,
    #[command(flatten)]
    running: Running,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum ProjectionOption {
    Mollweide,
    Hammer,
    Orthographic,
    Equirectangular,
    Gnomonic,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum OrientationOption {
    Sky,
    Earth,
}

/// Side of a gnomonic picture in degrees.
const SIZE: f64 = 20.0;

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let start = Instant::now();
    let Arguments { input_file: path, output, running, .. } = arguments;
    let projection = arguments.projection()?;
    let no_form = || format!("{}: the name does not say which picture to write; end it in .png or .svg", shown(output));
    let form = Form::of(output).with_context(no_form)?;
    let inputs = std::iter::once(path).chain(&arguments.input.mask).chain(&arguments.contour);
    check_apart(output, inputs.map(PathBuf::as_path))?;
    formats::check_writable(output, arguments.overwrite)?;
    let mask = arguments.input.mask(running)?;
    let (map, quantity) = arguments.read(&arguments.input, path, mask.as_ref())?;
    if let Some(warning) = regridding::warning(path, &map) {
        running.warn(warning);
    }
    if map.values().iter().all(|v| v.is_nan()) {
        running.warn(format_args!("{}: every pixel is masked, so the picture is grey", shown(path)));
    }
    let is_earth = match arguments.orientation {
        Some(OrientationOption::Sky) => false,
        Some(OrientationOption::Earth) => true,
        None => map.sphere != Sphere::Sky,
    };
    let orientation = if is_earth { Orientation::EastRight } else { Orientation::EastLeft };
    let coastlines = arguments.coastlines || is_earth && map.sphere == Sphere::Earth && !arguments.no_coastlines;
    let overlays = Overlays {
        coastlines,
        lines: arguments.contours(&map)?,
        rods: arguments.rods(path, mask.as_ref())?,
        circles: arguments.circle.clone(),
        marks: arguments.mark.clone(),
    };
    let options = Options {
        title: arguments.title(&map),
        label: arguments.label(&map),
        colouring: Colouring {
            range: arguments.range.unwrap_or_default(),
            log: arguments.log,
            colours: arguments.colours.as_deref().map(str::parse).transpose()?,
            meaning: meaning(quantity),
        },
        view: View::new(projection, arguments.middle, orientation)?,
        graticule: !arguments.no_graticule,
        overlays,
        width: arguments.width,
    };
    let drawing = draw(map.values(), &options).with_context(|| shown(path))?;
    save(output, arguments.overwrite, &form.bytes(&drawing)?)?;
    let (nside, seconds) = (map.grid().nside(), start.elapsed().as_secs_f64());
    let note = regridding::note(&map).map(|note| format!("; {note}")).unwrap_or_default();
    running.say(format_args!("{}: {} of Nside {nside} ({seconds:.2} s){note}", shown(output), map.name))
}

impl Arguments {
    fn projection(&self) -> anyhow::Result<Arc<dyn Projection>> {
        let is_gnomonic = self.projection == ProjectionOption::Gnomonic;
        if self.size.is_some() && !is_gnomonic {
            return Err(misused("--size is of a gnomonic picture; add --projection gnomonic".to_owned()));
        }
        Ok(match self.projection {
            ProjectionOption::Mollweide => Arc::new(Mollweide),
            ProjectionOption::Hammer => Arc::new(Hammer),
            ProjectionOption::Orthographic => Arc::new(Orthographic),
            ProjectionOption::Equirectangular => Arc::new(Equirectangular),
            ProjectionOption::Gnomonic => {
                let size = self.size.unwrap_or(SIZE);
                let sizes = projection::GNOMONIC_SIZES;
                let wrong = |_| {
                    let (least, most) = (sizes.start(), sizes.end());
                    misused(format!("invalid value '{size}' for '--size <DEG>': not between {least} and {most}"))
                };
                Arc::new(Gnomonic::new(size).map_err(wrong)?)
            }
        })
    }

    /// The map of a file and its quantity; of several times the first, and a warning says so.
    fn read(&self, input: &Input, path: &Path, mask: Option<&Mask>) -> anyhow::Result<(Map, Quantity)> {
        let mut series = input.open(path)?;
        let steps = series.steps();
        let map = series.read(0, mask)?;
        let quantity = of_column(series.about().quantity.as_ref(), &map.name);
        if let (true, Some(time)) = (steps > 1, &map.time) {
            let first = &time.label;
            self.running.warn(format_args!(
                "{}: the first of {steps} times is drawn, {first}; choose another with --select, as in --select time={first}",
                shown(path)
            ));
        }
        Ok((map, quantity))
    }

    /// The contours asked for.
    fn contours(&self, map: &Map) -> anyhow::Result<Vec<Vec<[f64; 3]>>> {
        let Some(thresholds) = &self.contour_threshold else { return Ok(Vec::new()) };
        let of = |map: &Map| contour_lines(map, thresholds, Body::Above);
        let Some(path) = &self.contour else { return Ok(of(map)) };
        let selection =
            Selection { field: self.contour_variable.clone(), at: self.contour_select.clone(), ..Selection::default() };
        let other = formats::read(path, &selection).map_err(of_contours)?;
        let system = map.coordinates.filter(|_| !self.input.ignore_coordsys);
        let of_contours = format!("the map of contours {}", shown(path));
        if let Some(mismatch) = of_coordinates(("the map", system), (&of_contours, other.coordinates)) {
            bail!("{}: {mismatch}", shown(&self.input_file));
        }
        Ok(of(&other))
    }

    /// The directions asked for.
    fn rods(&self, path: &Path, mask: Option<&Mask>) -> anyhow::Result<Option<Rods>> {
        if self.rods.is_none() {
            return Ok(None);
        }
        let mut input = self.input.clone();
        input.field.clone_from(&self.rods);
        let mut series = input.open(path)?;
        let map = series.read(0, mask)?;
        let Quantity::Angle { symmetry } = of_column(series.about().quantity.as_ref(), &map.name) else {
            bail!(
                "{}: '{}' is not a column of directions; choose one such as EVQ_DIRECTION or PSI4_DIRECTION for --rods",
                shown(path),
                map.name.escape_debug()
            );
        };
        Ok(Some(Rods { directions: map.into_values(), symmetry }))
    }

    fn title(&self, map: &Map) -> String {
        if let Some(title) = &self.title {
            return title.clone();
        }
        let name = map.long_name.as_ref().unwrap_or(&map.name).trim();
        match &map.time {
            Some(time) if name.is_empty() => time.label.clone(),
            Some(time) => format!("{name}, {}", time.label),
            None => name.to_owned(),
        }
    }

    fn label(&self, map: &Map) -> String {
        if let Some(label) = &self.label {
            return label.clone();
        }
        // The title may have the name already.
        let is_free = self.title.is_none() && map.long_name.is_none();
        let unit = map.unit.as_deref().map(str::trim).filter(|unit| !["", "1"].contains(unit));
        match unit.map(printed) {
            Some(unit) if is_free => unit,
            Some(unit) => format!("{} [{unit}]", map.name.trim()),
            None if is_free => String::new(),
            None => map.name.trim().to_owned(),
        }
    }
}

/// A unit as it is printed: exponents are raised, as in m**2 s**-2, m^2 or m s-1, and u is micro.
fn printed(unit: &str) -> String {
    let word = |word: &str| {
        let word = match word {
            "deg" => return "degrees".to_owned(),
            _ if word.starts_with("uK") => word.replacen('u', "µ", 1),
            _ => word.replace("**", "^"),
        };
        let end = word.trim_end_matches(|c: char| c.is_ascii_digit() || c == '-' || c == '+');
        let (base, exponent) = (end.trim_end_matches('^'), &word[end.len()..]);
        match exponent.parse() {
            // 1e-3 is a number.
            Ok(exponent) if base.ends_with(char::is_alphabetic) && !base.starts_with(|c: char| c.is_ascii_digit()) => {
                format!("{base}{}", superscript(exponent))
            }
            _ => word,
        }
    };
    unit.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Numbers parted by commas.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = text.split(',').map(|x| finite(x.trim())).collect::<Result<_, _>>().ok()?;
    numbers.try_into().ok()
}

/// A longitude and latitude within bounds.
fn on_sphere(longitude: f64, latitude: f64) -> Result<(f64, f64), String> {
    if longitude.abs() <= 360.0 && latitude.abs() <= 90.0 {
        Ok((longitude, latitude))
    } else {
        Err("not a longitude from -360 to 360 and a latitude from -90 to 90".to_owned())
    }
}

fn middle(text: &str) -> Result<(f64, f64), String> {
    let [longitude, latitude] = numbers(text).ok_or("not a longitude and a latitude, such as 120,-30")?;
    on_sphere(longitude, latitude)
}

fn circle(text: &str) -> Result<Circle, String> {
    let [longitude, latitude, radius] =
        numbers(text).ok_or("not a longitude, a latitude and a radius, such as 120,-30,6")?;
    let centre = on_sphere(longitude, latitude)?;
    if radius > 0.0 && radius < 180.0 {
        Ok(Circle { centre, radius })
    } else {
        Err("a radius that is not above 0 and below 180".to_owned())
    }
}

fn mark(text: &str) -> Result<Mark, String> {
    let mut parts = text.splitn(3, ',');
    let [longitude, latitude] = [(); 2].map(|()| parts.next().and_then(|x| finite(x.trim()).ok()));
    let at = longitude.zip(latitude).ok_or("not a longitude and a latitude, such as 120,-30 or 120,-30,NAME")?;
    let label = parts.next().unwrap_or_default().trim().to_owned();
    Ok(Mark { at: on_sphere(at.0, at.1)?, label })
}

fn range(text: &str) -> Result<(Option<f64>, Option<f64>), String> {
    let form = "not two numbers, such as -200,200 (either may be left out, as in 0, or ,5)";
    let (low, high) = text.split_once(',').ok_or(form)?;
    let end = |text: &str| match text.trim() {
        "" => Ok(None),
        number => finite(number).map(Some).map_err(|_| form.to_owned()),
    };
    match (end(low)?, end(high)?) {
        (None, None) => Err(form.to_owned()),
        (Some(low), Some(high)) if low >= high => Err(format!("{low} is not below {high}")),
        range => Ok(range),
    }
}

fn width(text: &str) -> Result<usize, String> {
    let width = text.parse().ok().filter(|width| WIDTHS.contains(width));
    width.ok_or_else(|| format!("not a whole number from {} to {}", WIDTHS.start(), WIDTHS.end()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_printed_with_raised_exponents() {
        for (unit, expected) in [
            ("m**2 s**-2", "m² s⁻²"),
            ("kg m-2 s-1", "kg m⁻² s⁻¹"),
            ("uK^2", "µK²"),
            ("uK_CMB", "µK_CMB"),
            ("K", "K"),
            ("deg", "degrees"),
            ("mm/day", "mm/day"),
            ("1e-3", "1e-3"),
            ("W/m2", "W/m²"),
            ("sigma", "sigma"),
            ("-", "-"),
            ("", ""),
        ] {
            assert_eq!(printed(unit), expected);
        }
    }

    #[test]
    fn places_and_ranges_are_read() {
        assert_eq!(range("-2,3.5"), Ok((Some(-2.0), Some(3.5))));
        assert_eq!(range("0,"), Ok((Some(0.0), None)));
        assert_eq!(range(",1e-5"), Ok((None, Some(1e-5))));
        assert!(["", ",", "3", "3,2", "a,b", "nan,1"].iter().all(|text| range(text).is_err()));
        assert_eq!(mark("10,-20"), Ok(Mark { at: (10.0, -20.0), label: String::new() }));
        assert_eq!(mark(" 10, -20, a, b "), Ok(Mark { at: (10.0, -20.0), label: "a, b".to_owned() }));
        assert!(["10", "10,100", "x,y,z", "400,0"].iter().all(|text| mark(text).is_err()));
        assert_eq!(circle("1,2,6"), Ok(Circle { centre: (1.0, 2.0), radius: 6.0 }));
        assert!(["1,2", "1,2,0", "1,2,180", "1,91,6", "1,2,3,4"].iter().all(|text| circle(text).is_err()));
        assert!(middle("1,2,3").is_err() && middle("-180,90").is_ok());
    }
}
