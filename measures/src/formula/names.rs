//! The names in formulas: measures, with underscores for hyphens, and the parts of moments.

use super::Input;
use super::operations::CONSTANTS;
use crate::find;
use crate::registry::names_like;

/// Names offered in place of a wrong one, at most.
const OFFERED: usize = 3;

/// A measure's name as it stands in formulas.
pub(super) fn written(name: &str) -> String {
    name.replace('-', "_")
}

/// The input that a name stands for.
pub(super) fn input(name: &str) -> Option<Input> {
    let name = name.to_lowercase();
    let Some((moment, part)) = name.split_once('.') else { return find(&name).ok().map(Input::Measure) };
    let digits = moment.strip_prefix("psi")?;
    let rank: u32 = digits.parse().ok()?;
    match part {
        _ if rank.to_string() != digits => None,
        "re" => Some(Input::Re(rank)),
        "im" => Some(Input::Im(rank)),
        _ => None,
    }
}

/// The names of all measures, parts of moments and constants, with the rank that `like` has.
pub(super) fn all_names(like: &str) -> impl Iterator<Item = String> {
    let measures: Vec<String> = names_like(like).map(|name| written(&name)).collect();
    let moments: Vec<String> = measures.iter().filter(|name| input(&format!("{name}.re")).is_some()).cloned().collect();
    let parts = moments.into_iter().flat_map(|name| ["re", "im"].map(|part| format!("{name}.{part}")));
    measures.into_iter().chain(parts).chain(CONSTANTS.iter().map(|(name, _)| (*name).to_owned()))
}

/// The names most like a wrong one, as a question; empty where there are none.
pub(super) fn offered(name: &str, known: impl Iterator<Item = String>) -> String {
    let near = |known: String| (strsim::damerau_levenshtein(&known, &name.to_lowercase()), known);
    let mut near: Vec<_> = known.map(near).filter(|(distance, known)| 2 * distance <= known.len()).collect();
    near.sort();
    near.dedup();
    let names: Vec<String> = near.into_iter().take(OFFERED).map(|(_, name)| format!("'{name}'")).collect();
    match names.split_last() {
        None => String::new(),
        Some((last, [])) => format!(" (did you mean {last}?)"),
        Some((last, others)) => format!(" (did you mean {} or {last}?)", others.join(", ")),
    }
}
