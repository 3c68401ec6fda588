//! A plugin that panics when it is asked for its measures, for the tests.

use longan_plugin::{Measure, Needs, Quantity, Window};

struct Unready;

impl Unready {
    fn new() -> Self {
        panic!("the table of constants is missing")
    }
}

impl Measure for Unready {
    fn name(&self) -> String {
        "unready".to_owned()
    }

    fn definition(&self) -> String {
        "nothing".to_owned()
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
        Needs::default()
    }

    fn evaluate(&self, _: &Window<'_>) -> Option<f64> {
        None
    }
}

longan_plugin::export!("unready": Unready::new());
