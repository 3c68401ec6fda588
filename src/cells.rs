//! The dual grid: one cell around every vertex of the HEALPix grid, with pixel centres as its corners.
//!
//! A grid of Npix pixels has Npix + 2 cells: one at the east vertex of each pixel, and the two poles. A cell has four
//! corners, or three at the eight vertices where three base pixels meet. Its edges are geodesics, so the cells tile
//! the sphere. Each pixel is a corner of exactly four cells.
//!
//! Everything follows from RING order in closed form, for any Nside and without neighbour tables. A ring repeats
//! itself: `sectors` times the same cells, turned about the pole (four times in the polar caps, once a pixel in the
//! equatorial belt). So a [`Stencil`], the corners of one cell in the first sector, and its [`Geometry`] serve all.
//! What is done with cells is left to [`crate::contour`].

use std::f64::consts::PI;

use glam::DVec3;
use longan_grid::{Healpix, Ring};

use crate::angles;

/// A corner of a stencil: the pixel `column` of `ring` in the first sector; `per_sector` pixels further in each next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Corner {
    ring: usize,
    column: usize,
    per_sector: usize,
    len: usize,
    start: usize,
}

/// One cell of a ring and its copies in the other sectors.
#[derive(Clone, Debug)]
pub struct Stencil {
    corners: [Corner; 4],
    count: usize,
    /// Longitude at which the geometry has φ = 0, in the first sector.
    meridian: f64,
}

/// A corner of a cell: a pixel, by ring and by place in the ring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pixel {
    /// Ring, from 1 at the north.
    pub ring: usize,
    /// Place in the ring, from 0.
    pub column: usize,
    /// RING index.
    pub index: usize,
}

impl Stencil {
    /// Number of corners, 4 or 3.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The corners of the copy in this sector, counter-clockwise seen from outside; only the first
    /// [`count`](Self::count) are meant.
    #[inline(always)]
    pub fn pixels(&self, sector: usize) -> [Pixel; 4] {
        self.corners.map(|corner| corner.pixel(sector))
    }
}

impl Corner {
    #[inline(always)]
    fn pixel(&self, sector: usize) -> Pixel {
        let mut column = self.column + sector * self.per_sector;
        if column >= self.len {
            column -= self.len;
        }
        Pixel { ring: self.ring, column, index: self.start + column }
    }

    /// The pixel to the west, which may lie in the sector before.
    fn west(self) -> Self {
        Corner { column: (self.column + self.len - 1) % self.len, ..self }
    }
}

/// A pixel ring near a cell ring.
#[derive(Clone, Copy, Debug)]
struct Near {
    number: usize,
    ring: Ring,
    per_sector: usize,
}

const NORTH: usize = 0;
const SAME: usize = 1;
const SOUTH: usize = 2;

/// The cells of one ring: `stencils` different ones, each repeated in `sectors` sectors.
///
/// Ring 0 is the north pole's cell, ring 4 Nside the south pole's; ring i between them holds the cells east of
/// the pixels of ring i, in their order.
#[derive(Clone, Copy, Debug)]
pub struct CellRing {
    nside: usize,
    ring: usize,
    /// The pixel rings to the north, of the same number, and to the south; a pole's cell has its only one three times.
    near: [Near; 3],
    /// Number of different cells in a sector.
    pub stencils: usize,
    /// Number of sectors.
    pub sectors: usize,
    /// Whether all cells of the ring have one geometry, whatever their stencil.
    pub uniform: bool,
}

impl CellRing {
    /// The cells of ring `0..=4 Nside`.
    pub fn new(grid: Healpix, ring: usize) -> Self {
        let n = grid.nside();
        let from_pole = ring.min(4 * n - ring);
        let (stencils, sectors) = match from_pole {
            0 => (1, 1),
            i if i <= n => (i, 4),
            _ => (1, 4 * n),
        };
        let near = [ring.saturating_sub(1), ring, ring + 1].map(|i| {
            let number = i.clamp(1, grid.rings());
            let ring = grid.ring(number);
            Near { number, ring, per_sector: ring.len / sectors }
        });
        CellRing { nside: n, ring, near, stencils, sectors, uniform: stencils == 1 }
    }

    /// The `k`-th stencil of the ring, `0..self.stencils`.
    pub fn stencil(&self, k: usize) -> Stencil {
        let (n, i) = (self.nside, self.ring);
        let corner = |side: usize, column: usize| {
            let Near { number, ring, per_sector } = self.near[side];
            Corner { ring: number, column, per_sector, len: ring.len, start: ring.start }
        };
        if i == 0 || i == 4 * n {
            let columns = if i == 0 { [0, 1, 2, 3] } else { [3, 2, 1, 0] };
            return Stencil { corners: columns.map(|c| corner(SAME, c)), count: 4, meridian: 0.0 };
        }
        let (west, east) = (corner(SAME, k), corner(SAME, k + 1));
        let north = |column| corner(NORTH, column);
        let south = |column| corner(SOUTH, column);
        let last = k + 1 == self.stencils;
        let (corners, count) = if i > n && i < 3 * n {
            let column = usize::from(self.near[SAME].ring.shifted);
            ([west, south(column), east, north(column)], 4)
        } else if i < n && last {
            ([west, south(k + 1), south(k + 2), east], 4)
        } else if i == n && last {
            ([west, south(k + 1), east, west], 3)
        } else if i <= n {
            ([west, south(k + 1), east, north(k)], 4)
        } else if i == 3 * n && last {
            ([west, east, north(k + 1), west], 3)
        } else if i > 3 * n && last {
            ([west, east, north(k + 2), north(k + 1)], 4)
        } else {
            ([west, south(k), east, north(k + 1)], 4)
        };
        let ring = self.near[SAME].ring;
        let meridian = (2 * k + 1 + usize::from(ring.shifted)) as f64 * (PI / ring.len as f64);
        Stencil { corners, count, meridian }
    }

    /// Which cells of the ring have a corner among the pixels told, of which the first has the RING index `first`.
    pub(crate) fn with_corners(&self, told: &[bool], first: usize) -> Vec<bool> {
        let cells = self.stencils * self.sectors;
        let mut found = vec![false; cells];
        // Within a run, in a cap that of a sector, all corners but those of the last cell are at neighbouring pixels.
        let run = if self.near.iter().all(|near| near.per_sector == 1) { cells } else { self.stencils };
        for start in (0..cells).step_by(run) {
            let last = start + run - 1;
            for (cell, count) in [(start, run - 1), (last, 1)] {
                let (stencil, sector) = (self.stencil(cell % self.stencils), cell / self.stencils);
                for corner in stencil.pixels(sector)[..stencil.count].iter().filter(|_| count > 0) {
                    let told = &told[corner.index - first..];
                    found[cell..cell + count].iter_mut().zip(told).for_each(|(found, told)| *found |= told);
                }
            }
        }
        found
    }

    /// The cells beyond the edges of a stencil's copy in this sector, each by its ring and its place there. An edge has
    /// the number of its first corner; a triangle has no fourth.
    pub(crate) fn beyond(&self, stencil: &Stencil, sector: usize) -> [Option<(usize, usize)>; 4] {
        let (n, i, count) = (self.nside, self.ring, stencil.count);
        std::array::from_fn(|edge| {
            let (from, to) = (stencil.corners[edge], stencil.corners[(edge + 1) % count]);
            let west = stencil.corners[0];
            // Two pixels share a side; the cells at its ends are this one and that beyond, which is here found as the
            // one east of a pixel.
            let east_of = match (from.ring == i, to.ring == i) {
                _ if edge >= count => return None,
                // Of two pixels on different rings, that cell lies west or east of the one on the other ring.
                (true, false) => {
                    if from == west {
                        to.west()
                    } else {
                        to
                    }
                }
                (false, true) => {
                    if to == west {
                        from.west()
                    } else {
                        from
                    }
                }
                // Both are on the next ring from the pole, or about it: the cell between them there.
                (false, false) => {
                    if i < n {
                        from
                    } else {
                        to
                    }
                }
                // Both are on this ring, at a boundary of base pixels in a cap: the cell between them nearer the pole,
                // or the pole's.
                (true, true) => {
                    let (side, pole) = if i <= n { (NORTH, 0) } else { (SOUTH, 4 * n) };
                    let Near { number, ring, per_sector } = self.near[side];
                    if number == i {
                        return Some((pole, 0));
                    }
                    Corner { ring: number, column: per_sector - 1, per_sector, len: ring.len, start: ring.start }
                }
            };
            let Pixel { ring, column, .. } = east_of.pixel(sector);
            Some((ring, column))
        })
    }

    /// The geometry of a stencil, in a frame turned about the pole so that the cell's vertex lies at φ = 0.
    pub fn geometry(&self, stencil: &Stencil) -> Geometry {
        let mut geometry = Geometry { count: stencil.count, ..Geometry::default() };
        for (c, corner) in stencil.corners.iter().enumerate() {
            let ring = self.near[corner.ring + SAME - self.near[SAME].number].ring;
            let (sin_phi, cos_phi) = if self.sectors == 1 {
                // A pole's cell: its corners are the quarter turns of one another, to the last bit.
                let half = std::f64::consts::FRAC_1_SQRT_2;
                [(half, half), (half, -half), (-half, -half), (-half, half)][corner.column]
            } else {
                (ring.phi(corner.column as isize) - stencil.meridian).sin_cos()
            };
            let (sin, cos) = (ring.sin_theta, ring.cos_theta);
            let at = [sin * cos_phi, sin * sin_phi, cos];
            geometry.corner[c] = at.into();
            for (component, value) in geometry.frames.at.iter_mut().zip(at) {
                component[c] = value;
            }
            for (component, value) in geometry.frames.south.iter_mut().zip([cos * cos_phi, cos * sin_phi, -sin]) {
                component[c] = value;
            }
            for (component, value) in geometry.frames.east.iter_mut().zip([-sin_phi, cos_phi]) {
                component[c] = value;
            }
        }
        for c in 0..stencil.count {
            let (a, b) = (geometry.corner[c], geometry.corner[(c + 1) % stencil.count]);
            let chord_sq = (b - a).length_squared();
            let cos_arc = 1.0 - chord_sq / 2.0;
            let sin_arc = (chord_sq * (1.0 - chord_sq / 4.0)).sqrt();
            geometry.arc[c] = angles::from_sin_cos(sin_arc, cos_arc);
            geometry.along[c] = [(b - a * cos_arc) * (1.0 / sin_arc), (b * cos_arc - a) * (1.0 / sin_arc)];
        }
        geometry
    }
}

/// The corners of a cell as unit vectors x, y, z and the tangent frames there; each component for all corners.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    /// Unit vectors.
    pub at: [[f64; 4]; 3],
    /// e_θ.
    pub south: [[f64; 4]; 3],
    /// e_φ; its z component is 0.
    pub east: [[f64; 4]; 2],
}

/// Where a cell's corners lie, in a frame turned about the pole.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Number of corners.
    pub count: usize,
    /// Unit vectors of the corners.
    pub corner: [DVec3; 4],
    /// The corners and their frames, component by component.
    pub frames: Frames,
    /// Unit tangents along each edge, from its first corner to the next: at that corner, and at the next.
    along: [[DVec3; 2]; 4],
    /// Length of that edge in radians.
    arc: [f64; 4],
}

impl Geometry {
    /// The point of an edge at a fraction, at most one half, of its length from its first corner, or with `from_end`
    /// from the next.
    #[inline(always)]
    pub(crate) fn point(&self, edge: usize, from_end: bool, fraction: f64) -> Point {
        let corner = self.corner[if from_end { self.next(edge) } else { edge }];
        let along = self.along[edge][usize::from(from_end)];
        let (sin, versine) = angles::sin_versine(fraction * self.arc[edge]);
        let offset = along * if from_end { -sin } else { sin } - corner * versine;
        Point { at: corner + offset, corner, offset }
    }

    /// The corner after this one, which is also the end of this edge.
    #[inline(always)]
    pub(crate) fn next(&self, corner: usize) -> usize {
        if corner + 1 == self.count { 0 } else { corner + 1 }
    }

    /// Unit normal of the edge's great circle, pointing into the cell.
    pub fn inward(&self, edge: usize) -> DVec3 {
        self.corner[edge].cross(self.along[edge][0])
    }

    /// Directions of the edge at its first corner and at the next, as (cos ϕ, sin ϕ) with ϕ counted from south towards
    /// east. Transport along the edge takes the one to the other.
    #[inline]
    pub(crate) fn directions(&self, edge: usize) -> [(f64, f64); 2] {
        let corners = [edge, self.next(edge)];
        std::array::from_fn(|end| {
            let (c, along, frames) = (corners[end], self.along[edge][end], &self.frames);
            let south = along.x * frames.south[0][c] + along.y * frames.south[1][c] + along.z * frames.south[2][c];
            (south, along.x * frames.east[0][c] + along.y * frames.east[1][c])
        })
    }

    /// Area of the cell in steradian.
    pub fn area(&self) -> f64 {
        let [a, b, c, d] = self.corner;
        area_of_triangle(a, b, c) + if self.count == 4 { area_of_triangle(a, c, d) } else { 0.0 }
    }
}

/// Area in steradian of the geodesic triangle, positive if its corners run counter-clockwise seen from outside
/// (Van Oosterom & Strackee 1983; the sum of angles minus π would cancel).
#[inline]
pub fn area_of_triangle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// A point near a corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// The unit vector.
    pub(crate) at: DVec3,
    corner: DVec3,
    /// From the corner to the point: what remains exact when the two nearly coincide.
    offset: DVec3,
}

impl Point {
    /// The vector from another point of the cell to this one, without cancellation where both are near one corner.
    #[inline(always)]
    pub(crate) fn minus(&self, other: &Point) -> DVec3 {
        (self.corner - other.corner) + (self.offset - other.offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every cell of a grid: its pixels and its area.
    fn all_cells(nside: usize) -> Vec<(Vec<usize>, f64)> {
        let grid = Healpix::new(nside).unwrap();
        (0..=4 * nside)
            .flat_map(|i| {
                let ring = CellRing::new(grid, i);
                (0..ring.stencils).flat_map(move |k| {
                    let stencil = ring.stencil(k);
                    let area = ring.geometry(&stencil).area();
                    (0..ring.sectors).map(move |s| {
                        (stencil.pixels(s)[..stencil.count()].iter().map(|p| p.index).collect::<Vec<_>>(), area)
                    })
                })
            })
            .collect()
    }

    #[test]
    fn an_octant_is_an_eighth_of_the_sphere() {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
        assert!((area_of_triangle(x, y, z) - PI / 2.0).abs() < 1e-15);
        assert!((area_of_triangle(x, z, y) + PI / 2.0).abs() < 1e-15);
    }

    #[test]
    fn cells_tile_the_sphere_and_each_pixel_has_four() {
        for nside in [1, 2, 3, 4, 5, 6, 7, 8, 16, 21] {
            let grid = Healpix::new(nside).unwrap();
            let cells = all_cells(nside);
            assert_eq!(cells.len(), grid.pixels() + 2);
            assert_eq!(cells.iter().filter(|c| c.0.len() == 3).count(), 8);
            let mut corners_of = vec![0; grid.pixels()];
            cells.iter().flat_map(|c| &c.0).for_each(|&p| corners_of[p] += 1);
            assert!(corners_of.iter().all(|&n| n == 4), "Nside {nside}");
            let total: f64 = cells.iter().map(|c| c.1).sum();
            assert!((total - 4.0 * PI).abs() < 1e-11, "Nside {nside}: {total}");
            assert!(cells.iter().all(|c| c.1 > 0.0), "Nside {nside}: a cell turned inside out");
        }
    }

    #[test]
    fn the_cell_beyond_an_edge_has_that_edge_too() {
        for nside in [1, 2, 3, 4, 5, 8, 21] {
            let grid = Healpix::new(nside).unwrap();
            let edges_of = |(i, column): (usize, usize)| {
                let ring = CellRing::new(grid, i);
                let (sector, k) = (column / ring.stencils, column % ring.stencils);
                let stencil = ring.stencil(k);
                let n = stencil.count();
                let pixels = stencil.pixels(sector).map(|p| p.index);
                let beyond = ring.beyond(&stencil, sector);
                assert_eq!(beyond.iter().flatten().count(), n);
                (0..n).map(|e| ([pixels[e], pixels[(e + 1) % n]], beyond[e].unwrap())).collect::<Vec<_>>()
            };
            for i in 0..=4 * nside {
                let cells = if i % (4 * nside) == 0 { 1 } else { grid.ring(i).len };
                for cell in (0..cells).map(|column| (i, column)) {
                    for ([from, to], beyond) in edges_of(cell) {
                        let back = edges_of(beyond).into_iter().find(|(edge, _)| *edge == [to, from]);
                        assert_eq!(back.map(|b| b.1), Some(cell), "Nside {nside}: {cell:?}, edge {from}, {to}");
                    }
                }
            }
        }
    }

    #[test]
    fn corners_are_the_neighbours_that_cdshealpix_names() {
        use cdshealpix::compass_point::MainWind::{E, NE, SE};
        for depth in 0..6 {
            let layer = cdshealpix::nested::get(depth);
            let nside = 1 << depth;
            let ours: std::collections::HashSet<Vec<usize>> = all_cells(nside)
                .into_iter()
                .map(|(mut p, _)| {
                    p.sort_unstable();
                    p
                })
                .collect();
            for p in 0..12 * (nside as u64) * (nside as u64) {
                let neighbours = layer.neighbours(p, false);
                let mut cell = vec![layer.to_ring(p) as usize];
                cell.extend([NE, E, SE].iter().filter_map(|&w| neighbours.get(w)).map(|&h| layer.to_ring(h) as usize));
                cell.sort_unstable();
                assert!(ours.contains(&cell), "Nside {nside}: no cell {cell:?}");
            }
        }
    }
}
