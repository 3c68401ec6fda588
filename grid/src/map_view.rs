//! A field on a HEALPix grid, borrowed from wherever it is.

use std::borrow::Cow;

use ndarray::{Array1, ArrayView1};

use crate::{Error, Healpix, Map, UNSEEN, is_bad};

/// A field on a HEALPix grid: one value for each pixel in RING order, NaN where masked.
///
/// It is made of a [`Map`], or of an array or slice of 12 Nside² values, in which NaN, ±Inf and [`UNSEEN`] are masked.
/// Values are borrowed; they are copied only where an array has ±Inf or UNSEEN, or its values do not follow one another
/// in memory.
///
/// ```
/// use longan_grid::MapView;
/// use ndarray::Array1;
///
/// let values = Array1::from_elem(48, 1.0);
/// let field = MapView::try_from(&values)?;
/// assert_eq!(field.grid().nside(), 2);
/// # Ok::<(), longan_grid::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct MapView<'a> {
    grid: Healpix,
    values: Cow<'a, [f64]>,
}

impl<'a> MapView<'a> {
    fn new(values: Cow<'a, [f64]>) -> Result<Self, Error> {
        let grid = Healpix::with_pixels(values.len()).ok_or(Error::PixelCount { pixels: values.len() })?;
        let is_mask = |value: &f64| !value.is_nan() && is_bad(*value, UNSEEN);
        let mut view = MapView { grid, values };
        if view.values.iter().any(is_mask) {
            view.values.to_mut().iter_mut().filter(|value| is_mask(value)).for_each(|value| *value = f64::NAN);
        }
        Ok(view)
    }

    /// The grid.
    pub fn grid(&self) -> Healpix {
        self.grid
    }

    /// The values in RING order, NaN where masked.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The values alone, borrowed or copied as they are here.
    pub fn into_values(self) -> Cow<'a, [f64]> {
        self.values
    }
}

impl<'a> From<&'a Map> for MapView<'a> {
    fn from(map: &'a Map) -> Self {
        MapView { grid: map.grid(), values: Cow::Borrowed(map.values()) }
    }
}

impl<'a> TryFrom<ArrayView1<'a, f64>> for MapView<'a> {
    type Error = Error;

    fn try_from(values: ArrayView1<'a, f64>) -> Result<Self, Error> {
        MapView::new(values.to_slice().map_or_else(|| Cow::Owned(values.to_vec()), Cow::Borrowed))
    }
}

impl<'a> TryFrom<&'a Array1<f64>> for MapView<'a> {
    type Error = Error;

    fn try_from(values: &'a Array1<f64>) -> Result<Self, Error> {
        values.view().try_into()
    }
}

impl<'a> TryFrom<&'a [f64]> for MapView<'a> {
    type Error = Error;

    fn try_from(values: &'a [f64]) -> Result<Self, Error> {
        MapView::new(Cow::Borrowed(values))
    }
}

impl<'a> TryFrom<&'a Vec<f64>> for MapView<'a> {
    type Error = Error;

    fn try_from(values: &'a Vec<f64>) -> Result<Self, Error> {
        values.as_slice().try_into()
    }
}

#[cfg(test)]
mod tests {
    use ndarray::s;

    use super::*;

    #[test]
    fn values_are_borrowed_unless_they_have_to_change() {
        let values = Array1::from_iter((0..48).map(f64::from));
        let view = MapView::try_from(&values).unwrap();
        assert!(matches!(view.values, Cow::Borrowed(_)) && view.values() == values.as_slice().unwrap());
        let nan = Array1::from_iter((0..48).map(|i| if i == 3 { f64::NAN } else { 1.0 }));
        assert!(matches!(MapView::try_from(&nan).unwrap().values, Cow::Borrowed(_)));
        for bad in [UNSEEN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut values = values.clone();
            values[7] = bad;
            let view = MapView::try_from(&values).unwrap();
            assert!(view.values()[7].is_nan() && view.values()[8] == 8.0);
        }
        let twice = Array1::from_iter((0..96).map(f64::from));
        assert_eq!(MapView::try_from(twice.slice(s![..;2])).unwrap().values()[5], 10.0);
    }

    #[test]
    fn a_number_of_values_that_no_grid_has_is_refused() {
        assert_eq!(MapView::try_from(&vec![0.0; 50]).unwrap_err(), Error::PixelCount { pixels: 50 });
    }
}
