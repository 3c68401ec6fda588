//! The places of a map that deviate most, each apart from all others.

use longan_grid::Healpix;
use longan_grid::disc::Disc;
use ndarray::ArrayView1;

/// A pixel that deviates more than all about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The pixel, in RING order.
    pub pixel: usize,
    /// Longitude of its centre in degrees.
    pub lon: f64,
    /// Latitude of its centre in degrees.
    pub lat: f64,
    /// The deviation, in standard deviations.
    pub sigma: f64,
}

/// The pixels of largest |σ|, the largest first: at most `most`, none below `level`, and none within `distance`
/// degrees of one before it. Of equal ones the first in RING order goes first.
pub fn peaks<'a>(
    grid: Healpix,
    sigma: impl Into<ArrayView1<'a, f64>>,
    distance: f64,
    level: f64,
    most: usize,
) -> Vec<Peak> {
    let sigma = sigma.into();
    let mut pixels: Vec<usize> = (0..sigma.len().min(grid.pixels())).filter(|&p| sigma[p].abs() >= level).collect();
    pixels.sort_by(|&a, &b| sigma[b].abs().total_cmp(&sigma[a].abs()));
    let distance = distance.to_radians();
    let mut peaks: Vec<Peak> = Vec::new();
    let mut is_near = vec![false; grid.pixels()];
    for pixel in pixels {
        if peaks.len() >= most {
            break;
        }
        if is_near[pixel] {
            continue;
        }
        let (theta, phi) = grid.centre(pixel);
        Disc::new(theta, phi, distance).pixels(grid).for_each(|near| is_near[near] = true);
        let (lon, lat) = (phi.to_degrees(), 90.0 - theta.to_degrees());
        peaks.push(Peak { pixel, lon, lat, sigma: sigma[pixel] });
    }
    peaks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_are_apart_and_in_order() {
        let grid = Healpix::new(8).unwrap();
        let mut sigma = vec![f64::NAN; grid.pixels()];
        // About the pole 2 pixels within some degrees, and two far away of which one is negative.
        for (pixel, value) in [(0, 3.0), (2, -4.0), (400, -5.0), (700, 3.5), (500, 1.0)] {
            sigma[pixel] = value;
        }
        let found = |distance, level, most| -> Vec<usize> {
            peaks(grid, &sigma, distance, level, most).iter().map(|peak| peak.pixel).collect()
        };
        assert_eq!(found(30.0, 2.0, 10), [400, 2, 700]);
        assert_eq!(found(1.0, 2.0, 10), [400, 2, 700, 0]);
        assert_eq!(found(1.0, 0.0, 10), [400, 2, 700, 0, 500]);
        assert_eq!(found(0.0, 2.0, 2), [400, 2]);
        assert_eq!(found(180.0, 0.0, 10), [400]);
        let peak = peaks(grid, &sigma, 30.0, 4.5, 10)[0];
        let (theta, phi) = grid.centre(400);
        assert_eq!((peak.sigma, peak.lon, peak.lat), (-5.0, phi.to_degrees(), 90.0 - theta.to_degrees()));
    }
}
