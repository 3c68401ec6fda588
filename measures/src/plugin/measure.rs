//! A plugin's measure at work: calls of its function with windows as C has them.

use std::ffi::c_char;
use std::fmt::{self, Debug};
use std::sync::Arc;

use libloading::Library;
use num_complex::Complex64;

use super::description::Described;
use super::interface::{LONGAN_TEXT_SIZE, LonganComplex, LonganWindow, LonganWindows};
use crate::{Measure, MeasureError, Needs, Origin, PluginOrigin, Quantity, Window};

/// A measure of a plugin.
#[derive(Clone)]
pub struct PluginMeasure {
    pub(super) name: String,
    pub(super) described: Arc<Described>,
    pub(super) origin: PluginOrigin,
    // Last, since fields are dropped in their order: nothing of a library may be there without it.
    pub(super) _library: Arc<Library>,
}

impl PluginMeasure {
    /// The same measure by another name.
    pub(crate) fn renamed(self, name: String) -> Self {
        PluginMeasure { name, ..self }
    }

    fn error(&self, reason: String) -> MeasureError {
        MeasureError { measure: self.name.clone(), reason: format!("{reason}, says the plugin {}", self.origin) }
    }
}

impl Debug for PluginMeasure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PluginMeasure").field("name", &self.name).field("origin", &self.origin).finish_non_exhaustive()
    }
}

impl Measure for PluginMeasure {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn definition(&self) -> String {
        self.described.definition.clone()
    }

    fn quantity(&self) -> Quantity {
        self.described.quantity
    }

    fn unit(&self) -> &str {
        &self.described.unit
    }

    fn rank(&self) -> u32 {
        self.described.rank
    }

    fn needs(&self) -> Needs {
        self.described.needs.clone()
    }

    /// None where the plugin fails, too: [`evaluate_all`](Self::evaluate_all) says why.
    fn evaluate(&self, window: &Window<'_>) -> Option<f64> {
        let mut value = [f64::NAN];
        self.evaluate_all(&[*window], &mut value).ok()?;
        Some(value[0]).filter(|value| !value.is_nan())
    }

    fn evaluate_all(&self, windows: &[Window<'_>], values: &mut [f64]) -> Result<(), MeasureError> {
        let count = windows.len().min(values.len());
        if count == 0 {
            return Ok(());
        }
        let needs = &self.described.needs;
        let psi = self.described.psi_of(&windows[..count]);
        let given = |value: f64, needed: bool| if needed { value } else { 0.0 };
        let windows: Vec<LonganWindow> = windows[..count]
            .iter()
            .enumerate()
            .map(|(i, window)| LonganWindow {
                colatitude: window.centre.0,
                longitude: window.centre.1,
                masked_fraction: window.masked_fraction,
                area: given(window.area, needs.area),
                length: given(window.length, needs.length),
                curvature: given(window.curvature, needs.curvature),
                // Complex64 has the layout of two numbers, as LonganComplex has.
                psi: psi[i * needs.ranks.len()..].as_ptr().cast::<LonganComplex>(),
                resolution: window.resolution,
            })
            .collect();
        let windows = LonganWindows { count, windows: windows.as_ptr() };
        let values = &mut values[..count];
        values.fill(f64::NAN);
        let mut message = Message::default();
        let Described { evaluate, measure, .. } = &*self.described;
        // SAFETY: the library that has the function and the measure is loaded as long as `self._library` is there; the
        // windows, their moments, the values and the message have the sizes that the interface promises.
        let status = unsafe { evaluate(measure.0, &windows, values.as_mut_ptr(), message.as_mut_ptr()) };
        if status != 0 {
            return Err(self.error(message.text()));
        }
        values.iter_mut().filter(|value| value.is_infinite()).for_each(|value| *value = f64::NAN);
        Ok(())
    }

    fn origin(&self) -> Origin {
        Origin::Plugin(self.origin.clone())
    }
}

impl Described {
    /// The moments that are needed of all windows, one window after the other.
    fn psi_of(&self, windows: &[Window<'_>]) -> Vec<Complex64> {
        let ranks = &self.needs.ranks;
        // The windows of a run have the same ranks, so each is looked for once.
        let place = |rank: &u32| windows[0].ranks.binary_search(rank).ok();
        let places: Vec<Option<usize>> = ranks.iter().map(place).collect();
        let mut psi = Vec::with_capacity(windows.len() * ranks.len());
        for window in windows {
            let same = std::ptr::eq(window.ranks, windows[0].ranks);
            psi.extend(ranks.iter().zip(&places).map(|(&rank, &place)| match place {
                Some(place) if same => window.psi[place],
                _ => window.psi(rank),
            }));
        }
        psi
    }
}

/// Room for a plugin's message about a failure.
pub(super) struct Message([u8; LONGAN_TEXT_SIZE]);

impl Default for Message {
    fn default() -> Self {
        Message([0; LONGAN_TEXT_SIZE])
    }
}

impl Message {
    pub(super) fn as_mut_ptr(&mut self) -> *mut c_char {
        self.0.as_mut_ptr().cast()
    }

    /// The text that was written, on one line.
    pub(super) fn text(&self) -> String {
        let end = self.0.iter().position(|&byte| byte == 0).unwrap_or(self.0.len());
        match std::str::from_utf8(&self.0[..end]) {
            Ok(text) if text.trim().is_empty() => "it does not say why".to_owned(),
            Ok(text) => text.trim().trim_end_matches('.').replace(char::is_control, " "),
            Err(_) => "its message is not UTF-8".to_owned(),
        }
    }
}
