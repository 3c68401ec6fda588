//! Sines and arcs of the small angles between neighbouring pixels, which are needed for every piece of contour.
//!
//! Below [`SMALL`] a few terms of the Taylor series are exact to rounding and several times faster than the
//! general functions, which serve above.

/// Where the series end: the first term left out is below 2⁻⁵³ of the sum.
const SMALL: f64 = 0.03;

/// sin x and 1 − cos x, for x ≥ 0, both without cancellation.
#[inline(always)]
pub(crate) fn sin_versine(x: f64) -> (f64, f64) {
    if x >= SMALL {
        return (x.sin(), 2.0 * (x / 2.0).sin().powi(2));
    }
    let xx = x * x;
    let sin = x - x * xx * (1.0 / 6.0 - xx * (1.0 / 120.0 - xx * (1.0 / 5040.0)));
    let versine = xx * (0.5 - xx * (1.0 / 24.0 - xx * (1.0 / 720.0 - xx * (1.0 / 40320.0))));
    (sin, versine)
}

/// The angle in 0..π with this sine (≥ 0) and cosine.
#[inline(always)]
pub(crate) fn from_sin_cos(sin: f64, cos: f64) -> f64 {
    if sin >= SMALL || cos < 0.0 {
        return sin.atan2(cos);
    }
    // The series of the arc sine.
    let ss = sin * sin;
    let series =
        ss * (1.0 / 6.0 + ss * (3.0 / 40.0 + ss * (5.0 / 112.0 + ss * (35.0 / 1152.0 + ss * (63.0 / 2816.0)))));
    sin + sin * series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_are_the_functions() {
        for i in 0..20_000 {
            let x = f64::from(i) * 2e-6;
            let (sin, versine) = sin_versine(x);
            let half = (x / 2.0).sin();
            assert!(
                (sin - x.sin()).abs() <= 4e-16 * x && (versine - 2.0 * half * half).abs() <= 1e-15 * versine,
                "{x}"
            );
            assert!((from_sin_cos(x.sin(), x.cos()) - x).abs() <= 4e-16 * x, "{x}");
            let beyond = std::f64::consts::PI - x;
            assert!((from_sin_cos(beyond.sin(), beyond.cos()) - beyond).abs() <= 1e-15, "{beyond}");
        }
    }
}
