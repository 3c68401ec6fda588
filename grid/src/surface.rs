//! Values at the vertices of a surface of triangles, seen from a centre.
//!
//! A pixel's value is that of the surface where the ray from the centre through the pixel's centre crosses it. Whether
//! a ray crosses a triangle is decided exactly: the signs of determinants are those of exact arithmetic, and a ray
//! through an edge or a vertex counts as moved aside a little, always in the same direction, so that it crosses one of
//! the triangles there (simulation of simplicity, Edelsbrunner & Mücke 1990, ACM Trans. Graph. 9, 66). Where surfaces
//! come from is left to others.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use ndarray::{ArrayView1, ArrayView2};
use robust::{Coord3D, orient3d};
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use crate::directions::{self, Direction, chart, dot, from_centre, mean, places, spacing};
use crate::healpix::closest_nside;
use crate::points::check_lengths;
use crate::{Error, Healpix, Map, Percent, Regrid};

/// Boxes are wider than their triangles by this, which is above what rounding can move a direction.
const MARGIN: f64 = 1e-12;

/// A triangulated surface with values at its vertices.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// Positions of the vertices.
    pub vertices: Vec<[f64; 3]>,
    /// The value at each vertex, NaN where it has none.
    pub values: Vec<f64>,
    /// Numbers of each triangle's vertices, from 0.
    pub triangles: Vec<[usize; 3]>,
}

/// How a surface is seen from the mean of its vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSummary {
    /// The point that it is seen from unless one is given.
    pub centre: [f64; 3],
    /// The Nside that is used unless one is given.
    pub nside: usize,
    /// The share of the sphere in which it is seen from there.
    pub covered: f64,
    /// The share of the sphere in which it is seen more than once.
    pub folded: f64,
}

/// The vertices of a surface as they are seen from a centre.
struct View {
    /// The centre.
    centre: [f64; 3],
    /// Directions to the vertices.
    directions: Vec<Direction>,
    /// Distances to the vertices.
    distances: Vec<f64>,
    /// Whether each vertex is in a triangle. The others play no part.
    used: Vec<bool>,
}

/// A triangle's number with a box around all directions in which it is seen.
type Boxed = GeomWithData<Rectangle<Direction>, usize>;

impl Surface {
    /// A surface of arrays: a row x, y, z for each vertex, a row of three numbers of vertices, from 0, for each triangle,
    /// and a value, or NaN, for each vertex.
    ///
    /// # Errors
    /// [`Error::Columns`] or [`Error::Lengths`] where the arrays do not go together, [`Error::Vertex`] for a vertex that is
    /// not there, [`Error::Setting`] for a position out of range.
    pub fn new(
        vertices: ArrayView2<'_, f64>,
        triangles: ArrayView2<'_, usize>,
        values: ArrayView1<'_, f64>,
    ) -> Result<Self, Error> {
        let vertices = directions::positions("vertices", vertices)?;
        check_lengths("vertices", vertices.len(), "values", values.len())?;
        if triangles.ncols() != 3 {
            return Err(Error::Columns { name: "triangles", found: triangles.ncols() });
        }
        let triangle = |(triangle, row): (usize, ArrayView1<'_, usize>)| {
            let corners = [row[0], row[1], row[2]];
            match corners.into_iter().find(|&vertex| vertex >= vertices.len()) {
                Some(vertex) => Err(Error::Vertex { triangle, vertex, vertices: vertices.len() }),
                None => Ok(corners),
            }
        };
        let triangles = triangles.rows().into_iter().enumerate().map(triangle).collect::<Result<_, _>>()?;
        Ok(Surface { vertices, values: values.to_vec(), triangles })
    }

    /// How the surface is seen from the mean of its vertices.
    ///
    /// # Errors
    /// [`Error::AtCentre`], [`Error::OnePlace`], or [`Error::Memory`].
    pub fn summary(&self) -> Result<SurfaceSummary, Error> {
        let view = self.view(None)?;
        let grid = view.grid(None)?;
        let seen = self.seen(&view, grid)?;
        let share = |pixels: usize| pixels as f64 / grid.pixels() as f64;
        Ok(SurfaceSummary {
            centre: view.centre,
            nside: grid.nside(),
            covered: 1.0 - share(seen.never),
            folded: share(seen.several),
        })
    }

    /// Makes a map of the values, which are linear within each triangle. A pixel in a triangle that has a vertex without
    /// a value is masked.
    ///
    /// The Nside is that of the pixels closest to the typical distance between vertices unless given, the centre the
    /// mean of the vertices. Vertices in no triangle play no part.
    ///
    /// # Errors
    /// [`Error::Crossings`] unless each pixel's ray crosses the surface once, or folds are allowed.
    pub fn regrid(&self, nside: Option<usize>, regrid: &Regrid) -> Result<Map, Error> {
        let view = self.view(regrid.centre)?;
        let grid = view.grid(nside)?;
        let Seen { map, never, several } = self.seen(&view, grid)?;
        if regrid.allow_folds || never + several == 0 {
            return Ok(map);
        }
        let percent = |pixels| Percent { pixels, of: grid.pixels() };
        Err(Error::Crossings { never: percent(never), several: percent(several) })
    }

    /// The grid that [`regrid`](Self::regrid) would make a map on, and the centre that the surface would be seen from.
    ///
    /// # Errors
    /// [`Error::AtCentre`] or [`Error::OnePlace`].
    pub fn grid_and_centre(&self, nside: Option<usize>, regrid: &Regrid) -> Result<(Healpix, [f64; 3]), Error> {
        let view = self.view(regrid.centre)?;
        Ok((view.grid(nside)?, view.centre))
    }

    /// The view from a centre, the mean of the vertices unless given.
    fn view(&self, centre: Option<[f64; 3]>) -> Result<View, Error> {
        let mut used = vec![false; self.vertices.len()];
        self.triangles.iter().flatten().for_each(|&vertex| used[vertex] = true);
        let corners: Vec<_> = self.vertices.iter().zip(&used).filter(|(_, used)| **used).map(|(v, _)| *v).collect();
        let centre = directions::centre(centre, corners.into_iter())?;
        let mut view = View { centre, directions: Vec::new(), distances: Vec::new(), used };
        for (i, (&vertex, &used)) in self.vertices.iter().zip(&view.used).enumerate() {
            let (direction, distance) = match from_centre(vertex, centre) {
                Some(seen) => seen,
                None if used => return Err(Error::AtCentre { place: format!("vertex {i} (from 0)") }),
                None => ([0.0; 3], 0.0),
            };
            view.directions.push(direction);
            view.distances.push(distance);
        }
        Ok(view)
    }

    /// The outermost layer at each pixel.
    fn seen(&self, view: &View, grid: Healpix) -> Result<Seen, Error> {
        let boxed = |(i, triangle): (usize, &[usize; 3])| Boxed::new(view.rectangle(*triangle), i);
        let tree = RTree::bulk_load(self.triangles.iter().enumerate().map(boxed).collect());
        let (never, several) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let map = chart(grid, |_, direction| {
            let candidates = tree.locate_in_envelope_intersecting(AABB::from_point(direction));
            let mut crossings = 0;
            let mut outermost = (f64::INFINITY, usize::MAX, f64::NAN);
            for triangle in candidates.map(|boxed| boxed.data) {
                let vertices = self.triangles[triangle];
                let Some((nearness, weights)) = view.crossing(vertices, direction) else { continue };
                crossings += 1;
                // Of triangles that lie upon each other the first.
                if (nearness, triangle) < (outermost.0, outermost.1) {
                    let values = vertices.map(|vertex| self.values[vertex]);
                    outermost = (nearness, triangle, dot(weights, values) / nearness);
                }
            }
            match crossings {
                0 => never.fetch_add(1, Relaxed),
                1 => 0,
                _ => several.fetch_add(1, Relaxed),
            };
            outermost.2
        })?;
        Ok(Seen { map, never: never.into_inner(), several: several.into_inner() })
    }
}

/// A surface at the pixels of a grid.
struct Seen {
    /// The values of its outermost layer.
    map: Map,
    /// Number of pixels without a layer.
    never: usize,
    /// Number of pixels with more than one layer.
    several: usize,
}

impl View {
    /// The grid of an Nside, or of the pixels closest to the typical distance between vertices.
    fn grid(&self, nside: Option<usize>) -> Result<Healpix, Error> {
        let used = self.directions.iter().zip(&self.used).filter(|(_, used)| **used).map(|(d, _)| *d);
        let closest = || spacing(&places(used)).map(closest_nside).ok_or(Error::OnePlace);
        Healpix::new(nside.map_or_else(closest, Ok)?)
    }

    /// Where a ray crosses a triangle: the inverse of the distance, and the weights of the vertices, whose sum it is.
    fn crossing(&self, vertices: [usize; 3], ray: Direction) -> Option<(f64, [f64; 3])> {
        let [a, b, c] = vertices.map(|vertex| self.directions[vertex]);
        let whole = determinant(a, b, c);
        // Behind the centre, all three are on the other side.
        let inside = |side: &Side| side.sign * whole > 0.0;
        let opposite_a = Some(Side::of(b, c, ray)).filter(inside)?;
        let opposite_b = Some(Side::of(c, a, ray)).filter(inside)?;
        let opposite_c = Some(Side::of(a, b, ray)).filter(inside)?;
        // The ray as a sum of directions to the vertices, and so of their positions.
        let parts = [opposite_a, opposite_b, opposite_c].map(|side| side.determinant / whole);
        let weights: [f64; 3] = std::array::from_fn(|i| parts[i] / self.distances[vertices[i]]);
        Some((weights.iter().sum(), weights))
    }

    /// A box around all directions in which a triangle is seen.
    fn rectangle(&self, vertices: [usize; 3]) -> Rectangle<Direction> {
        let corners = vertices.map(|vertex| self.directions[vertex]);
        let middle = from_centre(mean(corners.into_iter()), [0.0; 3]).map_or([0.0; 3], |(middle, _)| middle);
        let squared = |corner: Direction| (0..3).map(|i| (corner[i] - middle[i]).powi(2)).sum::<f64>();
        let radius = corners.into_iter().map(squared).fold(0.0, f64::max).sqrt() + MARGIN;
        // The disc about the middle with all corners holds the triangle if it is less than a hemisphere.
        if middle == [0.0; 3] || radius >= 1.4 {
            return Rectangle::from_corners([-1.0 - MARGIN; 3], [1.0 + MARGIN; 3]);
        }
        Rectangle::from_corners(middle.map(|m| m - radius), middle.map(|m| m + radius))
    }
}

/// Where a ray passes the plane through the centre and an edge.
#[derive(Clone, Copy)]
struct Side {
    /// The determinant of the edge's directions and the ray.
    determinant: f64,
    /// Its sign, 1 or −1; for a ray in the plane that of the ray moved aside; 0 where the edge makes no plane.
    sign: f64,
}

impl Side {
    fn of(from: Direction, to: Direction, ray: Direction) -> Self {
        let found = determinant(from, to, ray);
        // Moved aside by ever smaller steps along the axes.
        let aside = || [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| determinant(from, to, axis));
        let first = if found != 0.0 { found } else { aside().into_iter().find(|&d| d != 0.0).unwrap_or(0.0) };
        Side { determinant: found, sign: if first == 0.0 { 0.0 } else { first.signum() } }
    }
}

/// The determinant of three directions, with the sign that exact arithmetic gives it.
fn determinant(a: Direction, b: Direction, c: Direction) -> f64 {
    let point = |[x, y, z]: Direction| Coord3D { x, y, z };
    orient3d(point(a), point(b), point(c), point([0.0; 3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An octahedron each of whose triangles is cut into four, several times.
    fn sphere(levels: usize) -> Surface {
        let mut vertices: Vec<[f64; 3]> = Vec::new();
        let mut number = |v: [f64; 3]| {
            vertices.iter().position(|w| *w == v).unwrap_or_else(|| {
                vertices.push(v);
                vertices.len() - 1
            })
        };
        let mut triangles = Vec::new();
        for sign in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            for z in [1.0, -1.0] {
                triangles.push([[sign[0], 0.0, 0.0], [0.0, sign[1], 0.0], [0.0, 0.0, z]]);
            }
        }
        for _ in 0..levels {
            let middle = |a: [f64; 3], b: [f64; 3]| {
                let sum: [f64; 3] = std::array::from_fn(|i| a[i] + b[i]);
                sum.map(|c| c / dot(sum, sum).sqrt())
            };
            triangles = triangles
                .into_iter()
                .flat_map(|[a, b, c]| {
                    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                    [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
                })
                .collect();
        }
        let triangles: Vec<[usize; 3]> = triangles.into_iter().map(|t| t.map(&mut number)).collect();
        Surface { values: vec![1.0; vertices.len()], vertices, triangles }
    }

    /// How many triangles a ray crosses.
    fn crossings(surface: &Surface, view: &View, ray: Direction) -> usize {
        surface.triangles.iter().filter(|&&triangle| view.crossing(triangle, ray).is_some()).count()
    }

    #[test]
    fn rays_through_vertices_and_edges_cross_once() {
        for (centre, turned) in [([0.0; 3], false), ([0.1, -0.2, 0.05], false), ([0.0; 3], true)] {
            let mut surface = sphere(3);
            if turned {
                for [x, y, z] in &mut surface.vertices {
                    (*x, *y, *z) = (0.6 * *x - 0.8 * *y, 0.8 * *x + 0.6 * *y, *z * 0.3);
                }
            }
            let view = surface.view(Some(centre)).unwrap();
            let mut rays = view.directions.clone();
            for &[a, b, c] in &surface.triangles {
                let [a, b, c] = [a, b, c].map(|vertex| view.directions[vertex]);
                let between = |sum: [f64; 3]| from_centre(sum, [0.0; 3]).unwrap().0;
                rays.push(between(std::array::from_fn(|i| a[i] + b[i])));
                rays.push(between(std::array::from_fn(|i| a[i] + b[i] + c[i])));
                // As close to a vertex as there are numbers.
                rays.push(between(std::array::from_fn(|i| a[i] + 1e-16 * b[i])));
                rays.push(between(std::array::from_fn(|i| a[i] * (1.0 + f64::EPSILON) + 1e-17 * c[i])));
            }
            assert!(rays.len() > 2000);
            for ray in rays {
                assert_eq!(crossings(&surface, &view, ray), 1, "{ray:?}");
            }
        }
    }

    #[test]
    fn boxes_hold_the_triangles_that_rays_cross() {
        for levels in [0, 1, 3] {
            let surface = sphere(levels);
            for centre in [[0.0; 3], [0.3, 0.3, -0.3]] {
                let view = surface.view(Some(centre)).unwrap();
                let grid = Healpix::new(8).unwrap();
                chart(grid, |_, ray| {
                    for &triangle in &surface.triangles {
                        if view.crossing(triangle, ray).is_some() {
                            let (lower, upper) = (view.rectangle(triangle).lower(), view.rectangle(triangle).upper());
                            assert!((0..3).all(|i| lower[i] <= ray[i] && ray[i] <= upper[i]));
                        }
                    }
                    assert_eq!(crossings(&surface, &view, ray), 1);
                    0.0
                })
                .unwrap();
            }
        }
    }

    #[test]
    fn triangles_without_area_are_not_crossed() {
        let vertices = vec![[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]];
        let surface =
            Surface { values: vec![0.0; 5], vertices, triangles: vec![[0, 1, 2], [0, 0, 2], [0, 2, 3], [0, 4, 2]] };
        let view = surface.view(Some([0.0; 3])).unwrap();
        for &ray in view.directions.iter().chain(&[[0.0, 0.0, 1.0], [0.6, 0.8, 0.0]]) {
            assert_eq!(crossings(&surface, &view, ray), 0);
        }
    }
}
