//! The CF conventions for climate and forecast data, on top of any [`Dataset`](crate::dataset::Dataset).
//!
//! [`mod@unpack`] turns stored numbers into a field's values, [`coordinates`] finds what belongs to a variable's
//! dimensions, [`time`] reads dates, [`mod@select`] finds places along dimensions. What a grid is, and how it becomes a
//! map, is left to the adapters.

mod coordinates;
mod select;
mod time;
mod unpack;

pub(crate) use coordinates::{Horizontal, find, is_position, names_in};
pub(crate) use select::{Chosen, Labels, select, shape};
pub(crate) use unpack::values;
