//! Files of pictures, in the form that their name asks for. What is on them is left to the commands.

use std::path::Path;

use longan_formats::{self as formats, Error};
use longan_picture::Drawing;

/// The forms of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    Png,
    Svg,
}

impl Form {
    /// The form that a file's name asks for.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        match path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase().as_str() {
            "png" => Some(Form::Png),
            "svg" => Some(Form::Svg),
            _ => None,
        }
    }

    /// The bytes of a file of this form.
    pub(crate) fn bytes(self, drawing: &Drawing) -> anyhow::Result<Vec<u8>> {
        Ok(match self {
            Form::Png => drawing.png()?,
            Form::Svg => drawing.svg().as_bytes().to_vec(),
        })
    }
}

/// Writes a file, all or nothing.
pub(crate) fn save(path: &Path, overwrite: bool, bytes: &[u8]) -> Result<(), Error> {
    formats::save(path, overwrite, |temporary| std::fs::write(temporary, bytes).map_err(Error::io("write it")))
}
