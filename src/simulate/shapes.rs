//! Bodies of simple shapes, the test images of Collischon et al. (2024), "Morphometry on the sphere".
//!
//! A polygon's sides are great circles. It is laid out in the tangent plane at its centre (gnomonic projection, in which
//! they are straight), with its base along the local parallel and then turned by its position angle.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, dvec3};
use longan_grid::{Healpix, Map, directions};

use super::Error;

/// Distance in radians below which a point counts as on the boundary.
const ON_BOUNDARY: f64 = 1e-12;

/// What a body looks like, and what its *size* means.
///
/// Widths are angles along the great circles through the centre, base and height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A square; size is its width.
    Square,
    /// A rectangle twice as wide as it is high; size is its width, the longer one.
    Rectangle2,
    /// A rectangle three times as wide as it is high; size is its width, the longer one.
    Rectangle3,
    /// Two crossed 3:1 rectangles; size is the span from one arm's end to the opposite one's.
    Cross,
    /// An equilateral triangle with one corner to the north; size is the length of a side.
    Triangle,
    /// A parallelogram half as high as it is wide, leaning east by 45°; size is its width.
    Parallelogram,
    /// A geodesic disc; size is its diameter.
    Cap,
}

impl Shape {
    /// Every shape.
    pub const ALL: [Shape; 7] = [
        Shape::Square,
        Shape::Rectangle2,
        Shape::Rectangle3,
        Shape::Cross,
        Shape::Triangle,
        Shape::Parallelogram,
        Shape::Cap,
    ];

    /// The name as typed on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Shape::Square => "square",
            Shape::Rectangle2 => "rectangle-2-1",
            Shape::Rectangle3 => "rectangle-3-1",
            Shape::Cross => "cross",
            Shape::Triangle => "triangle",
            Shape::Parallelogram => "parallelogram",
            Shape::Cap => "cap",
        }
    }

    /// The corners in the tangent plane (east, north) in cyclic order; none for the cap. `half` is half the size.
    fn corners(self, half: f64) -> Vec<[f64; 2]> {
        let rectangle = |x: f64, y: f64| vec![[x, y], [-x, y], [-x, -y], [x, -y]];
        let (a, b) = (half.tan(), (half / 3.0).tan());
        match self {
            Shape::Square => rectangle(a, a),
            Shape::Rectangle2 => rectangle(a, (half / 2.0).tan()),
            Shape::Rectangle3 => rectangle(a, b),
            Shape::Cross => {
                let arm = [[a, b], [b, b], [b, a]];
                let quarter = |[x, y]: [f64; 2], turns: usize| (0..turns).fold([x, y], |[x, y], _| [-y, x]);
                (0..4).flat_map(|turns| arm.map(|corner| quarter(corner, turns))).collect()
            }
            Shape::Triangle => {
                // Half the side and the circumradius are two sides of a right triangle with the angle π/3.
                let r = (half.sin() / (PI / 3.0).sin()).asin().tan();
                let corner = |third: f64| [-r * (third * 2.0 * PI / 3.0).sin(), r * (third * 2.0 * PI / 3.0).cos()];
                vec![corner(0.0), corner(1.0), corner(2.0)]
            }
            Shape::Parallelogram => {
                let y = (half / 2.0).tan();
                vec![[a + y, y], [-a + y, y], [-a - y, -y], [a - y, -y]]
            }
            Shape::Cap => Vec::new(),
        }
    }
}

impl std::fmt::Display for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for Shape {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        Shape::ALL
            .into_iter()
            .find(|shape| shape.name() == name)
            .ok_or_else(|| Error::UnknownShape { name: name.to_owned() })
    }
}

/// What a map of bodies says near their boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// 1 where the pixel's centre is in a body or on its boundary, else 0: contours at 0.5 follow the pixels' staircase.
    Binary,
    /// The signed distance in degrees: contours at 0 are the boundary itself.
    Smooth,
}

/// A body on the sphere.
#[derive(Clone, Debug)]
pub struct Body {
    /// Half the size.
    half: f64,
    /// Centre, then base and height directions of its tangent plane.
    frame: [DVec3; 3],
    /// Corners in the tangent plane, for telling inside from outside; empty for a cap.
    corners: Vec<[f64; 2]>,
    sides: Vec<Side>,
}

/// A side of a polygon: an arc of a great circle, shorter than π.
#[derive(Clone, Debug)]
struct Side {
    start: DVec3,
    /// Unit normal of the great circle.
    normal: DVec3,
    /// Tangents at start and end that point along the arc; between them lie the points next to the side's interior.
    towards: [DVec3; 2],
}

impl Body {
    /// A body from its centre, its size (see [`Shape`]) and the position angle by which its height is turned from north
    /// towards east, all in degrees.
    ///
    /// # Errors
    /// [`Error::Centre`], [`Error::Size`] or [`Error::PositionAngle`] for values out of range.
    pub fn new(shape: Shape, lon: f64, lat: f64, size: f64, position_angle: f64) -> Result<Self, Error> {
        if !(lon.is_finite() && lat.abs() <= 90.0) {
            return Err(Error::Centre { lon, lat });
        }
        if !(size > 0.0 && size <= 90.0) {
            return Err(Error::Size { degrees: size });
        }
        if !position_angle.is_finite() {
            return Err(Error::PositionAngle { degrees: position_angle });
        }
        let half = size.to_radians() / 2.0;
        let (lon, lat) = (lon.to_radians(), lat.to_radians());
        let (sin, cos) = position_angle.to_radians().sin_cos();
        let centre = unit_vector(FRAC_PI_2 - lat, lon);
        let (east, north) = (dvec3(-lon.sin(), lon.cos(), 0.0), unit_vector(-lat, lon));
        let base = cos * east - sin * north;
        let height = sin * east + cos * north;
        let corners = shape.corners(half);
        let points: Vec<DVec3> = corners.iter().map(|&[x, y]| (centre + x * base + y * height).normalize()).collect();
        let sides = (0..points.len()).map(|i| Side::between(points[i], points[(i + 1) % points.len()])).collect();
        Ok(Body { half, frame: [centre, base, height], corners, sides })
    }

    /// Distance in radians of a point (colatitude and longitude in radians) from the body's boundary: positive inside,
    /// negative outside.
    pub fn signed_distance(&self, theta: f64, phi: f64) -> f64 {
        self.signed_distance_of(unit_vector(theta, phi))
    }

    fn signed_distance_of(&self, point: DVec3) -> f64 {
        let [centre, base, height] = self.frame;
        if self.sides.is_empty() {
            return self.half - point.cross(centre).length().atan2(point.dot(centre));
        }
        let chord2 = self.sides.iter().map(|side| side.chord2(point)).fold(f64::INFINITY, f64::min);
        let distance = 2.0 * (chord2.sqrt() / 2.0).min(1.0).asin();
        let depth = point.dot(centre);
        let inside = depth > 0.0 && self.encloses(point.dot(base) / depth, point.dot(height) / depth);
        if inside { distance } else { -distance }
    }

    /// Whether a point of the tangent plane is inside: a ray from it to the east crosses an odd number of sides.
    fn encloses(&self, x: f64, y: f64) -> bool {
        let crossed = |i: usize| {
            let ([ax, ay], [bx, by]) = (self.corners[i], self.corners[(i + 1) % self.corners.len()]);
            (ay > y) != (by > y) && x < ax + (bx - ax) * (y - ay) / (by - ay)
        };
        (0..self.corners.len()).filter(|&i| crossed(i)).count() % 2 == 1
    }
}

impl Side {
    fn between(start: DVec3, end: DVec3) -> Self {
        let normal = start.cross(end).normalize();
        Side { start, normal, towards: [normal.cross(start), normal.cross(end)] }
    }

    /// Squared chord to the nearest point of the side other than its end, which is the next side's start.
    fn chord2(&self, point: DVec3) -> f64 {
        if point.dot(self.towards[0]) >= 0.0 && point.dot(self.towards[1]) <= 0.0 {
            // The distance d from the great circle has sin d = |point · normal|; the chord is 2 sin(d/2).
            let sin2 = point.dot(self.normal).powi(2);
            2.0 * sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt())
        } else {
            point.distance_squared(self.start)
        }
    }
}

/// A map of the union of bodies. Without any, a binary map is 0 and a smooth one −180 everywhere.
pub fn shapes(grid: Healpix, bodies: &[Body], edge: Edge) -> Map {
    let mut map = super::map("shapes", grid, |ring, values| {
        for (j, value) in values.iter_mut().enumerate() {
            let (sin, cos) = ring.phi(j as isize).sin_cos();
            let point = dvec3(ring.sin_theta * cos, ring.sin_theta * sin, ring.cos_theta);
            let distance = bodies.iter().map(|body| body.signed_distance_of(point)).fold(-PI, f64::max);
            *value = match edge {
                Edge::Binary => f64::from(distance >= -ON_BOUNDARY),
                Edge::Smooth => distance.to_degrees(),
            };
        }
    });
    map.unit = (edge == Edge::Smooth).then(|| "deg".to_owned());
    map
}

/// One body of every shape along the equator, 45° apart from longitude −135° on: a square of 4° and the others of 6°.
///
/// At multiples of 45° the pixel grid of Nside 2^n repeats itself, so all bodies meet it alike.
pub fn scene() -> Vec<Body> {
    let at = |(i, shape): (usize, Shape)| {
        let size = if shape == Shape::Square { 4.0 } else { 6.0 };
        Body::new(shape, 45.0 * i as f64 - 135.0, 0.0, size, 0.0).expect("a valid body")
    };
    Shape::ALL.into_iter().enumerate().map(at).collect()
}

fn unit_vector(theta: f64, phi: f64) -> DVec3 {
    DVec3::from_array(directions::at_colatitude(theta, phi))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Centre (longitude, latitude) and position angle in degrees.
    const PLACES: [[f64; 3]; 5] =
        [[0.0, 0.0, 0.0], [-100.0, 35.0, 20.0], [250.0, -88.0, 100.0], [77.0, 90.0, -45.0], [0.0, -90.0, 0.0]];

    fn body(shape: Shape, [lon, lat, angle]: [f64; 3], size: f64) -> Body {
        Body::new(shape, lon, lat, size, angle).unwrap()
    }

    fn everywhere() -> impl Iterator<Item = (Shape, [f64; 3])> {
        Shape::ALL.into_iter().flat_map(|shape| PLACES.map(|place| (shape, place)))
    }

    /// Points spread over the sphere.
    fn points() -> Vec<(f64, f64)> {
        let grid = Healpix::new(5).unwrap();
        (0..grid.pixels()).map(|p| grid.centre(p)).map(|(theta, phi)| (theta, phi + 0.01)).collect()
    }

    fn separation(a: DVec3, b: DVec3) -> f64 {
        a.cross(b).length().atan2(a.dot(b))
    }

    /// Points on a body's boundary, `steps` a side, equally spaced on each.
    fn boundary(body: &Body, steps: usize) -> Vec<DVec3> {
        if body.sides.is_empty() {
            let [centre, base, height] = body.frame;
            let around = |i: usize| {
                let (sin, cos) = (2.0 * PI * i as f64 / steps as f64).sin_cos();
                body.half.cos() * centre + body.half.sin() * (cos * base + sin * height)
            };
            return (0..steps).map(around).collect();
        }
        let n = body.sides.len();
        let along = |(i, side): (usize, &Side)| {
            let length = separation(side.start, body.sides[(i + 1) % n].start);
            let (start, tangent) = (side.start, side.towards[0]);
            (0..steps)
                .map(move |k| (length * k as f64 / steps as f64).sin_cos())
                .map(move |(sin, cos)| cos * start + sin * tangent)
        };
        body.sides.iter().enumerate().flat_map(along).collect()
    }

    fn rectangle_area(a: f64, b: f64) -> f64 {
        4.0 * ((a / 2.0).sin() * (b / 2.0).sin()).asin()
    }

    fn area(shape: Shape, size: f64) -> f64 {
        match shape {
            Shape::Square => rectangle_area(size, size),
            Shape::Rectangle2 => rectangle_area(size, size / 2.0),
            Shape::Rectangle3 => rectangle_area(size, size / 3.0),
            Shape::Cross => 2.0 * rectangle_area(size, size / 3.0) - rectangle_area(size / 3.0, size / 3.0),
            Shape::Triangle => 3.0 * (size.cos() / (1.0 + size.cos())).acos() - PI,
            Shape::Parallelogram => {
                // Two triangles, by L'Huilier's formula in vector form.
                let (x, y) = ((size / 2.0).tan(), (size / 4.0).tan());
                let corner = |x: f64, y: f64| dvec3(1.0, x, y).normalize();
                let [a, b, c] = [corner(x + y, y), corner(-x + y, y), corner(-x - y, -y)];
                4.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
            }
            Shape::Cap => 2.0 * PI * (1.0 - (size / 2.0).cos()),
        }
    }

    #[test]
    fn areas_are_those_of_closed_forms() {
        let grid = Healpix::new(128).unwrap();
        for (shape, place) in everywhere() {
            for size in [30.0, 90.0] {
                let map = shapes(grid, &[body(shape, place, size)], Edge::Smooth);
                // Pixels near the boundary count in part, over a width in which no ring of pixels matters.
                let inside: f64 = map.values().iter().map(|v| (0.5 + v).clamp(0.0, 1.0)).sum();
                let counted = 4.0 * PI * inside / grid.pixels() as f64;
                let expected = area(shape, f64::to_radians(size));
                assert!((counted / expected - 1.0).abs() < 2e-3, "{shape} {size} at {place:?}: {counted}, {expected}");
            }
        }
    }

    #[test]
    fn the_distance_is_the_shortest_to_the_boundary() {
        let steps = 3000;
        for (shape, place) in everywhere() {
            let body = body(shape, place, 40.0);
            let boundary = boundary(&body, steps);
            for &point in boundary.iter().step_by(101) {
                assert!(body.signed_distance_of(point).abs() < 1e-12, "{shape} at {place:?}");
            }
            // Samples are at most this far apart.
            let gap = 2.0 * PI * 20f64.to_radians() / steps as f64;
            for (theta, phi) in points() {
                let point = unit_vector(theta, phi);
                let distance = body.signed_distance(theta, phi);
                let nearest = boundary.iter().map(|&b| separation(b, point)).fold(PI, f64::min);
                assert!((0.0..gap).contains(&(nearest - distance.abs() + 1e-9)), "{shape} at {place:?}: {nearest}");
            }
        }
    }

    #[test]
    fn the_distance_changes_no_faster_than_the_point() {
        for (shape, place) in everywhere() {
            let body = body(shape, place, 60.0);
            let values: Vec<_> =
                points().into_iter().map(|(t, p)| (unit_vector(t, p), body.signed_distance(t, p))).collect();
            assert!(values.iter().any(|(_, d)| *d > 0.0) && values.iter().any(|(_, d)| *d < 0.0));
            for (a, da) in &values {
                for (b, db) in &values {
                    assert!((da - db).abs() <= separation(*a, *b) + 1e-12, "{shape} at {place:?}");
                }
            }
        }
    }

    /// The point at a distance from a centre under a bearing from north through east, by spherical trigonometry.
    fn destination([lon, lat, _]: [f64; 3], bearing: f64, distance: f64) -> (f64, f64) {
        let (lat, bearing) = (lat.to_radians(), bearing.to_radians());
        let z = lat.sin() * distance.cos() + lat.cos() * distance.sin() * bearing.cos();
        let turn = (bearing.sin() * distance.sin())
            .atan2(lat.cos() * distance.cos() - lat.sin() * distance.sin() * bearing.cos());
        (z.acos(), lon.to_radians() + turn)
    }

    #[test]
    fn a_body_is_the_same_wherever_it_is() {
        for shape in Shape::ALL {
            for bearing in [5.0, 62.0, 123.0, 180.0, 301.0] {
                for distance in [0.01, 0.1, 0.3, 1.0, 2.5] {
                    let at = |place: [f64; 3]| {
                        let (theta, phi) = destination(place, bearing + place[2], distance);
                        body(shape, place, 25.0).signed_distance(theta, phi)
                    };
                    for place in PLACES {
                        let difference = at(place) - at(PLACES[0]);
                        assert!(difference.abs() < 1e-7, "{shape} at {place:?}: {difference}");
                    }
                }
            }
        }
    }

    #[test]
    fn position_angles_turn_from_north_to_east() {
        let place = [40.0, 20.0, 30.0];
        let radius = (10f64.to_radians().sin() / 60f64.to_radians().sin()).asin();
        let triangle = body(Shape::Triangle, place, 20.0);
        let (theta, phi) = destination(place, 30.0, radius);
        assert!(triangle.signed_distance(theta, phi).abs() < 1e-7);
        assert!(body(Shape::Triangle, [40.0, 20.0, -30.0], 20.0).signed_distance(theta, phi) < -0.05);
        // Leaning east: more of the parallelogram is to the north-east than to the north-west.
        let leaning = body(Shape::Parallelogram, [0.0, 0.0, 0.0], 20.0);
        assert!(leaning.signed_distance(FRAC_PI_2 - 0.08, 0.22) > 0.0);
        assert!(leaning.signed_distance(FRAC_PI_2 - 0.08, -0.22) < 0.0);
    }

    #[test]
    fn binary_maps_hold_the_boundary_and_smooth_ones_the_distance() {
        // Two pixels on the equator of Nside 4 are on the boundary.
        let grid = Healpix::new(4).unwrap();
        let cap = body(Shape::Cap, [90.0, 0.0, 0.0], 22.5);
        let count = |bodies: &[Body]| shapes(grid, bodies, Edge::Binary).values().iter().sum::<f64>();
        for phi in [78.75f64, 101.25] {
            let p = grid.pixel_at(FRAC_PI_2, phi.to_radians());
            assert!(cap.signed_distance(FRAC_PI_2, phi.to_radians()).abs() < 1e-12);
            assert_eq!(shapes(grid, std::slice::from_ref(&cap), Edge::Binary).values()[p], 1.0);
        }
        let other = body(Shape::Square, [-90.0, 0.0, 0.0], 50.0);
        let both = [cap, other];
        assert_eq!(count(&both), count(&both[..1]) + count(&both[1..]));

        let map = shapes(grid, &both, Edge::Smooth);
        assert_eq!(map.unit.as_deref(), Some("deg"));
        for (p, &value) in map.values().iter().enumerate() {
            let (theta, phi) = grid.centre(p);
            let expected = both.iter().map(|b| b.signed_distance(theta, phi).to_degrees()).fold(-180.0, f64::max);
            assert!((value - expected).abs() < 1e-9);
        }
        assert_eq!(count(&[]), 0.0);
        assert!(shapes(grid, &[], Edge::Smooth).values().iter().all(|&v| v == -180.0));
    }

    #[test]
    fn the_scene_keeps_its_bodies_apart() {
        let bodies = scene();
        assert_eq!(bodies.len(), Shape::ALL.len());
        for a in &bodies {
            for b in &bodies {
                let apart = separation(a.frame[0], b.frame[0]);
                assert!(apart < 1e-12 || apart > 24f64.to_radians());
            }
        }
        // The first three are 4° × 4°, 6° × 3° and 6° × 2°.
        for (body, [a, b]) in bodies.iter().zip([[4.0, 4.0], [6.0, 3.0], [6.0, 2.0]]) {
            let (theta, phi) = (FRAC_PI_2, body.frame[0][1].atan2(body.frame[0][0]));
            let half = |degrees: f64| degrees.to_radians() / 2.0;
            assert!(body.signed_distance(theta, phi + half(a)).abs() < 1e-12);
            assert!(body.signed_distance(theta + half(b), phi).abs() < 1e-12);
        }
    }

    #[test]
    fn names_are_read_back() {
        for shape in Shape::ALL {
            assert_eq!(shape.to_string().parse(), Ok(shape));
        }
        let error = "circle".parse::<Shape>().unwrap_err().to_string();
        assert!(error.contains("'circle'") && error.contains("square, rectangle-2-1"), "{error}");
    }

    #[test]
    fn values_out_of_range_are_named() {
        let new = |lon, lat, size, angle| Body::new(Shape::Cap, lon, lat, size, angle).map(|_| ());
        for size in [0.0, -1.0, 91.0, f64::NAN] {
            assert!(matches!(new(0.0, 0.0, size, 0.0), Err(Error::Size { .. })));
        }
        assert!(matches!(new(0.0, 90.1, 4.0, 0.0), Err(Error::Centre { .. })));
        assert!(matches!(new(f64::INFINITY, 0.0, 4.0, 0.0), Err(Error::Centre { .. })));
        assert!(matches!(new(0.0, f64::NAN, 4.0, 0.0), Err(Error::Centre { .. })));
        assert!(matches!(new(0.0, 0.0, 4.0, f64::NAN), Err(Error::PositionAngle { .. })));
        assert_eq!(new(-540.0, -90.0, 90.0, 1e6), Ok(()));
    }
}
