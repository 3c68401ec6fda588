//! The identity of Minkowski maps: their recipe and the files that they are made of, as headers state it.
//!
//! The commands decide what follows from a difference.

use std::fmt;

use anyhow::Context;
use longan::Recipe;
use longan_formats::{Card, CardValue, InputRecord, Role, TableDescription};
use serde::de::DeserializeOwned;

use super::cards::text;

/// The header entry with the recipe, in JSON.
pub(crate) const RECIPE: &str = "RECIPE";

/// The header entry with the input files, in JSON.
pub(crate) const INPUTS: &str = "INPUTS";

/// The choices and files that decide on the values of Minkowski maps.
#[derive(Clone, Debug)]
pub(crate) struct Identity {
    /// Every choice.
    pub(crate) recipe: Recipe,
    /// The files; none for fields that were handed over in memory.
    pub(crate) inputs: Vec<InputRecord>,
}

/// A difference between two identities.
pub(crate) enum Difference {
    /// The older release computed in another way.
    Release,
    /// A choice: its name, and both values.
    Choice(&'static str, String, String),
    /// Another file: its role, and both paths.
    File(Role, String, String),
    /// A file that has changed since, or whose state is not known.
    Changed(String),
}

impl Identity {
    /// The header entries that state it.
    pub(crate) fn cards(&self) -> [Card; 2] {
        [
            text(RECIPE, ascii_json(&self.recipe), "every choice, in JSON"),
            text(INPUTS, ascii_json(&self.inputs), "the files measured, in JSON"),
        ]
    }

    /// The identity that a table's header states; none where longan did not write it, or a release without recipes.
    ///
    /// # Errors
    /// Where it cannot be understood.
    pub(crate) fn stated(table: &TableDescription) -> anyhow::Result<Option<Self>> {
        let Some(recipe) = json(table, RECIPE)? else { return Ok(None) };
        Ok(Some(Identity { recipe, inputs: json(table, INPUTS)?.unwrap_or_default() }))
    }

    /// The first difference from what would be made now.
    pub(crate) fn difference(&self, now: &Identity) -> Option<Difference> {
        if self.recipe.revision != now.recipe.revision {
            return Some(Difference::Release);
        }
        if let Some((name, old, new)) = self.recipe.difference(&now.recipe) {
            return Some(Difference::Choice(name, old, new));
        }
        let role = |inputs: &[InputRecord], role| -> Vec<InputRecord> {
            inputs.iter().filter(|input| input.role == role).cloned().collect()
        };
        [Role::Map, Role::Mask, Role::Plugin].into_iter().find_map(|which| {
            let [old, new] = [&self.inputs, &now.inputs].map(|inputs| role(inputs, which));
            let paths = |inputs: &[InputRecord]| match inputs {
                [] => "none".to_owned(),
                _ => inputs.iter().map(|input| input.path.as_str()).collect::<Vec<_>>().join(", "),
            };
            if paths(&old) != paths(&new) {
                return Some(Difference::File(which, paths(&old), paths(&new)));
            }
            let changed = std::iter::zip(&old, &new).find(|(old, new)| old != new);
            changed.map(|(old, _)| Difference::Changed(old.path.clone()))
        })
    }
}

impl fmt::Display for Difference {
    /// Follows "it".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Difference::Release => f.write_str("was made by another release of longan, whose values differ"),
            Difference::Choice(name, old, new) => write!(f, "was made with {name} '{old}', not '{new}'"),
            Difference::File(Role::Map, old, new) => write!(f, "is made of {old}, not of {new}"),
            Difference::File(Role::Mask, old, new) => write!(f, "was made with the mask {old}, not {new}"),
            Difference::File(Role::Plugin, old, new) => write!(f, "was made with the plugin {old}, not {new}"),
            Difference::Changed(path) => write!(f, "was made before {path} changed"),
        }
    }
}

/// The value of a header entry in JSON, if there is one.
fn json<T: DeserializeOwned>(table: &TableDescription, key: &str) -> anyhow::Result<Option<T>> {
    let Some(CardValue::Text(text)) = table.card(key) else { return Ok(None) };
    let read = serde_json::from_str(text).with_context(|| {
        format!("its {key} cannot be understood; a newer release of longan, or another program, wrote it")
    });
    read.map(Some)
}

/// JSON in ASCII, which is all that FITS headers hold.
fn ascii_json(value: &impl serde::Serialize) -> String {
    let json = serde_json::to_string(value).expect("names, numbers and texts");
    let mut ascii = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            _ if c.is_ascii() => ascii.push(c),
            _ => c.encode_utf16(&mut [0; 2]).iter().for_each(|unit| ascii.push_str(&format!("\\u{unit:04x}"))),
        }
    }
    ascii
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_text_comes_back_from_ascii() {
        for text in ["plain", "léo's 'sky'", "\u{1f30d} ∑ \\u00e9 \"", "\n\t"] {
            let json = ascii_json(&text);
            assert!(json.is_ascii(), "{json}");
            assert_eq!(serde_json::from_str::<String>(&json).unwrap(), text);
        }
    }
}
