//! Reading and checking the description that a plugin gives of itself.

use std::collections::HashSet;
use std::ffi::c_char;

use super::interface::*;
use super::problem::Problem;
use crate::{Needs, Quantity, Weight};

/// Most characters of a name: it becomes a FITS column's, with the plugin's at times.
const NAME_MAX: usize = 60;

/// A measure, checked.
pub(super) struct Described {
    pub(super) name: String,
    pub(super) definition: String,
    pub(super) quantity: Quantity,
    pub(super) unit: String,
    pub(super) rank: u32,
    pub(super) needs: Needs,
    pub(super) evaluate: unsafe extern "C" fn(*const LonganMeasure, *const LonganWindows, *mut f64, *mut c_char) -> i32,
    pub(super) measure: Pointer,
}

/// A measure in the library, handed back to it with each call.
pub(super) struct Pointer(pub(super) *const LonganMeasure);

// SAFETY: longan never reads through it after loading, and the interface lets all threads use it in the library.
unsafe impl Send for Pointer {}
// SAFETY: as above.
unsafe impl Sync for Pointer {}

/// The name, the version and the measures of a plugin.
///
/// # Safety
/// Pointers that are neither null nor misaligned lead to what the interface says. Sizes are checked before
/// anything that depends on them is read.
pub(super) unsafe fn read(plugin: *const LonganPlugin) -> Result<(String, String, Vec<Described>), Problem> {
    check(plugin, || "its description".to_owned())?;
    // SAFETY: every version of the interface begins with the size.
    let size = unsafe { plugin.cast::<u32>().read() };
    check_size("LonganPlugin", size, size_of::<LonganPlugin>())?;
    // SAFETY: it has the size of a LonganPlugin.
    let plugin = unsafe { plugin.read() };
    check_size("LonganMeasure", plugin.measure_size, size_of::<LonganMeasure>())?;
    check_size("LonganWindow", plugin.window_size, size_of::<LonganWindow>())?;
    check_size("LonganWindows", plugin.windows_size, size_of::<LonganWindows>())?;
    // SAFETY: a text, as the interface says.
    let name = unsafe { read_name(plugin.name, "its name") }?;
    if name == "longan" {
        return Err(Problem::Text {
            what: "its name".to_owned(),
            fault: "is 'longan', which means longan itself".into(),
        });
    }
    // SAFETY: as above.
    let version = unsafe { read_text(plugin.version, "its version") }?;
    if !(1..=LONGAN_MEASURES_MAX).contains(&plugin.measures_count) {
        return Err(Problem::Count { found: plugin.measures_count });
    }
    check(plugin.measures, || "its measures".to_owned())?;
    let mut names = HashSet::new();
    let mut measures = Vec::new();
    for i in 0..plugin.measures_count as usize {
        // SAFETY: the interface says that there are so many, and each of those before had the right size.
        let described = unsafe { read_measure(plugin.measures.add(i), i) }?;
        if !names.insert(described.name.clone()) {
            return Err(Problem::Repeated { name: described.name });
        }
        measures.push(described);
    }
    Ok((name, version, measures))
}

/// # Safety
/// As [`read`].
unsafe fn read_measure(pointer: *const LonganMeasure, i: usize) -> Result<Described, Problem> {
    // SAFETY: every measure begins with its size.
    let size = unsafe { pointer.cast::<u32>().read() };
    check_size("a LonganMeasure", size, size_of::<LonganMeasure>())?;
    // SAFETY: it has the size of a LonganMeasure.
    let measure = unsafe { pointer.read() };
    // SAFETY: texts, as the interface says.
    let name = unsafe { read_name(measure.name, &format!("the name of measure {}", i + 1)) }?;
    // SAFETY: as above.
    let definition = unsafe { read_text(measure.definition, &format!("the definition of '{name}'")) }?;
    let of_unit = format!("the unit of '{name}'");
    // SAFETY: as above.
    let unit = unsafe { read_line(measure.unit, &of_unit) }?;
    if !unit.is_ascii() {
        return Err(Problem::Text { what: of_unit, fault: "is not ASCII, as FITS wants it".to_owned() });
    }
    let impossible = |fault: String| Problem::Impossible { measure: name.clone(), fault };
    let Some(evaluate) = measure.evaluate else {
        return Err(Problem::Pointer { what: format!("the function of '{name}'"), null: true });
    };
    let count = measure.ranks_count;
    if count > LONGAN_RANK_MAX + 1 {
        return Err(impossible(format!("says that it needs {count} ranks, and there are {}", LONGAN_RANK_MAX + 1)));
    }
    let mut ranks = Vec::new();
    if count > 0 {
        check(measure.ranks, || format!("the ranks of '{name}'"))?;
        // SAFETY: the interface says that there are so many.
        ranks.extend_from_slice(unsafe { std::slice::from_raw_parts(measure.ranks, count as usize) });
    }
    if let Some(rank) = ranks.iter().chain([&measure.rank]).find(|rank| **rank > LONGAN_RANK_MAX) {
        return Err(impossible(format!("has the rank {rank}, which is not between 0 and {LONGAN_RANK_MAX}")));
    }
    if let Some(pair) = ranks.windows(2).find(|pair| pair[0] >= pair[1]) {
        return Err(impossible(format!("needs the rank {} after {}; they must ascend", pair[1], pair[0])));
    }
    let known = LONGAN_NEEDS_AREA | LONGAN_NEEDS_LENGTH | LONGAN_NEEDS_CURVATURE;
    if measure.needs & !known != 0 {
        return Err(impossible(format!("has the needs {:#x}, of which {known:#x} are known", measure.needs)));
    }
    let weight = match measure.weight {
        LONGAN_WEIGHT_EITHER => None,
        LONGAN_WEIGHT_LENGTH => Some(Weight::Length),
        LONGAN_WEIGHT_CURVATURE => Some(Weight::Curvature),
        other => return Err(impossible(format!("has the weight {other}, which is not between 0 and 2"))),
    };
    let quantity = read_quantity(&measure, &unit).map_err(impossible)?;
    let needs = Needs {
        area: measure.needs & LONGAN_NEEDS_AREA != 0,
        length: measure.needs & LONGAN_NEEDS_LENGTH != 0,
        curvature: measure.needs & LONGAN_NEEDS_CURVATURE != 0,
        ranks,
        weight,
    };
    Ok(Described { name, definition, quantity, unit, rank: measure.rank, needs, evaluate, measure: Pointer(pointer) })
}

/// The quantity, or the fault of what the plugin states as one.
fn read_quantity(measure: &LonganMeasure, unit: &str) -> Result<Quantity, String> {
    let symmetry = measure.symmetry;
    let quantity = match measure.quantity {
        LONGAN_QUANTITY_AREA => Quantity::Area,
        LONGAN_QUANTITY_LENGTH => Quantity::Length,
        LONGAN_QUANTITY_CURVATURE => Quantity::Curvature,
        LONGAN_QUANTITY_MOMENT => Quantity::Moment,
        LONGAN_QUANTITY_COUNT => Quantity::Count,
        LONGAN_QUANTITY_RATIO => Quantity::Ratio,
        LONGAN_QUANTITY_ANGLE => Quantity::Angle { symmetry },
        LONGAN_QUANTITY_DEVIATION => Quantity::Deviation,
        LONGAN_QUANTITY_PERCENTILE => Quantity::Percentile,
        LONGAN_QUANTITY_NUMBER => Quantity::Number,
        0 => return Err("does not state its quantity, from LONGAN_QUANTITY_AREA to LONGAN_QUANTITY_NUMBER".to_owned()),
        other => return Err(format!("has the quantity {other}, which is not between 1 and {LONGAN_QUANTITY_NUMBER}")),
    };
    match quantity {
        Quantity::Angle { .. } if !(1..=LONGAN_RANK_MAX).contains(&symmetry) => {
            Err(format!("is an angle of the symmetry {symmetry}, which is not between 1 and {LONGAN_RANK_MAX}"))
        }
        Quantity::Angle { .. } if unit != "deg" => Err(format!("is an angle in '{unit}', and angles are in 'deg'")),
        Quantity::Angle { .. } => Ok(quantity),
        _ if symmetry != 0 => Err(format!("has the symmetry {symmetry}, and only an angle has one")),
        _ => Ok(quantity),
    }
}

fn check<T>(pointer: *const T, what: impl Fn() -> String) -> Result<(), Problem> {
    match pointer.is_null() {
        null if null || !pointer.is_aligned() => Err(Problem::Pointer { what: what(), null }),
        _ => Ok(()),
    }
}

fn check_size(what: &'static str, found: u32, expected: usize) -> Result<(), Problem> {
    if found as usize == expected { Ok(()) } else { Err(Problem::Size { what, found, expected }) }
}

/// A text on one line, of up to LONGAN_TEXT_SIZE bytes.
///
/// # Safety
/// The pointer is null, or leads to a zero or to LONGAN_TEXT_SIZE bytes.
unsafe fn read_line(pointer: *const c_char, what: &str) -> Result<String, Problem> {
    check(pointer, || what.to_owned())?;
    let fault = |fault: String| Problem::Text { what: what.to_owned(), fault };
    let mut bytes = Vec::new();
    for i in 0..LONGAN_TEXT_SIZE {
        // SAFETY: no byte before was the final zero, and there is one or there are this many.
        match unsafe { pointer.cast::<u8>().add(i).read() } {
            0 => {
                let text = String::from_utf8(bytes).map_err(|_| fault("is not UTF-8".to_owned()))?;
                return match text.chars().find(|c| c.is_control()) {
                    Some(c) => Err(fault(format!("has a control character, {}", c.escape_default()))),
                    None => Ok(text),
                };
            }
            byte => bytes.push(byte),
        }
    }
    Err(fault(format!("does not end within {LONGAN_TEXT_SIZE} bytes")))
}

/// As [`read_line`], but not an empty text.
///
/// # Safety
/// As [`read_line`].
unsafe fn read_text(pointer: *const c_char, what: &str) -> Result<String, Problem> {
    // SAFETY: the caller's duty.
    match unsafe { read_line(pointer, what) }? {
        text if text.trim().is_empty() => Err(Problem::Text { what: what.to_owned(), fault: "is empty".to_owned() }),
        text => Ok(text),
    }
}

/// A name as the command line takes it.
///
/// # Safety
/// As [`read_line`].
unsafe fn read_name(pointer: *const c_char, what: &str) -> Result<String, Problem> {
    // SAFETY: the caller's duty.
    let name = unsafe { read_text(pointer, what) }?;
    let fault = |fault: String| Problem::Text { what: what.to_owned(), fault };
    match is_name(&name) {
        true => Ok(name),
        false => Err(fault(format!(
            "is '{name}', not a lower-case letter followed by lower-case letters, digits and hyphens, up to {NAME_MAX}"
        ))),
    }
}

/// Whether this is a name as plugins and their measures have them.
pub(crate) fn is_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(allowed) && name.len() <= NAME_MAX
}
