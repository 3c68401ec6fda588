//! The coastlines of the Earth, which come with the program. Their source and form are in `coastlines/README.md`.

use glam::DVec3;

use super::projection::vector_of_degrees;

static LINES: &[u8] = include_bytes!("coastlines/coastlines.bin");

/// The lines, as unit vectors.
pub(super) fn coastlines() -> impl Iterator<Item = Vec<DVec3>> {
    let mut numbers = LINES.chunks_exact(2).map(|bytes| [bytes[0], bytes[1]]);
    std::iter::from_fn(move || {
        let count = u16::from_le_bytes(numbers.next()?);
        let mut angle = || Some(f64::from(i16::from_le_bytes(numbers.next()?)) / 100.0);
        (0..count).map(|_| Some((angle()?, angle()?))).map(|at| at.map(point)).collect()
    })
}

fn point((longitude, latitude): (f64, f64)) -> DVec3 {
    vector_of_degrees(longitude, latitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_read_to_its_end() {
        let lines: Vec<_> = coastlines().collect();
        let points: usize = lines.iter().map(Vec::len).sum();
        assert_eq!(LINES.len(), 2 * lines.len() + 4 * points);
        assert!(lines.iter().all(|line| line.len() > 1));
        assert!(lines.iter().flatten().all(|at| (at.length() - 1.0).abs() < 1e-12));
        // Land's End, Cape Agulhas, Cape Horn and Cape Dezhnev are within half a degree of a coast, the middle of the
        // Pacific is far from any.
        let nearest = |longitude: f64, latitude: f64| {
            let here = point((longitude, latitude));
            lines.iter().flatten().map(|at| at.angle_between(here).to_degrees()).fold(f64::MAX, f64::min)
        };
        for (longitude, latitude) in [(-5.7, 50.07), (20.0, -34.8), (-67.3, -55.9), (-169.7, 66.1)] {
            assert!(nearest(longitude, latitude) < 0.5, "{longitude} {latitude}: {}", nearest(longitude, latitude));
        }
        assert!(nearest(-125.0, -30.0) > 10.0);
    }
}
