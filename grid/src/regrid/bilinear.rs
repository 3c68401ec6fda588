//! Weights that interpolate between points, linear in longitude and latitude.

use super::lat_lon::Point;
use super::{COINCIDENT, LatLon, RingWeights, for_rings};
use crate::Healpix;

/// The weights of each ring.
pub(super) fn weights(from: &LatLon, to: Healpix) -> Vec<RingWeights> {
    let columns = around(from);
    for_rings(to, |i| {
        let ring = to.ring(i);
        let rows = rows(from, 90.0 - ring.theta().to_degrees());
        let mut weights = RingWeights::default();
        for j in 0..ring.len {
            let longitude = onward(columns[0].degrees, ring.phi(j as isize).to_degrees());
            for &(row, weight) in &rows {
                match row {
                    Row::Points(row) => {
                        for (column, part) in between(&columns, longitude) {
                            weights.push(from.place(row, column.index), weight * part);
                        }
                    }
                    Row::Mean(row) => {
                        for cell in &from.longitudes.cells {
                            weights.push(from.place(row, cell.index), weight * (cell.width() / 360.0));
                        }
                    }
                }
            }
            weights.end_pixel();
        }
        weights
    })
}

/// What of a row of points a pixel takes; the row by the number of its latitude.
#[derive(Clone, Copy)]
enum Row {
    /// The points about its longitude.
    Points(usize),
    /// The mean.
    Mean(usize),
}

/// The rows about a latitude, with their weights; none beyond the grid.
fn rows(from: &LatLon, latitude: f64) -> Vec<(Row, f64)> {
    let (points, cells) = (&from.latitudes.points, &from.latitudes.cells);
    let (south, north) = (points[0], points[points.len() - 1]);
    let beyond = |outermost: Point, pole: f64| {
        let part = (latitude - outermost.degrees) / (pole - outermost.degrees);
        vec![(Row::Points(outermost.index), 1.0 - part), (Row::Mean(outermost.index), part)]
    };
    if from.periodic && latitude > north.degrees + COINCIDENT && cells[cells.len() - 1].high == 90.0 {
        return beyond(north, 90.0);
    }
    if from.periodic && latitude < south.degrees - COINCIDENT && cells[0].low == -90.0 {
        return beyond(south, -90.0);
    }
    let row = |point: Point| {
        let at_pole = from.periodic && 90.0 - point.degrees.abs() < COINCIDENT;
        if at_pole { Row::Mean(point.index) } else { Row::Points(point.index) }
    };
    between(points, latitude).map(|(point, weight)| (row(point), weight)).collect()
}

/// The columns eastward, with the first one again after the last where they go around the sphere.
fn around(from: &LatLon) -> Vec<Point> {
    let mut columns = from.longitudes.points.clone();
    if from.periodic {
        columns.push(Point { degrees: columns[0].degrees + 360.0, ..columns[0] });
    }
    columns
}

/// A longitude less than one turn from the first column on, but for rounding.
fn onward(first: f64, longitude: f64) -> f64 {
    let east = (longitude - first).rem_euclid(360.0);
    first + if east > 360.0 - COINCIDENT { east - 360.0 } else { east }
}

/// The points about a place, with their weights other than 0; none where it is not between points.
fn between(points: &[Point], at: f64) -> impl Iterator<Item = (Point, f64)> {
    let (first, last) = (points[0], points[points.len() - 1]);
    let pair = if at < first.degrees - COINCIDENT || at > last.degrees + COINCIDENT {
        [(first, 0.0), (last, 0.0)]
    } else if points.len() == 1 {
        [(first, 1.0), (last, 0.0)]
    } else {
        let after = points.partition_point(|point| point.degrees <= at).clamp(1, points.len() - 1);
        let (before, after) = (points[after - 1], points[after]);
        let part = ((at - before.degrees) / (after.degrees - before.degrees)).clamp(0.0, 1.0);
        [(before, 1.0 - part), (after, part)]
    };
    pair.into_iter().filter(|&(_, weight)| weight > 0.0)
}
