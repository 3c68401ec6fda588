//! The CF conventions for climate and forecast data, on top of any [`Dataset`](crate::dataset::Dataset).
//!
//! [`mod@unpack`] turns stored numbers into a field's values, [`coordinates`] finds what belongs to a variable's
//! dimensions, [`time`] reads dates, [`mod@select`] finds places along dimensions, [`mod@describe`] tells what a variable
//! is. What a grid is, and how it becomes a map, is left to the adapters.

mod coordinates;
mod describe;
mod select;
mod time;
mod unpack;

pub(crate) use coordinates::{Horizontal, find, is_position, names_in};
pub(crate) use describe::describe;
pub(crate) use select::{Chosen, select, shape};
pub(crate) use unpack::values;
