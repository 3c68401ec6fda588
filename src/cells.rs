//! The dual grid: one cell around every vertex of the HEALPix grid, with pixel centres as its corners.
//!
//! A grid of Npix pixels has Npix + 2 cells: one at the east vertex of each pixel, and the two poles. A cell has four
//! corners, or three at the eight vertices where three base pixels meet. Its edges are geodesics, so the cells tile
//! the sphere. Each pixel is a corner of exactly four cells.
//!
//! Everything follows from RING order in closed form, for any Nside and without neighbour tables. A ring repeats
//! itself: `sectors` times the same cells, turned about the pole (four times in the polar caps, once a pixel in the
//! equatorial belt). So a [`Stencil`], the corners and the geometry of one cell in the first sector, serves all.
//! What is done with cells is left to [`crate::contour`].

use std::f64::consts::PI;

use glam::{DVec3, dvec3};
use longan_formats::Healpix;

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
    #[inline]
    pub fn pixels(&self, sector: usize) -> [Pixel; 4] {
        self.corners.map(|c| {
            let mut column = c.column + sector * c.per_sector;
            if column >= c.len {
                column -= c.len;
            }
            Pixel { ring: c.ring, column, index: c.start + column }
        })
    }
}

/// The cells of one ring: `stencils` different ones, each repeated in `sectors` sectors.
///
/// Ring 0 is the north pole's cell, ring 4 Nside the south pole's; ring i between them holds the cells east of
/// the pixels of ring i, in their order.
#[derive(Clone, Copy, Debug)]
pub struct CellRing {
    grid: Healpix,
    ring: usize,
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
        CellRing { grid, ring, stencils, sectors, uniform: stencils == 1 }
    }

    /// The `k`-th stencil of the ring, `0..self.stencils`.
    pub fn stencil(&self, k: usize) -> Stencil {
        let (n, i) = (self.grid.nside(), self.ring);
        let corner = |ring: usize, column: usize| {
            let r = self.grid.ring(ring);
            Corner { ring, column, per_sector: r.len / self.sectors, len: r.len, start: r.start }
        };
        if i == 0 || i == 4 * n {
            let ring = if i == 0 { 1 } else { 4 * n - 1 };
            let column = |c: usize| if i == 0 { c } else { 3 - c };
            return Stencil { corners: [0, 1, 2, 3].map(|c| corner(ring, column(c))), count: 4, meridian: 0.0 };
        }
        let (west, east) = (corner(i, k), corner(i, k + 1));
        let north = |column| corner(i - 1, column);
        let south = |column| corner(i + 1, column);
        let last = k + 1 == self.stencils;
        let (corners, count) = if i > n && i < 3 * n {
            let column = usize::from(self.grid.ring(i).shifted);
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
        let ring = self.grid.ring(i);
        let meridian = (2 * k + 1 + usize::from(ring.shifted)) as f64 * (PI / ring.len as f64);
        Stencil { corners, count, meridian }
    }

    /// The geometry of a stencil, in a frame turned about the pole so that the cell's vertex lies at φ = 0.
    pub fn geometry(&self, stencil: &Stencil) -> Geometry {
        let mut geometry = Geometry { count: stencil.count, ..Geometry::default() };
        for (c, corner) in stencil.corners.iter().enumerate() {
            let ring = self.grid.ring(corner.ring);
            let (sin_phi, cos_phi) = (ring.phi(corner.column as isize) - stencil.meridian).sin_cos();
            let (sin, cos) = (ring.sin_theta, ring.cos_theta);
            geometry.corner[c] = dvec3(sin * cos_phi, sin * sin_phi, cos);
            geometry.south[c] = dvec3(cos * cos_phi, cos * sin_phi, -sin);
            geometry.east[c] = dvec3(-sin_phi, cos_phi, 0.0);
        }
        for c in 0..stencil.count {
            let (a, b) = (geometry.corner[c], geometry.corner[(c + 1) % stencil.count]);
            let chord_sq = (b - a).length_squared();
            let cos_arc = 1.0 - chord_sq / 2.0;
            let sin_arc = (chord_sq * (1.0 - chord_sq / 4.0)).sqrt();
            geometry.arc[c] = 2.0 * (chord_sq.sqrt() / 2.0).asin();
            geometry.along[c] = (b - a * cos_arc) * (1.0 / sin_arc);
        }
        geometry
    }
}

/// Where a cell's corners lie, in a frame turned about the pole.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Number of corners.
    pub count: usize,
    /// Unit vectors of the corners.
    pub corner: [DVec3; 4],
    /// e_θ at each corner.
    pub south: [DVec3; 4],
    /// e_φ at each corner.
    pub east: [DVec3; 4],
    /// Unit tangent at each corner along the edge to the next.
    pub along: [DVec3; 4],
    /// Length of that edge in radians.
    pub arc: [f64; 4],
}

impl Geometry {
    /// The point at this fraction of the edge from corner `edge` to the next.
    #[inline]
    pub fn point(&self, edge: usize, fraction: f64) -> DVec3 {
        let (sin, cos) = (fraction * self.arc[edge]).sin_cos();
        self.corner[edge] * cos + self.along[edge] * sin
    }

    /// Unit normal of the edge's great circle, pointing into the cell.
    pub fn inward(&self, edge: usize) -> DVec3 {
        self.corner[edge].cross(self.along[edge])
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

/// How many triangular cells the pixels `columns` of a ring are corners of, counted once for each such pixel.
///
/// A pixel's four cells give it 4 · 1/4 of a cell, or 1/12 more for each triangle among them.
pub fn triangles(grid: Healpix, ring: usize, columns: impl Iterator<Item = usize> + Clone) -> usize {
    let n = grid.nside();
    let at = |remainder: usize| columns.clone().filter(|c| c % n == remainder).count();
    let mut count = 0;
    if ring == n || ring == 3 * n {
        count += at(0) + at(n - 1);
    }
    if ring == n + 1 {
        count += at(0);
    }
    if ring == 3 * n - 1 {
        count += at(0);
    }
    count
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

    #[test]
    fn triangles_are_counted_where_they_are() {
        for nside in [1, 2, 3, 8] {
            let grid = Healpix::new(nside).unwrap();
            let mut of_pixel = vec![0; grid.pixels()];
            all_cells(nside).iter().filter(|c| c.0.len() == 3).flat_map(|c| &c.0).for_each(|&p| of_pixel[p] += 1);
            for i in 1..=grid.rings() {
                let ring = grid.ring(i);
                for j in 0..ring.len {
                    assert_eq!(triangles(grid, i, j..j + 1), of_pixel[ring.start + j], "Nside {nside}, ring {i}, {j}");
                }
            }
        }
    }
}
