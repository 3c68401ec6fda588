//! Unit vectors: directions from a centre, how densely points lie, and maps made direction by direction.
//!
//! How values become a map is left to [`crate::Points`] and [`crate::Surface`].

use std::collections::HashSet;
use std::f64::consts::PI;

use ndarray::{ArrayView1, ArrayView2};
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::map::reserved;
use crate::{Error, Healpix, Map};

/// A unit vector.
pub type Direction = [f64; 3];

/// A direction with a number, as a tree for searches holds it.
pub(crate) type Numbered = GeomWithData<Direction, usize>;

/// Directions closer than this, in radians, count as one. It is far above rounding (1e-16) and far below the digits of
/// any file: 0.6 mm on Earth.
pub(crate) const COINCIDENT: f64 = 1e-10;

/// Coordinates beyond this could not be squared.
pub const FARTHEST: f64 = 1e100;

/// Components of directions below this count as zero, so that the product of any three has all its digits.
const NEGLIGIBLE: f64 = 1e-60;

/// The neighbour whose distance tells how dense points are. On lattices and among random points alike, the fourth is
/// about as far as the square root of the area that there is for each point; nearer ones vary more.
const NEIGHBOUR: usize = 4;

/// The direction to a longitude and latitude in radians.
pub fn at(longitude: f64, latitude: f64) -> Direction {
    let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = (longitude.sin_cos(), latitude.sin_cos());
    [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat]
}

/// The direction to a colatitude and longitude in radians; near the poles it keeps digits that a latitude has not.
pub fn at_colatitude(theta: f64, phi: f64) -> Direction {
    let ((sin, cos), (sin_phi, cos_phi)) = (theta.sin_cos(), phi.sin_cos());
    [sin * cos_phi, sin * sin_phi, cos]
}

/// The direction from a centre to a point and their distance; nothing where they are the same.
pub fn from_centre(point: [f64; 3], centre: [f64; 3]) -> Option<(Direction, f64)> {
    let from: [f64; 3] = std::array::from_fn(|i| point[i] - centre[i]);
    let largest = from.iter().fold(0.0, |largest: f64, c| largest.max(c.abs()));
    // Scaled, so that squares neither overflow nor vanish.
    let scaled = from.map(|c| c / largest);
    let length = dot(scaled, scaled).sqrt();
    let direction = scaled.map(|c| c / length).map(|c| if c.abs() < NEGLIGIBLE { 0.0 } else { c });
    (largest > 0.0).then_some((direction, length * largest))
}

/// The centre that is given, or else the mean of points.
///
/// # Errors
/// [`Error::Setting`] where a coordinate of the centre is beyond [`FARTHEST`].
pub fn centre(given: Option<[f64; 3]>, points: impl ExactSizeIterator<Item = [f64; 3]>) -> Result<[f64; 3], Error> {
    let Some(centre) = given else { return Ok(mean(points)) };
    match centre.into_iter().find(|c| c.is_nan() || c.abs() > FARTHEST) {
        Some(value) => {
            Err(Error::Setting { what: "a coordinate of the centre", value, expected: "a number from -1e100 to 1e100" })
        }
        None => Ok(centre),
    }
}

/// The rows x, y, z of an array.
pub(crate) fn positions(name: &'static str, rows: ArrayView2<'_, f64>) -> Result<Vec<[f64; 3]>, Error> {
    if rows.ncols() != 3 {
        return Err(Error::Columns { name, found: rows.ncols() });
    }
    let position = |row: ArrayView1<'_, f64>| {
        let position = [row[0], row[1], row[2]];
        match position.into_iter().find(|c| c.is_nan() || c.abs() > FARTHEST) {
            Some(value) => {
                Err(Error::Setting { what: "a coordinate", value, expected: "a number from -1e100 to 1e100" })
            }
            None => Ok(position),
        }
    };
    rows.rows().into_iter().map(position).collect()
}

/// The mean of points; the origin where there is none.
pub(crate) fn mean(points: impl ExactSizeIterator<Item = [f64; 3]>) -> [f64; 3] {
    let count = points.len().max(1) as f64;
    points.fold([0.0; 3], |sum, point| std::array::from_fn(|i| sum[i] + point[i] / count))
}

/// The direction to the centre of a pixel.
fn of_pixel(grid: Healpix, pixel: usize) -> Direction {
    let ring = grid.ring(grid.ring_of(pixel));
    let (sin_phi, cos_phi) = ring.phi((pixel - ring.start) as isize).sin_cos();
    [ring.sin_theta * cos_phi, ring.sin_theta * sin_phi, ring.cos_theta]
}

/// The pixel that a direction lies in.
pub(crate) fn pixel_at(grid: Healpix, [x, y, z]: Direction) -> usize {
    grid.pixel_at(x.hypot(y).atan2(z), y.atan2(x))
}

/// The scalar product.
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The length of the chord between directions that are this angle apart.
pub(crate) fn chord(angle: f64) -> f64 {
    2.0 * (angle.clamp(0.0, PI) / 2.0).sin()
}

/// The angle between directions with this square of their chord.
pub(crate) fn angle(squared_chord: f64) -> f64 {
    2.0 * (squared_chord.sqrt() / 2.0).min(1.0).asin()
}

/// A tree of all directions, numbered in their order.
pub(crate) fn tree(directions: &[Direction]) -> RTree<Numbered> {
    RTree::bulk_load(directions.iter().enumerate().map(|(i, &d)| Numbered::new(d, i)).collect())
}

/// A tree of the places of directions, each numbered by the first direction that lies there.
pub(crate) fn places(directions: impl Iterator<Item = Direction>) -> RTree<Numbered> {
    // Two halves of a place on either side of a cell's edge stay two, which searches bear.
    let mut seen = HashSet::new();
    let firsts = directions.enumerate().filter(|(_, d)| seen.insert(d.map(|c| (c / COINCIDENT).round() as i64)));
    RTree::bulk_load(firsts.map(|(i, d)| Numbered::new(d, i)).collect())
}

/// The number of the place nearest to a direction, the lowest of several that are equally near, and the square of its
/// chord.
pub(crate) fn nearest(places: &RTree<Numbered>, direction: Direction) -> Option<(usize, f64)> {
    let mut nearest = places.nearest_neighbor_iter_with_distance_2(direction);
    let (first, squared) = nearest.next()?;
    let limit = (squared.sqrt() + COINCIDENT).powi(2);
    let others = nearest.take_while(|&(_, squared)| squared <= limit).map(|(place, _)| place.data);
    Some((others.fold(first.data, usize::min), squared))
}

/// The typical distance between places in radians: the median of the distances to the fourth nearest neighbour (to the
/// last one, where there are fewer). Nothing where there is but one place.
pub(crate) fn spacing(places: &RTree<Numbered>) -> Option<f64> {
    let all: Vec<&Numbered> = places.iter().collect();
    let distance = |place: &&Numbered| {
        let neighbours = places.nearest_neighbor_iter_with_distance_2(*place.geom());
        neighbours.map(|(_, squared)| squared).filter(|&s| s > COINCIDENT.powi(2)).take(NEIGHBOUR).last()
    };
    let mut squares: Vec<f64> = all.par_iter().filter_map(distance).collect();
    let middle = squares.len() / 2;
    (!squares.is_empty()).then(|| angle(*squares.select_nth_unstable_by(middle, f64::total_cmp).1))
}

/// A map of what a function says of the direction to each pixel's centre; what is not finite is masked.
pub(crate) fn chart(grid: Healpix, value: impl Fn(usize, Direction) -> f64 + Sync) -> Result<Map, Error> {
    let mut values = reserved(grid)?;
    values.resize(grid.pixels(), f64::NAN);
    values.par_iter_mut().enumerate().for_each(|(pixel, out)| {
        let found = value(pixel, of_pixel(grid, pixel));
        *out = if found.is_finite() { found } else { f64::NAN };
    });
    Ok(Map::from_masked(grid, values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, TAU};

    /// Points spread evenly over the sphere.
    fn fibonacci(count: usize) -> Vec<Direction> {
        let golden = (1.0 + 5f64.sqrt()) / 2.0;
        let point = |i: usize| {
            let z: f64 = 1.0 - (2 * i + 1) as f64 / count as f64;
            at(TAU * (i as f64 / golden).fract(), z.asin())
        };
        (0..count).map(point).collect()
    }

    #[test]
    fn directions_have_length_one_whatever_the_scale() {
        for scale in [1e-100, 1.0, 1e99] {
            let (direction, distance) = from_centre([3.0 * scale, 0.0, 4.0 * scale], [0.0; 3]).unwrap();
            for (found, expected) in direction.into_iter().zip([0.6, 0.0, 0.8]) {
                assert!((found - expected).abs() < 1e-15);
            }
            assert!((distance / scale - 5.0).abs() < 1e-14);
        }
        assert_eq!(from_centre([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]), None);
    }

    #[test]
    fn pixels_hold_their_centres() {
        for nside in [1, 3, 16] {
            let grid = Healpix::new(nside).unwrap();
            for p in 0..grid.pixels() {
                assert_eq!(pixel_at(grid, of_pixel(grid, p)), p);
            }
            // Just south of the poles, and on either side of the meridian where longitudes begin.
            for d in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, -1e-30, 0.0], [1.0, -0.0, 0.0], [-1.0, -0.0, 0.0]] {
                assert!(pixel_at(grid, d) < grid.pixels());
            }
        }
    }

    #[test]
    fn chords_and_angles_are_inverse() {
        for a in [0.0, 1e-9, 0.3, FRAC_PI_2, 3.0, PI] {
            assert!((angle(chord(a).powi(2)) - a).abs() < 1e-8);
        }
    }

    #[test]
    fn the_spacing_is_the_root_of_the_area_per_point() {
        let points = fibonacci(5000);
        let per_point = (4.0 * PI / 5000.0).sqrt();
        let found = spacing(&places(points.iter().copied())).unwrap();
        assert!((found / per_point - 1.0).abs() < 0.1, "{found} {per_point}");
        // Coincident points count once, however many there are, and whichever way a longitude is written.
        let twice = points.iter().copied().chain(points.iter().map(|&[x, y, z]| [x, y + 1e-14, z]));
        assert!((spacing(&places(twice)).unwrap() / found - 1.0).abs() < 1e-6);
        assert_eq!(spacing(&places(std::iter::repeat_n([0.0, 0.0, 1.0], 1000))), None);
        assert_eq!(spacing(&places(std::iter::empty())), None);
        let pair = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
        assert!((spacing(&places(pair.into_iter())).unwrap() - FRAC_PI_2).abs() < 1e-15);
    }
}
