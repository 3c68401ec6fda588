//! The contour as lines: the very pieces that the engine measures, joined where cells meet. Drawing them is left to others.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use longan_grid::Map;

use crate::contour::{Body, Cell, Field, Segment, Sink, march};
use crate::thresholds::Thresholds;

/// Cell rings that are gone through in a row.
const CHUNK: usize = 32;

/// The contours of a map at all thresholds as lines of unit vectors, the body to their left. Closed lines end where they
/// begin; lines are open only beside masked pixels.
pub fn contour_lines(map: &Map, thresholds: &Thresholds, body: Body) -> Vec<Vec<[f64; 3]>> {
    let lines = lines(&pieces(&Field::new(map.grid(), map.values(), thresholds, body)));
    lines.into_iter().map(|line| line.into_iter().map(|at| at.to_array()).collect()).collect()
}

/// A piece of contour within a cell, on the sphere as it is.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// Number of the threshold.
    threshold: usize,
    /// Where it begins and ends, the body to its left; unit vectors.
    ends: [DVec3; 2],
    /// The pairs of pixels, the smaller first, between which it begins and ends.
    between: [[usize; 2]; 2],
}

/// All pieces of the field's contours, at all its thresholds.
fn pieces(field: &Field<'_>) -> Vec<Piece> {
    let past = 4 * field.grid().nside() + 1;
    let of_chunk = |i: usize| {
        let mut sink = Collect { field, pieces: Vec::new() };
        march(field, i * CHUNK..((i + 1) * CHUNK).min(past), &mut sink);
        sink.pieces
    };
    (0..past.div_ceil(CHUNK)).into_par_iter().flat_map_iter(of_chunk).collect()
}

/// The pieces joined to lines, as long as they go: closed ones end where they begin.
fn lines(pieces: &[Piece]) -> Vec<Vec<DVec3>> {
    let starts: HashMap<(usize, [usize; 2]), usize> =
        pieces.iter().enumerate().map(|(i, piece)| ((piece.threshold, piece.between[0]), i)).collect();
    let next = |piece: &Piece| starts.get(&(piece.threshold, piece.between[1])).copied();
    let mut is_first = vec![true; pieces.len()];
    pieces.iter().filter_map(next).for_each(|i| is_first[i] = false);
    let mut left = vec![true; pieces.len()];
    let mut lines = Vec::new();
    // Those that begin at masked pixels, then the closed ones, from anywhere.
    let first = (0..pieces.len()).filter(|&i| is_first[i]);
    for start in first.chain(0..pieces.len()) {
        if !left[start] {
            continue;
        }
        let mut line = vec![pieces[start].ends[0]];
        let mut here = Some(start);
        while let Some(i) = here.filter(|&i| left[i]) {
            left[i] = false;
            line.push(pieces[i].ends[1]);
            here = next(&pieces[i]);
        }
        lines.push(line);
    }
    lines
}

/// Collects the pieces.
struct Collect<'a, 'b> {
    field: &'a Field<'b>,
    pieces: Vec<Piece>,
}

impl Sink for Collect<'_, '_> {
    fn wants_area(&self) -> bool {
        false
    }

    fn wants_edges(&self) -> bool {
        false
    }

    fn masked(&mut self, _: Cell<'_>, _: f64) {}

    fn inside(&mut self, _: Cell<'_>, _: Range<usize>, _: f64) {}

    fn area(&mut self, _: Cell<'_>, _: usize, _: f64) {}

    fn contour(&mut self, cell: Cell<'_>, threshold: usize, segments: &[Segment<'_>]) {
        let pixel = cell.pixels[0];
        let longitude = self.field.grid().ring(pixel.ring).phi(pixel.column as isize);
        for segment in segments {
            // The frame of the geometry is turned about the pole: back by what its first corner is off.
            let corner = segment.geometry.corner[0];
            let turn = DMat3::from_rotation_z(longitude - corner.y.atan2(corner.x));
            let between = segment.edges().map(|edge| {
                let (a, b) = (cell.pixels[edge].index, cell.pixels[(edge + 1) % cell.count].index);
                [a.min(b), a.max(b)]
            });
            self.pieces.push(Piece { threshold, ends: segment.ends().map(|end| turn * end), between });
        }
    }

    fn cell_finished(&mut self, _: Cell<'_>) {}

    fn ring_finished(&mut self, _: usize) {}
}

#[cfg(test)]
mod tests {
    use longan_grid::Healpix;

    use super::*;
    use crate::simulate::Waves;
    use crate::totals::totals;

    /// A Gaussian field, some of it masked if asked for.
    fn values(nside: usize, masked: bool) -> Vec<f64> {
        let map = Waves::new(12.0, 3).unwrap().map(Healpix::new(nside).unwrap());
        let mask = |(i, v)| if masked && i % 97 < 5 { f64::NAN } else { v };
        map.into_values().into_iter().enumerate().map(mask).collect()
    }

    #[test]
    fn the_pieces_are_as_long_as_the_contour_that_is_measured() {
        for nside in [1, 2, 5, 16, 24] {
            for masked in [false, true] {
                for body in [Body::Above, Body::Below] {
                    let grid = Healpix::new(nside).unwrap();
                    let (values, thresholds) = (values(nside, masked), Thresholds::new(vec![-0.7, 0.0, 1.1]).unwrap());
                    let field = Field::new(grid, &values, &thresholds, body);
                    let pieces = pieces(&field);
                    for (t, expected) in totals(&field).0.iter().enumerate() {
                        let length = |piece: &Piece| {
                            let [a, b] = piece.ends;
                            2.0 * (0.5 * (b - a).length()).asin()
                        };
                        let sum: f64 = pieces.iter().filter(|p| p.threshold == t).map(length).sum();
                        assert!((sum - expected.length).abs() < 1e-10, "Nside {nside}: {sum} {}", expected.length);
                    }
                }
            }
        }
    }

    #[test]
    fn pieces_lie_between_the_pixels_that_they_part() {
        let (grid, values) = (Healpix::new(8).unwrap(), values(8, false));
        let thresholds = Thresholds::new(vec![0.2]).unwrap();
        for piece in pieces(&Field::new(grid, &values, &thresholds, Body::Above)) {
            for (end, [a, b]) in piece.ends.into_iter().zip(piece.between) {
                let [a, b] = [a, b]
                    .map(|p| grid.centre(p))
                    .map(|(theta, phi)| DVec3::from_array(longan_grid::directions::at_colatitude(theta, phi)));
                // On the geodesic between both.
                let detour = a.angle_between(end) + end.angle_between(b) - a.angle_between(b);
                assert!(detour.abs() < 1e-6 && a.cross(b).normalize().dot(end).abs() < 1e-12, "{piece:?}");
            }
        }
    }

    #[test]
    fn lines_have_every_piece_once_and_close() {
        for masked in [false, true] {
            let (grid, values) = (Healpix::new(16).unwrap(), values(16, masked));
            let thresholds = Thresholds::new(vec![-0.5, 0.4]).unwrap();
            let pieces = pieces(&Field::new(grid, &values, &thresholds, Body::Above));
            let lines = lines(&pieces);
            assert_eq!(lines.iter().map(|line| line.len() - 1).sum::<usize>(), pieces.len());
            let closed = lines.iter().filter(|line| (line[0] - *line.last().unwrap()).length() < 1e-12).count();
            assert!(closed > 3 && (masked || closed == lines.len()), "{closed} of {}", lines.len());
            // Far fewer lines than pieces, and none with a leap.
            assert!(lines.len() < pieces.len() / 3);
            let longest = lines.iter().flat_map(|line| line.windows(2)).map(|w| (w[1] - w[0]).length());
            assert!(longest.fold(0.0, f64::max) < 0.15);
        }
    }
}
