//! The options that mend a problem with a file. The sentence is the library's; the options stand in brackets behind it.

use longan::graph::GraphError;
use longan_formats::{Ask, Error};

/// A problem with a file beside the input, whose field and places are chosen by options of their own.
#[derive(Debug, thiserror::Error)]
#[error("{error}")]
pub(crate) struct OfOther {
    error: Error,
    variable: &'static str,
    select: &'static str,
}

/// For `map_err`: a problem with the mask.
pub(crate) fn of_mask(error: Error) -> OfOther {
    OfOther { error, variable: "--mask-field", select: "--mask-select" }
}

/// For `map_err`: a problem with the map of contours of a picture.
pub(crate) fn of_contours(error: Error) -> OfOther {
    OfOther { error, variable: "--contour-variable", select: "--contour-select" }
}

/// An error in one line, with the options that mend it.
pub(crate) fn told(error: &anyhow::Error) -> String {
    with_options(format!("{error:#}"), error.chain().find_map(options))
}

/// The sentence of an error without the name of the file, with the options that mend it.
pub(crate) fn sentence(error: &Error) -> String {
    with_options(error.problem().to_string(), error.ask().and_then(of_input))
}

fn with_options(sentence: String, options: Option<String>) -> String {
    match options {
        Some(options) => format!("{sentence} ({options})"),
        None => sentence,
    }
}

/// The options that mend an error, where it is one of files or grids.
fn options(error: &(dyn std::error::Error + 'static)) -> Option<String> {
    if let Some(OfOther { error, variable, select }) = error.downcast_ref() {
        return match error.ask()? {
            Ask::Variable => Some((*variable).to_owned()),
            Ask::Place { dimension, place } => Some(of_place(select, dimension.as_deref(), place.as_deref())),
            _ => None,
        };
    }
    if let Some(error) = error.downcast_ref() {
        return of_graph(error).map(str::to_owned);
    }
    let of_grid = || Some(Error::from(error.downcast_ref::<longan_grid::Error>()?.clone()));
    match error.downcast_ref::<Error>() {
        Some(error) => of_input(error.ask()?),
        None => of_input(of_grid()?.ask()?),
    }
}

/// The options of the input by which a choice is made.
fn of_input(ask: &Ask) -> Option<String> {
    Some(match ask {
        Ask::Variable => "--variable".to_owned(),
        Ask::Hdu => "--hdu".to_owned(),
        Ask::Place { dimension, place } => of_place("--select", dimension.as_deref(), place.as_deref()),
        Ask::Nside => "--nside".to_owned(),
        Ask::Centre => "--centre".to_owned(),
        Ask::Reach => "--nside, --reach".to_owned(),
        Ask::Folds => "--centre, --allow-folds".to_owned(),
        Ask::Overwrite => "--overwrite".to_owned(),
        _ => return None,
    })
}

/// An option that chooses a place along a dimension, such as `--select level=VALUE`.
fn of_place(option: &str, dimension: Option<&str>, place: Option<&str>) -> String {
    match dimension {
        Some(dimension) => format!("{option} {dimension}={}", place.unwrap_or("VALUE")),
        None => option.to_owned(),
    }
}

/// The options that mend a problem of a graph.
fn of_graph(error: &GraphError) -> Option<&'static str> {
    match error {
        GraphError::NoWindow => Some("--nside-out"),
        GraphError::NoGaussian => Some("--gaussian"),
        _ => None,
    }
}
