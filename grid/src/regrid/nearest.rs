//! Weights that take the nearest point on the sphere.
//!
//! Along every row, the point of the nearest column is the nearest. On that column's meridian, distance from the pixel's
//! centre grows from the foot of the perpendicular, so the nearest row is that with the nearest latitude to the foot's,
//! where latitudes go on beyond a pole.

use super::lat_lon::{Cell, Point};
use super::{COINCIDENT, LatLon, RingWeights, for_rings};
use crate::Healpix;

/// The weights of each ring.
pub(super) fn weights(from: &LatLon, to: Healpix) -> Vec<RingWeights> {
    let (rows, columns) = (&from.latitudes, &from.longitudes);
    for_rings(to, |i| {
        let ring = to.ring(i);
        let has_row = in_cells(&rows.cells, 90.0 - ring.theta().to_degrees());
        let mut weights = RingWeights::default();
        for j in 0..ring.len {
            let longitude = ring.phi(j as isize).to_degrees();
            if has_row && in_cells_around(&columns.cells, longitude) {
                let column = nearest_around(&columns.points, longitude);
                let beside = (longitude - column.degrees).to_radians();
                let foot = ring.cos_theta.atan2(ring.sin_theta * beside.cos()).to_degrees();
                let row = nearest_around(&rows.points, foot);
                weights.push(from.place(row.index, column.index), 1.0);
            }
            weights.end_pixel();
        }
        weights
    })
}

/// Whether a coordinate is in any of the cells.
fn in_cells(cells: &[Cell], degrees: f64) -> bool {
    let after = cells.partition_point(|cell| cell.low <= degrees + COINCIDENT);
    after > 0 && cells[after - 1].high >= degrees - COINCIDENT
}

/// Whether a longitude is in any of the cells, whatever the number of turns.
fn in_cells_around(cells: &[Cell], longitude: f64) -> bool {
    let onward = cells[0].low + (longitude - cells[0].low).rem_euclid(360.0);
    in_cells(cells, onward) || in_cells(cells, onward - 360.0)
}

/// The nearest of ascending points that span less than a turn, whatever the number of turns; of two at the same distance
/// the one before.
fn nearest_around(points: &[Point], degrees: f64) -> Point {
    let first = points[0];
    let onward = first.degrees + (degrees - first.degrees).rem_euclid(360.0);
    let after = points.partition_point(|point| point.degrees <= onward);
    let before = points[after.max(1) - 1];
    let after = points.get(after).copied().unwrap_or(Point { degrees: first.degrees + 360.0, ..first });
    let nearer_after = after.degrees - onward < onward - before.degrees - COINCIDENT;
    if nearer_after { after } else { before }
}
