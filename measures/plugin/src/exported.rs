//! Measures as the C interface has them, which the macro exports.
//!
//! All `unsafe` of a plugin in Rust is here.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::sync::OnceLock;

use longan_measures::plugin::interface::*;
use longan_measures::{Measure, Quantity, Weight, Window};
use num_complex::Complex64;

/// A plugin's name, version and measures.
pub struct Exported {
    name: &'static str,
    version: &'static str,
    measures: fn() -> Vec<Box<dyn Measure>>,
    described: OnceLock<Result<Description, String>>,
}

/// A description that stays for ever.
struct Description(*const LonganPlugin);

// SAFETY: nothing of a description changes once it is made, and measures are Sync.
unsafe impl Send for Description {}
// SAFETY: as above.
unsafe impl Sync for Description {}

/// A text that longan lends to a plugin.
#[repr(transparent)]
pub struct Text(*const c_char);

/// Room for a message, which longan lends to a plugin. Only longan can make one.
#[repr(transparent)]
pub struct Message(*mut c_char);

impl Message {
    /// Writes as much of a text as there is room for.
    fn write(&self, text: &str) {
        if self.0.is_null() {
            return;
        }
        let text = text.replace('\0', " ");
        let end = (0..LONGAN_TEXT_SIZE.min(text.len() + 1)).rev().find(|&end| text.is_char_boundary(end)).unwrap_or(0);
        // SAFETY: longan gives room for LONGAN_TEXT_SIZE bytes, and `end` is less.
        unsafe {
            ptr::copy_nonoverlapping(text.as_ptr(), self.0.cast::<u8>(), end);
            self.0.add(end).write(0);
        }
    }
}

thread_local! {
    /// Where the last panic of this thread was.
    static PLACE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// The result, or the text of a panic.
fn caught<T>(of: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(of)).unwrap_or_else(|panic| {
        let said = said(&*panic);
        // The value that was thrown may panic anew when it is dropped.
        std::mem::forget(panic);
        Err(format!("it panicked{}: {said}", PLACE.take()))
    })
}

fn said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no reason is given".to_owned())
}

impl Exported {
    /// A plugin of this name and version, with the measures that the function makes.
    pub const fn new(name: &'static str, version: &'static str, measures: fn() -> Vec<Box<dyn Measure>>) -> Self {
        Exported { name, version, measures, described: OnceLock::new() }
    }

    /// Tells longan the version of the interface.
    pub fn handshake(&self, interface: u32, _host: Text) -> u32 {
        if interface == LONGAN_INTERFACE {
            // A library in Rust has a panic hook of its own, so this changes none of longan's: the message tells it all.
            let quiet = |info: &std::panic::PanicHookInfo<'_>| {
                let place = info.location().map(|at| format!(" at {at}")).unwrap_or_default();
                let _ = PLACE.try_with(|kept| kept.replace(place));
            };
            let _ = catch_unwind(|| std::panic::set_hook(Box::new(quiet)));
        }
        LONGAN_INTERFACE
    }

    /// Describes the plugin to longan.
    pub fn describe(&self, message: Message) -> *const LonganPlugin {
        match self.described.get_or_init(|| caught(|| self.description())) {
            Ok(description) => description.0,
            Err(reason) => {
                message.write(reason);
                ptr::null()
            }
        }
    }

    fn description(&self) -> Result<Description, String> {
        let measures = (self.measures)().into_iter().map(described).collect::<Result<Vec<_>, _>>()?;
        let measures: &'static [LonganMeasure] = measures.leak();
        let plugin = LonganPlugin {
            size: size_of::<LonganPlugin>() as u32,
            measure_size: size_of::<LonganMeasure>() as u32,
            window_size: size_of::<LonganWindow>() as u32,
            windows_size: size_of::<LonganWindows>() as u32,
            name: text(self.name.to_owned())?,
            version: text(self.version.to_owned())?,
            measures: measures.as_ptr(),
            measures_count: measures.len() as u32,
        };
        Ok(Description(Box::leak(Box::new(plugin))))
    }
}

/// A text that stays for ever.
fn text(text: String) -> Result<*const c_char, String> {
    let text = CString::new(text).map_err(|e| {
        let text = String::from_utf8_lossy(&e.into_vec()).into_owned();
        format!("the text {text:?} has a zero within")
    })?;
    Ok(text.into_raw())
}

/// A measure, with the needs that every call asks for.
struct Called {
    measure: Box<dyn Measure>,
    /// Whether ψ_0 is among the moments.
    has_psi0: bool,
    /// The other ranks.
    ranks: Vec<u32>,
}

fn described(measure: Box<dyn Measure>) -> Result<LonganMeasure, String> {
    let needs = measure.needs();
    let bit = |needed: bool, bit: u32| if needed { bit } else { 0 };
    let ranks: &'static [u32] = needs.ranks.leak();
    let (name, definition, unit, rank) =
        (measure.name(), measure.definition(), measure.unit().to_owned(), measure.rank());
    let quantity = measure.quantity();
    let has_psi0 = ranks.first() == Some(&0);
    let called = Called { measure, has_psi0, ranks: ranks[usize::from(has_psi0)..].to_vec() };
    Ok(LonganMeasure {
        size: size_of::<LonganMeasure>() as u32,
        rank,
        needs: bit(needs.area, LONGAN_NEEDS_AREA)
            | bit(needs.length, LONGAN_NEEDS_LENGTH)
            | bit(needs.curvature, LONGAN_NEEDS_CURVATURE),
        weight: match needs.weight {
            None => LONGAN_WEIGHT_EITHER,
            Some(Weight::Length) => LONGAN_WEIGHT_LENGTH,
            Some(Weight::Curvature) => LONGAN_WEIGHT_CURVATURE,
        },
        quantity: number_of(quantity)?,
        symmetry: quantity.symmetry().unwrap_or(0),
        ranks: ranks.as_ptr(),
        ranks_count: ranks.len() as u32,
        name: text(name)?,
        definition: text(definition)?,
        unit: text(unit)?,
        evaluate: Some(evaluate),
        context: ptr::from_ref::<Called>(Box::leak(Box::new(called))).cast(),
    })
}

/// The number that the interface has for a quantity.
fn number_of(quantity: Quantity) -> Result<u32, String> {
    Ok(match quantity {
        Quantity::Area => LONGAN_QUANTITY_AREA,
        Quantity::Length => LONGAN_QUANTITY_LENGTH,
        Quantity::Curvature => LONGAN_QUANTITY_CURVATURE,
        Quantity::Moment => LONGAN_QUANTITY_MOMENT,
        Quantity::Count => LONGAN_QUANTITY_COUNT,
        Quantity::Ratio => LONGAN_QUANTITY_RATIO,
        Quantity::Angle { .. } => LONGAN_QUANTITY_ANGLE,
        Quantity::Deviation => LONGAN_QUANTITY_DEVIATION,
        Quantity::Percentile => LONGAN_QUANTITY_PERCENTILE,
        Quantity::Number => LONGAN_QUANTITY_NUMBER,
        other => return Err(format!("the interface has no number for the quantity '{other}'")),
    })
}

/// Evaluates windows with the measure that the context names.
unsafe extern "C" fn evaluate(
    measure: *const LonganMeasure,
    windows: *const LonganWindows,
    values: *mut f64,
    message: *mut c_char,
) -> i32 {
    let done = caught(|| {
        // SAFETY: longan hands back a measure of the description, whose context is a Called that stays for ever.
        let called = unsafe { &*(*measure).context.cast::<Called>() };
        // SAFETY: there are as many windows, and as much room for values, as the interface says.
        let (windows, values) = unsafe {
            let LonganWindows { count, windows } = *windows;
            (std::slice::from_raw_parts(windows, count), std::slice::from_raw_parts_mut(values, count))
        };
        let first = usize::from(called.has_psi0);
        let window = |window: &LonganWindow| {
            // SAFETY: there is a moment for each rank needed, and LonganComplex has the layout of Complex64.
            let psi = unsafe { std::slice::from_raw_parts(window.psi.cast::<Complex64>(), first + called.ranks.len()) };
            Window {
                centre: (window.colatitude, window.longitude),
                masked_fraction: window.masked_fraction,
                area: window.area,
                length: window.length,
                curvature: window.curvature,
                psi0: if called.has_psi0 { psi[0].re } else { 0.0 },
                ranks: &called.ranks,
                psi: &psi[first..],
                resolution: window.resolution,
            }
        };
        let windows: Vec<Window<'_>> = windows.iter().map(window).collect();
        called.measure.evaluate_all(&windows, values).map_err(|e| e.reason)
    });
    match done {
        Ok(()) => 0,
        Err(reason) => {
            Message(message).write(&reason);
            1
        }
    }
}
