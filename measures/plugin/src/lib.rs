//! Measures of your own for longan, loaded from a library when it runs.
//!
//! Implement [`Measure`] as the built-ins do, [`export!`] it from a crate of the type `cdylib`, and check it with
//! [`testing::check`]. `longan plugin new NAME` writes such a crate. Nothing of it needs `unsafe`; a panic becomes an
//! error that the user sees.
//!
//! ```
//! use longan_plugin::{Measure, Needs, Quantity, Window};
//!
//! /// The share of the contour that lies along one direction.
//! struct Share;
//!
//! impl Measure for Share {
//!     fn name(&self) -> String {
//!         "share".to_owned()
//!     }
//!
//!     fn definition(&self) -> String {
//!         "normalised anisotropy of rank 2, |ψ_2|/ψ_0".to_owned()
//!     }
//!
//!     fn quantity(&self) -> Quantity {
//!         Quantity::Ratio
//!     }
//!
//!     fn unit(&self) -> &str {
//!         ""
//!     }
//!
//!     fn rank(&self) -> u32 {
//!         2
//!     }
//!
//!     fn needs(&self) -> Needs {
//!         Needs { ranks: vec![0, 2], ..Needs::default() }
//!     }
//!
//!     fn evaluate(&self, window: &Window<'_>) -> Option<f64> {
//!         (window.psi0 > 0.0).then(|| window.psi(2).norm() / window.psi0)
//!     }
//! }
//!
//! longan_plugin::export!("shares": Share);
//!
//! longan_plugin::testing::check(&Share);
//! ```

// A panic that ends the process cannot become an error.
#[cfg(panic = "abort")]
compile_error!("a plugin of longan must be built with panic = \"unwind\", so that a panic cannot end longan itself");

mod exported;

pub use longan_measures::{Measure, MeasureError, Needs, Quantity, Weight, Window, testing};
pub use num_complex::Complex64;

#[doc(hidden)]
pub use exported::{Exported, Message, Text};
#[doc(hidden)]
pub use longan_measures::plugin::interface::{self, LonganPlugin};

/// Exports measures from a library as a plugin: its name, then the measures.
///
/// The name is a lower-case letter followed by lower-case letters, digits and hyphens. It stands before that of a
/// measure, `shares:share`, where the latter alone is ambiguous.
///
/// ```text
/// longan_plugin::export!("shares": Share, Other { rank: 3 });
/// ```
#[macro_export]
macro_rules! export {
    ($name:literal: $($measure:expr),+ $(,)?) => {
        const _: () = {
            static EXPORTED: $crate::Exported = $crate::Exported::new(
                $name,
                env!("CARGO_PKG_VERSION"),
                || vec![$(Box::new($measure) as Box<dyn $crate::Measure>),+],
            );

            #[unsafe(no_mangle)]
            extern "C" fn longan_plugin_handshake(interface: u32, host: $crate::Text) -> u32 {
                EXPORTED.handshake(interface, host)
            }

            #[unsafe(no_mangle)]
            extern "C" fn longan_plugin(message: $crate::Message) -> *const $crate::LonganPlugin {
                EXPORTED.describe(message)
            }
        };
    };
}
