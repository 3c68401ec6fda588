//! Which way a field on another grid, or at points, comes to HEALPix: the way asked for, or the one that suits.
//!
//! A value that stands for a whole cell, or for all that is nearest to a point, makes a map of steps where pixels are
//! finer than that. Contours follow the steps and come out too long, so that such maps are made by interpolation unless
//! steps are asked for. The ways themselves are left to [`crate::Weights`] and [`crate::Points`], what people are told to
//! the callers.

use std::f64::consts::SQRT_2;
use std::fmt;

use crate::healpix::closest_nside;
use crate::{Gather, Healpix, LatLon, Method};

/// Pixels count as finer than a grid whose spacing is more than this many times their side. The Nside closest to a
/// spacing is thus never finer. Steps make the contours of a Gaussian field 0.4 % too short at most where its correlation
/// angle is four cells or more and the spacing is 1.37 sides of a pixel; 2 % too long at 2.0 sides, 6 % at 2.7, 15 to 17 %
/// at 5.5. Interpolation leaves 0.7 % at any of them.
pub const FINER: f64 = SQRT_2;

/// Means of points have steps where more pixels than this are empty. With 2 % of them empty, contours among points at random
/// come out 2 % too long, with 14 % 5 %, with 37 % 9 %.
const EMPTY: f64 = 0.05;

/// Where pixels are finer than points lie, they are smoothed by a Gaussian of this many times the typical distance, unless
/// another way is asked for. Among points at random, the contours of a Gaussian field whose correlation angle is four and
/// eight distances come out 2 % and 0.3 % too short, with the mean and the nearest point 29 % too long. At 1.5 times the
/// distance they are 1 % and 2 % too long: how points happen to lie shows. What is smaller is lost, 12 % of the contours
/// where the correlation angle is but two distances.
const SMOOTH: f64 = 2.0;

/// A Gaussian that is not asked for has a width of so many digits: a user can type it, and data that lack a few of the
/// points of others get the same one.
const WIDTH_DIGITS: usize = 2;

/// The widest Gaussian, in degrees.
const WIDEST: f64 = 180.0;

/// How a field came to HEALPix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regridded {
    /// The way.
    pub way: Way,
    /// Whether the spacing decided on the way, as none was asked for.
    pub by_default: bool,
    /// The distance between the points of the grid, or typically between points, in degrees; none where all points are
    /// at one place.
    pub spacing: Option<f64>,
    /// The grid of the map.
    pub grid: Healpix,
    /// Whether the outer halves of the outermost cells are left out, as interpolation ends at the outermost points.
    pub without_rim: bool,
    /// Pixels farther than this from any point are masked, in degrees.
    pub reach: Option<f64>,
    /// Of means of points, the share of pixels that hold none and take the value of the nearest; known once a map is made.
    pub empty: f64,
}

/// A way to HEALPix. Its name is that of the command line and of headers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// From a grid of longitude and latitude.
    Grid(Method),
    /// From points.
    Points(Gather),
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Way::Grid(Method::Conservative) => f.write_str("conservative"),
            Way::Grid(Method::Bilinear) => f.write_str("bilinear"),
            Way::Grid(Method::Nearest) | Way::Points(Gather::Nearest) => f.write_str("nearest"),
            Way::Points(Gather::Mean) => f.write_str("mean"),
            Way::Points(Gather::Gaussian { fwhm }) => write!(f, "gaussian:{fwhm}"),
        }
    }
}

/// The method for a grid: the one asked for, or else [`Method::Bilinear`] where pixels are finer than the grid and there
/// are points to interpolate between, [`Method::Conservative`] where not.
pub fn method(from: &LatLon, to: Healpix, asked: Option<Method>) -> (Method, Regridded) {
    let spacing = from.spacing_degrees();
    let suits = if is_finer(to, spacing) && from.has_squares() { Method::Bilinear } else { Method::Conservative };
    let method = asked.unwrap_or(suits);
    let regridded = Regridded {
        way: Way::Grid(method),
        by_default: asked.is_none(),
        spacing: Some(spacing),
        grid: to,
        without_rim: method == Method::Bilinear && !from.is_global(),
        reach: None,
        empty: 0.0,
    };
    (method, regridded)
}

/// The way for points of a typical distance in radians, where they are at several places: the one asked for, or else
/// [`Gather::Gaussian`] where pixels are finer than that, [`Gather::Mean`] where not.
pub(crate) fn gather(spacing: Option<f64>, to: Healpix, asked: Option<Gather>) -> (Gather, Regridded) {
    let spacing = spacing.map(f64::to_degrees);
    let suits = match spacing.filter(|spacing| is_finer(to, *spacing)) {
        Some(spacing) => Gather::Gaussian { fwhm: short((SMOOTH * spacing).min(WIDEST)) },
        None => Gather::Mean,
    };
    let gather = asked.unwrap_or(suits);
    let by_default = asked.is_none();
    let way = Way::Points(gather);
    (gather, Regridded { way, by_default, spacing, grid: to, without_rim: false, reach: None, empty: 0.0 })
}

/// Whether pixels are finer than a spacing in degrees.
fn is_finer(grid: Healpix, spacing: f64) -> bool {
    spacing > FINER * grid.pixel_side().to_degrees()
}

/// A width of few digits.
fn short(width: f64) -> f64 {
    format!("{width:.*e}", WIDTH_DIGITS - 1).parse().unwrap_or(width)
}

impl Regridded {
    /// The side of a pixel in degrees.
    pub fn pixel(&self) -> f64 {
        self.grid.pixel_side().to_degrees()
    }

    /// The spacing in sides of a pixel.
    pub fn ratio(&self) -> Option<f64> {
        self.spacing.map(|spacing| spacing / self.pixel())
    }

    /// Whether pixels are finer than the grid, or than points lie.
    pub fn is_finer(&self) -> bool {
        self.spacing.is_some_and(|spacing| is_finer(self.grid, spacing))
    }

    /// Whether the map has steps that a smooth field has not. Whoever asks for the nearest value wants them, as of
    /// categories.
    pub fn has_steps(&self) -> bool {
        self.is_finer() && matches!(self.way, Way::Grid(Method::Conservative) | Way::Points(Gather::Mean))
    }

    /// The Gaussian that would do without steps, where the map is of means of points and many pixels are empty.
    pub fn smoother(&self) -> Option<Gather> {
        let spacing = self.spacing.filter(|_| self.empty > EMPTY)?;
        (self.way == Way::Points(Gather::Mean))
            .then_some(Gather::Gaussian { fwhm: short((SMOOTH * spacing).min(WIDEST)) })
    }

    /// The Nside, a power of two, whose pixels are closest to the spacing in size.
    pub fn suitable_nside(&self) -> Option<usize> {
        self.spacing.map(|spacing| closest_nside(spacing.to_radians()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(nside: usize) -> Healpix {
        Healpix::new(nside).unwrap()
    }

    /// A grid of a spacing in degrees, with so many rows from the south pole on.
    fn lat_lon(spacing: f64, rows: usize) -> LatLon {
        let edges: Vec<f64> = (0..=rows).map(|i| -90.0 + i as f64 * spacing).collect();
        let latitudes: Vec<f64> = edges.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        let longitudes: Vec<f64> = (0..(360.0 / spacing) as usize).map(|i| i as f64 * spacing).collect();
        LatLon::new(&latitudes, Some(&edges), &longitudes, None).unwrap()
    }

    #[test]
    fn the_nside_closest_to_a_grid_is_not_finer_and_the_one_after_the_next_is() {
        for spacing in [0.3, 1.0, 2.5, 4.0, 7.5, 20.0] {
            let from = lat_lon(spacing, (180.0 / spacing) as usize);
            let closest = from.nside_closest();
            for (nside, expected) in [
                (closest, Method::Conservative),
                (closest.max(2) / 2, Method::Conservative),
                (4 * closest, Method::Bilinear),
            ] {
                let (method, done) = method(&from, grid(nside), None);
                assert_eq!((method, done.way), (expected, Way::Grid(expected)), "{spacing}°, Nside {nside}");
                assert_eq!(done.is_finer(), expected == Method::Bilinear);
                assert!(done.by_default && !done.has_steps() && !done.without_rim);
                assert_eq!(done.suitable_nside(), Some(closest));
            }
        }
    }

    #[test]
    fn the_limit_is_where_it_is_said_to_be() {
        let side = grid(16).pixel_side().to_degrees();
        for (ratio, finer) in [(1.0, false), (FINER * 0.999, false), (FINER * 1.001, true)] {
            let (way, done) = gather(Some((ratio * side).to_radians()), grid(16), None);
            assert_eq!((done.is_finer(), way != Gather::Mean), (finer, finer), "{ratio}");
            assert!((done.ratio().unwrap() - ratio).abs() < 1e-12);
        }
    }

    #[test]
    fn means_of_few_points_have_a_smoother_way() {
        for (empty, few) in [(0.0, false), (EMPTY * 0.9, false), (EMPTY * 1.1, true)] {
            let (_, done) = gather(Some(0.1), grid(8), Some(Gather::Mean));
            assert_eq!(Regridded { empty, ..done }.smoother().is_some(), few, "{empty}");
        }
    }

    #[test]
    fn what_is_asked_for_is_done() {
        let from = lat_lon(5.0, 36);
        for asked in [Method::Conservative, Method::Bilinear, Method::Nearest] {
            let (method, done) = method(&from, grid(128), Some(asked));
            assert!(method == asked && done.way == Way::Grid(asked) && !done.by_default && done.is_finer());
            assert_eq!(done.has_steps(), asked == Method::Conservative);
        }
        for asked in [Gather::Mean, Gather::Nearest, Gather::Gaussian { fwhm: 1.0 }] {
            let (gather, done) = gather(Some(0.1), grid(128), Some(asked));
            assert!(gather == asked && done.way == Way::Points(asked) && !done.by_default && done.is_finer());
            assert_eq!(done.has_steps(), asked == Gather::Mean);
        }
    }

    #[test]
    fn one_row_has_nothing_to_interpolate_between() {
        let (method, done) = method(&lat_lon(10.0, 1), grid(128), None);
        assert!(method == Method::Conservative && done.by_default && done.has_steps());
    }

    #[test]
    fn a_region_loses_its_rim_by_interpolation_only() {
        let from = lat_lon(10.0, 4);
        assert!(method(&from, grid(128), None).1.without_rim);
        assert!(!method(&from, grid(128), Some(Method::Conservative)).1.without_rim);
        assert!(!method(&from, grid(4), None).1.without_rim);
    }

    #[test]
    fn a_gaussian_by_default_has_a_width_that_can_be_typed() {
        for (spacing, fwhm, name) in
            [(2.5213, 5.0, "gaussian:5"), (0.0314, 0.063, "gaussian:0.063"), (120.0, 180.0, "gaussian:180")]
        {
            let (gather, done) = gather(Some(f64::to_radians(spacing)), grid(4096), None);
            assert_eq!((gather, done.way.to_string().as_str()), (Gather::Gaussian { fwhm }, name));
        }
        // All at one place, there is no distance to go by.
        let (gather, done) = gather(None, grid(4096), None);
        assert!(
            gather == Gather::Mean && !done.has_steps() && done.ratio().is_none() && done.suitable_nside().is_none()
        );
    }
}
