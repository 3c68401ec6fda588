//! The structures that a plugin and longan hand to each other, laid out as C does.
//!
//! `include/longan_plugin.h` is made from this file. Each change here changes [`LONGAN_INTERFACE`] too.

use std::ffi::{c_char, c_void};

/// Version of this interface. A plugin works with a longan of the same version only.
pub const LONGAN_INTERFACE: u32 = 3;

/// Most bytes of a text, its final zero among them. Texts are UTF-8, on one line.
pub const LONGAN_TEXT_SIZE: usize = 1024;

/// Most measures of a plugin.
pub const LONGAN_MEASURES_MAX: u32 = 256;

/// Largest rank that a measure may ask for.
pub const LONGAN_RANK_MAX: u32 = 1000;

/// Bit of `needs`: W0, the body's area.
pub const LONGAN_NEEDS_AREA: u32 = 1;
/// Bit of `needs`: W1, the contour's length.
pub const LONGAN_NEEDS_LENGTH: u32 = 2;
/// Bit of `needs`: W2, the contour's total curvature.
pub const LONGAN_NEEDS_CURVATURE: u32 = 4;

/// A measure of tensors of either weight.
pub const LONGAN_WEIGHT_EITHER: u32 = 0;
/// A measure of tensors that are weighted by length, W_1.
pub const LONGAN_WEIGHT_LENGTH: u32 = 1;
/// A measure of tensors that are weighted by curvature, W_2.
pub const LONGAN_WEIGHT_CURVATURE: u32 = 2;

/// An area on the sphere.
pub const LONGAN_QUANTITY_AREA: u32 = 1;
/// A length on the sphere.
pub const LONGAN_QUANTITY_LENGTH: u32 = 2;
/// A total curvature, which has a sign.
pub const LONGAN_QUANTITY_CURVATURE: u32 = 3;
/// A moment psi_s by magnitude, or an eigenvalue: a length, or of tensors weighted by curvature a curvature.
pub const LONGAN_QUANTITY_MOMENT: u32 = 4;
/// A number of things.
pub const LONGAN_QUANTITY_COUNT: u32 = 5;
/// A quotient of quantities of one kind.
pub const LONGAN_QUANTITY_RATIO: u32 = 6;
/// A direction in degrees, from south towards east, up to 360 degrees over the measure's `symmetry`.
pub const LONGAN_QUANTITY_ANGLE: u32 = 7;
/// A deviation from an expected value in standard deviations, about 0.
pub const LONGAN_QUANTITY_DEVIATION: u32 = 8;
/// A rank among other values, from 0 to 100.
pub const LONGAN_QUANTITY_PERCENTILE: u32 = 9;
/// Any other number.
pub const LONGAN_QUANTITY_NUMBER: u32 = 10;

/// A complex number.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LonganComplex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

/// The moments of one window, the mean over the thresholds, divided by the share of it that is not masked.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LonganWindow {
    /// Colatitude of the centre in degrees.
    pub colatitude: f64,
    /// Longitude of the centre in degrees.
    pub longitude: f64,
    /// Share of the window's cells that are masked, below 1.
    pub masked_fraction: f64,
    /// W0 in steradian; 0 unless needed.
    pub area: f64,
    /// W1 in radians; 0 unless needed.
    pub length: f64,
    /// W2 in radians; 0 unless needed.
    pub curvature: f64,
    /// psi_s for each of the measure's `ranks`, in their order: the sum of L exp(i s phi) over the contour's pieces,
    /// phi the angle of their outward normal from south towards east. psi_0 is real.
    pub psi: *const LonganComplex,
    /// The accuracy of psi_s, s from 1, as a share of the contour's weight: values that differ by less are not told apart.
    pub resolution: f64,
}

/// Windows to be evaluated in one call.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LonganWindows {
    /// Number of windows, at least 1.
    pub count: usize,
    /// The windows.
    pub windows: *const LonganWindow,
}

/// A measure of a plugin.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LonganMeasure {
    /// sizeof(LonganMeasure).
    pub size: u32,
    /// The rank of the tensor that it belongs to.
    pub rank: u32,
    /// LONGAN_NEEDS_... or'ed: which of W0, W1 and W2 it needs.
    pub needs: u32,
    /// LONGAN_WEIGHT_...: the tensors that it is defined for.
    pub weight: u32,
    /// LONGAN_QUANTITY_...: the kind of quantity that it is; how values are drawn, averaged and compared follows from
    /// it, and so does whether windows with hardly any contour are left out (ratios and angles are).
    pub quantity: u32,
    /// Of an angle the number of turns within 360 degrees that change nothing, from 1 to LONGAN_RANK_MAX; of other
    /// quantities 0.
    pub symmetry: u32,
    /// The ranks of the moments psi_s that it needs, ascending, 0 for psi_0; may be NULL for none.
    pub ranks: *const u32,
    /// The number of `ranks`.
    pub ranks_count: u32,
    /// The name on the command line: a lower-case letter, then lower-case letters, digits and hyphens, up to 60.
    pub name: *const c_char,
    /// The definition in one line, with the formula.
    pub definition: *const c_char,
    /// The unit, in ASCII: "sr", "rad", "deg", or "" for a pure number; of an angle "deg".
    pub unit: *const c_char,
    /// Evaluates windows: `values` has room for one number for each, in the measure's unit, and NaN says that the
    /// measure is not defined there. An infinite value is taken as not defined.
    ///
    /// Returns 0, or anything else for a failure, which ends the run. Then `message`, which has room for
    /// LONGAN_TEXT_SIZE bytes and is empty at first, may hold a text for the user.
    ///
    /// Many threads call this at the same time. Nothing of the arguments may be kept but the measure itself.
    pub evaluate: Option<
        unsafe extern "C" fn(
            measure: *const LonganMeasure,
            windows: *const LonganWindows,
            values: *mut f64,
            message: *mut c_char,
        ) -> i32,
    >,
    /// A pointer of the plugin's own, which longan hands back unread; may be NULL.
    pub context: *const c_void,
}

/// A plugin. It and all that it points to stay as they are for as long as the library is loaded.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LonganPlugin {
    /// sizeof(LonganPlugin).
    pub size: u32,
    /// sizeof(LonganMeasure).
    pub measure_size: u32,
    /// sizeof(LonganWindow).
    pub window_size: u32,
    /// sizeof(LonganWindows).
    pub windows_size: u32,
    /// The plugin's name, of the same form as a measure's.
    pub name: *const c_char,
    /// The plugin's own version, such as "0.1.0".
    pub version: *const c_char,
    /// Its measures.
    pub measures: *const LonganMeasure,
    /// The number of `measures`.
    pub measures_count: u32,
}

/// `longan_plugin_handshake`, which every plugin exports and longan calls first: tells the plugin longan's version of
/// this interface and longan's own version, such as "0.1.0", and returns LONGAN_INTERFACE.
pub type LonganHandshake = unsafe extern "C" fn(interface_version: u32, host_version: *const c_char) -> u32;

/// `longan_plugin`, which every plugin exports and longan calls once, if the versions are the same. Returns NULL for a
/// failure; then `message`, which has room for LONGAN_TEXT_SIZE bytes and is empty at first, may hold a text for the
/// user.
pub type LonganDescribe = unsafe extern "C" fn(message: *mut c_char) -> *const LonganPlugin;
