//! A plugin whose measures fail in every way, for the tests.

use longan_plugin::{Measure, MeasureError, Needs, Quantity, Window};

/// How to fail.
#[derive(Clone, Copy, Debug)]
enum Misbehaving {
    Panicking,
    Throwing,
    Failing,
    /// In half of the sphere only.
    Later,
}

impl Measure for Misbehaving {
    fn name(&self) -> String {
        format!("{self:?}").to_lowercase()
    }

    fn definition(&self) -> String {
        "a failure".to_owned()
    }

    fn quantity(&self) -> Quantity {
        Quantity::Number
    }

    fn unit(&self) -> &str {
        ""
    }

    fn rank(&self) -> u32 {
        0
    }

    fn needs(&self) -> Needs {
        Needs { length: true, ..Needs::default() }
    }

    fn evaluate(&self, window: &Window<'_>) -> Option<f64> {
        match self {
            Misbehaving::Panicking => panic!("no value at colatitude {}", window.centre.0),
            Misbehaving::Throwing => std::panic::panic_any(7),
            Misbehaving::Later if window.centre.0 > 90.0 => panic!("only the north is known"),
            Misbehaving::Later | Misbehaving::Failing => Some(window.length),
        }
    }

    fn evaluate_all(&self, windows: &[Window<'_>], values: &mut [f64]) -> Result<(), MeasureError> {
        if let Misbehaving::Failing = self {
            return Err(MeasureError { measure: self.name(), reason: "the instrument is off".to_owned() });
        }
        for (value, window) in values.iter_mut().zip(windows) {
            *value = self.evaluate(window).unwrap_or(f64::NAN);
        }
        Ok(())
    }
}

longan_plugin::export!("misbehaving": Misbehaving::Panicking, Misbehaving::Throwing, Misbehaving::Failing, Misbehaving::Later);
