//! A part of the sphere: all that lies within a distance of a point, in degrees, and how it is written.
//! The pixels in it are left to [`longan_grid::disc`].

use std::str::FromStr;

use longan_grid::Healpix;
use longan_grid::disc::Disc;

/// All points within a radius of a centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    longitude: f64,
    latitude: f64,
    radius: f64,
}

/// Why there is no such region.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegionError {
    /// Not three numbers.
    #[error("'{text}' is not of the form lon,lat,radius with three numbers in degrees, such as 120,-30,20")]
    Syntax {
        /// The text given.
        text: String,
    },
    /// A centre that is no point of the sphere.
    #[error("longitude {longitude}, latitude {latitude} is not a point: these must be within ±360 and ±90 degrees")]
    Centre {
        /// Longitude in degrees.
        longitude: f64,
        /// Latitude in degrees.
        latitude: f64,
    },
    /// A radius that is none.
    #[error("a radius of {radius} degrees is not above 0 and at most 180")]
    Radius {
        /// The radius in degrees.
        radius: f64,
    },
}

impl Region {
    /// The region within a radius of a centre, all in degrees.
    ///
    /// # Errors
    /// [`RegionError::Centre`], [`RegionError::Radius`].
    pub fn new(longitude: f64, latitude: f64, radius: f64) -> Result<Self, RegionError> {
        if !((-360.0..=360.0).contains(&longitude) && (-90.0..=90.0).contains(&latitude)) {
            return Err(RegionError::Centre { longitude, latitude });
        }
        if !(radius > 0.0 && radius <= 180.0) {
            return Err(RegionError::Radius { radius });
        }
        Ok(Region { longitude, latitude, radius })
    }

    /// Longitude and latitude of the centre and the radius, in degrees.
    pub fn degrees(&self) -> [f64; 3] {
        [self.longitude, self.latitude, self.radius]
    }

    /// For each pixel of a grid, in RING order, whether its centre lies within.
    pub fn pixels(&self, grid: Healpix) -> Vec<bool> {
        self.disc().mask(grid)
    }

    /// The region as a disc.
    pub fn disc(&self) -> Disc {
        Disc::from_degrees(self.longitude, self.latitude, self.radius)
    }
}

/// `lon,lat,radius` in degrees.
impl FromStr for Region {
    type Err = RegionError;

    fn from_str(text: &str) -> Result<Self, RegionError> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[longitude, latitude, radius]) => Region::new(longitude, latitude, radius),
            _ => Err(RegionError::Syntax { text: text.to_owned() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_those_near_the_centre() {
        let grid = Healpix::new(8).unwrap();
        let place = |theta: f64, phi: f64| [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
        for (lon, lat, radius) in [(0.0, 0.0, 30.0), (-170.0, 71.0, 25.0), (340.0, -90.0, 100.0)] {
            let pixels = Region::new(lon, lat, radius).unwrap().pixels(grid);
            let centre = place(f64::to_radians(90.0 - lat), f64::to_radians(lon));
            for (p, &within) in pixels.iter().enumerate() {
                let (theta, phi) = grid.centre(p);
                let cos: f64 = place(theta, phi).iter().zip(centre).map(|(a, b)| a * b).sum();
                assert_eq!(within, cos >= radius.to_radians().cos(), "{lon},{lat},{radius}: pixel {p}");
            }
        }
        assert!(Region::new(12.0, 34.0, 180.0).unwrap().pixels(grid).into_iter().all(|within| within));
    }

    #[test]
    fn every_mistake_is_named() {
        assert_eq!("120, -30,20".parse::<Region>().unwrap().degrees(), [120.0, -30.0, 20.0]);
        for text in ["", "1,2", "1,2,3,4", "1,2,x"] {
            assert!(matches!(text.parse::<Region>(), Err(RegionError::Syntax { .. })), "{text}");
        }
        for text in ["361,0,1", "0,91,1", "nan,0,1", "0,nan,1"] {
            assert!(matches!(text.parse::<Region>(), Err(RegionError::Centre { .. })), "{text}");
        }
        for text in ["0,0,0", "0,0,-1", "0,0,181", "0,0,nan"] {
            assert!(matches!(text.parse::<Region>(), Err(RegionError::Radius { .. })), "{text}");
        }
    }
}
