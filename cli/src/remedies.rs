//! Which options mend what a library complains of. The sentence is the library's; the options stand in brackets behind it.

use longan_formats::Error;

/// An error in one line, with the options that mend it.
pub(crate) fn told(error: &anyhow::Error) -> String {
    let options =
        error.chain().find_map(|cause| cause.downcast_ref().map(options).or_else(|| cause.downcast_ref().map(of_grid)));
    match options {
        Some(options) if !options.is_empty() => format!("{error:#} ({options})"),
        _ => format!("{error:#}"),
    }
}

fn options(error: &Error) -> &'static str {
    match error {
        Error::File { problem, .. } => options(problem),
        Error::Grid(error) => of_grid(error),
        _ => "",
    }
}

fn of_grid(error: &longan_grid::Error) -> &'static str {
    use longan_grid::Error;
    match error {
        Error::OnePlace => "--nside, --reach",
        Error::AtCentre { .. } => "--centre",
        Error::Crossings { .. } => "--centre, --allow-folds",
        _ => "",
    }
}
