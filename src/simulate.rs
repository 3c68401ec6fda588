//! Synthetic maps with known answers: bodies of simple shapes, and Gaussian random fields.
//!
//! Everything here is a pure function of its arguments. Measuring the maps, writing them to files and reporting
//! warnings to people is left to others. Angles in arguments are degrees; [`Body::signed_distance`], like all
//! geometry inside, works in radians.

mod shapes;
mod waves;

use longan_grid::{Healpix, Map, Ring};
use rayon::prelude::*;

pub use shapes::{Body, Edge, Shape, scene, shapes};
pub use waves::{WAVES, Warning, Waves};

/// What can be wrong with the description of a synthetic map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A correlation angle outside (0°, 90°].
    #[error("a correlation angle of {degrees}° is not above 0° and at most 90°")]
    CorrelationAngle {
        /// The value given.
        degrees: f64,
    },
    /// A size outside (0°, 90°].
    #[error("a size of {degrees}° is not above 0° and at most 90°")]
    Size {
        /// The value given.
        degrees: f64,
    },
    /// A centre that is no point of the sphere.
    #[error("longitude {lon}°, latitude {lat}° is not a point: both must be finite, the latitude within ±90°")]
    Centre {
        /// Longitude in degrees.
        lon: f64,
        /// Latitude in degrees.
        lat: f64,
    },
    /// A position angle that is infinite or not a number.
    #[error("a position angle of {degrees}° is not finite")]
    PositionAngle {
        /// The value given.
        degrees: f64,
    },
    /// A name that no shape has.
    #[error("there is no shape '{name}'; choose one of {}", Shape::ALL.map(Shape::name).join(", "))]
    UnknownShape {
        /// The name given.
        name: String,
    },
}

/// A map whose rings `fill` computes, each on its own and in parallel.
fn map(name: &str, grid: Healpix, fill: impl Fn(Ring, &mut [f64]) + Sync) -> Map {
    let mut values = vec![0.0; grid.pixels()];
    let mut rings = Vec::with_capacity(grid.rings());
    let mut rest = values.as_mut_slice();
    for i in 1..=grid.rings() {
        let ring = grid.ring(i);
        let (head, tail) = rest.split_at_mut(ring.len);
        rings.push((ring, head));
        rest = tail;
    }
    rings.into_par_iter().for_each(|(ring, values)| fill(ring, values));
    Map::new(name, values).expect("one value for every pixel of a grid")
}
