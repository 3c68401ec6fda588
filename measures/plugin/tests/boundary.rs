//! The C interface of a plugin in Rust, called as longan calls it but without loading a library.

use std::ffi::{CStr, c_char};

use longan_plugin::{Exported, LonganPlugin, Measure, MeasureError, Needs, Quantity, Weight, Window};
use longan_plugin::{Message, Text, interface::*};

/// Measures by their number.
struct Numbered(u32);

impl Measure for Numbered {
    fn name(&self) -> String {
        ["sum", "panicking", "failing", "none", "bad\0name"][self.0 as usize].to_owned()
    }

    fn definition(&self) -> String {
        format!("measure {}", self.0)
    }

    fn quantity(&self) -> Quantity {
        match self.0 {
            0 => Quantity::Length,
            1 => Quantity::Angle { symmetry: 5 },
            _ => Quantity::Number,
        }
    }

    fn unit(&self) -> &str {
        if self.0 == 1 { "deg" } else { "rad" }
    }

    fn rank(&self) -> u32 {
        self.0
    }

    fn needs(&self) -> Needs {
        match self.0 {
            0 => Needs { area: true, ranks: vec![0, 3], weight: Some(Weight::Curvature), ..Needs::default() },
            1 => Needs { curvature: true, ranks: vec![5], ..Needs::default() },
            _ => Needs::default(),
        }
    }

    fn evaluate(&self, window: &Window<'_>) -> Option<f64> {
        match self.0 {
            0 => Some(window.area + window.psi0 + window.psi(3).im + window.centre.0 + window.centre.1),
            1 => panic!("{}", "ψ".repeat(1000)),
            _ => None,
        }
    }

    fn evaluate_all(&self, windows: &[Window<'_>], values: &mut [f64]) -> Result<(), MeasureError> {
        for (value, window) in values.iter_mut().zip(windows) {
            *value = self.evaluate(window).unwrap_or(f64::NAN);
        }
        let error = || MeasureError { measure: self.name(), reason: "a zero\0within".to_owned() };
        if self.0 == 2 { Err(error()) } else { Ok(()) }
    }
}

longan_plugin::export!("numbers": Numbered(0), Numbered(1), Numbered(2), Numbered(3));

unsafe extern "C" {
    safe fn longan_plugin_handshake(interface: u32, host: *const c_char) -> u32;
    fn longan_plugin(message: *mut c_char) -> *const LonganPlugin;
}

fn text(pointer: *const c_char) -> &'static str {
    // SAFETY: the texts of a plugin stay for ever.
    unsafe { CStr::from_ptr(pointer) }.to_str().unwrap()
}

fn measures() -> &'static [LonganMeasure] {
    let mut message = [0; LONGAN_TEXT_SIZE];
    // SAFETY: the message has the room that it needs, and what is returned stays for ever.
    unsafe {
        let plugin = &*longan_plugin(message.as_mut_ptr());
        assert_eq!((text(plugin.name), text(plugin.version)), ("numbers", env!("CARGO_PKG_VERSION")));
        std::slice::from_raw_parts(plugin.measures, plugin.measures_count as usize)
    }
}

/// The status, the values and the message for windows of these colatitudes.
fn evaluated(measure: &LonganMeasure, colatitudes: &[f64]) -> (i32, Vec<f64>, Vec<u8>) {
    let ranks = measure.ranks_count as usize;
    let psi = [LonganComplex { re: 2.0, im: 0.0 }, LonganComplex { re: 9.0, im: 0.5 }];
    assert!(ranks <= psi.len());
    let window = |&colatitude: &f64| LonganWindow {
        colatitude,
        longitude: 0.25,
        masked_fraction: 0.0,
        area: 4.0,
        length: 0.0,
        curvature: 0.0,
        psi: psi.as_ptr(),
        resolution: 1e-12,
    };
    let windows: Vec<LonganWindow> = colatitudes.iter().map(window).collect();
    let windows = LonganWindows { count: windows.len(), windows: windows.as_ptr() };
    let mut values = vec![f64::NAN; colatitudes.len()];
    let mut message = vec![0u8; LONGAN_TEXT_SIZE];
    // SAFETY: all has the sizes that the interface promises.
    let status =
        unsafe { measure.evaluate.unwrap()(measure, &windows, values.as_mut_ptr(), message.as_mut_ptr().cast()) };
    let end = message.iter().position(|&byte| byte == 0).expect("an end of the message");
    message.truncate(end);
    (status, values, message)
}

#[test]
fn the_version_is_told() {
    // Another version, so that no panic hook is set here.
    assert_eq!(longan_plugin_handshake(LONGAN_INTERFACE + 1, c"0.0.1".as_ptr()), LONGAN_INTERFACE);
}

#[test]
fn measures_are_described_as_they_are() {
    let [sum, panicking, ..] = measures() else { panic!() };
    assert_eq!([text(sum.name), text(sum.definition), text(sum.unit)], ["sum", "measure 0", "rad"]);
    assert_eq!((sum.needs, sum.weight, sum.ranks_count), (LONGAN_NEEDS_AREA, LONGAN_WEIGHT_CURVATURE, 2));
    assert_eq!((panicking.needs, panicking.weight, panicking.rank), (LONGAN_NEEDS_CURVATURE, LONGAN_WEIGHT_EITHER, 1));
    assert_eq!((sum.quantity, sum.symmetry), (LONGAN_QUANTITY_LENGTH, 0));
    assert_eq!((panicking.quantity, panicking.symmetry), (LONGAN_QUANTITY_ANGLE, 5));
    // Once is enough.
    assert_eq!(measures().as_ptr(), measures().as_ptr());
}

#[test]
fn windows_are_evaluated() {
    let (status, values, message) = evaluated(&measures()[0], &[1.0, 10.0, 100.0]);
    assert_eq!((status, values, message.len()), (0, vec![7.75, 16.75, 106.75], 0));
    let (status, values, _) = evaluated(&measures()[3], &[1.0, 2.0]);
    assert!(status == 0 && values.iter().all(|value| value.is_nan()));
}

#[test]
fn panics_and_failures_become_messages() {
    let (status, _, message) = evaluated(&measures()[1], &[1.0]);
    let message = String::from_utf8(message).expect("whole characters");
    assert!(status != 0 && message.starts_with("it panicked") && message.ends_with('ψ') && message.len() > 1000);
    let (status, _, message) = evaluated(&measures()[2], &[1.0]);
    assert_eq!((status != 0, &message[..]), (true, &b"a zero within"[..]));
}

#[test]
fn threads_share_a_plugin() {
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                assert_eq!(evaluated(&measures()[0], &[1.0]).1, [7.75]);
                assert_ne!(evaluated(&measures()[1], &[1.0]).0, 0);
            });
        }
    });
}

#[test]
fn what_cannot_be_described_is_refused_with_a_reason() {
    static BAD: Exported = Exported::new("bad", "1", || vec![Box::new(Numbered(4))]);
    let mut message = [1u8; LONGAN_TEXT_SIZE];
    // SAFETY: a message as longan lends it.
    let lent = unsafe { std::mem::transmute::<*mut u8, Message>(message.as_mut_ptr()) };
    assert!(BAD.describe(lent).is_null());
    let said = CStr::from_bytes_until_nul(&message).unwrap().to_str().unwrap();
    assert!(said.contains("bad\\0name") && said.contains("zero within"), "{said}");
    // SAFETY: a text as longan lends it.
    let host = unsafe { std::mem::transmute::<*const c_char, Text>(c"0.0.1".as_ptr()) };
    assert_eq!(BAD.handshake(0, host), LONGAN_INTERFACE);
}
