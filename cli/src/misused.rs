//! Arguments that make no sense together, or for the files that they name.

/// An error that ends the program as wrong arguments do: with exit status 2 and the usage of the command.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct Misused(pub(crate) String);

/// The error of a problem with arguments.
pub(crate) fn misused(problem: String) -> anyhow::Error {
    Misused(problem).into()
}
