//! Stored numbers as the field's values: missing ones masked, packed ones scaled.
//!
//! As CF section 8.1 has it: values are compared with fill values and valid ranges as they are stored, then multiplied
//! by `scale_factor`, then `add_offset` is added, in double precision. Where a variable names no `_FillValue`, the
//! NetCDF library's default for its type counts, as the NetCDF User's Guide has it; bytes have no default.

use std::ops::Range;

use crate::dataset::{Array, Attribute, Dataset, Kind, Problem, Variable};
use crate::error::Error;

/// The value that libnetcdf puts where real numbers were never written.
const DEFAULT_REAL: f64 = 9.969_209_968_386_869e36;

/// The part of a variable within these ranges of indices, unpacked, NaN where missing.
///
/// # Errors
/// Where the file cannot be read, the variable holds no numbers, or its attributes contradict the conventions.
pub(crate) fn values(dataset: &dyn Dataset, variable: &Variable, ranges: &[Range<usize>]) -> Result<Vec<f64>, Error> {
    let packing = Packing::of(variable)?;
    match dataset.read(variable, ranges)? {
        Array::Real(mut values) => {
            let single = variable.kind == Kind::Real32;
            values.iter_mut().for_each(|v| *v = packing.unpack_real(*v, single));
            Ok(values)
        }
        Array::Whole(values) => Ok(values.into_iter().map(|v| packing.unpack_whole(v)).collect()),
        Array::Text(_) => Err(no_numbers(variable, "text").into()),
    }
}

fn no_numbers(variable: &Variable, found: &'static str) -> Problem {
    Problem::VariableKind { variable: variable.path(), found }
}

/// The way in which a variable's values are stored.
struct Packing {
    scale: Option<f64>,
    offset: Option<f64>,
    /// Values that stand for none, in the storage's type: as real and as whole numbers.
    fills: Vec<f64>,
    whole_fills: Vec<i64>,
    /// The valid range.
    valid: (f64, f64),
    /// Whether that is one of unpacked values.
    valid_unpacked: bool,
    sign: Sign,
}

/// Whether whole numbers are meant with the other sign than they are stored with (`_Unsigned`).
#[derive(Clone, Copy)]
enum Sign {
    AsStored,
    Unsigned { bits: u32 },
    Signed { bits: u32 },
}

impl Sign {
    fn of(variable: &Variable) -> Self {
        let meant = variable.text("_Unsigned").map(str::to_ascii_lowercase);
        match (variable.kind, meant.as_deref()) {
            (Kind::Integer { bits: bits @ ..64, signed: true }, Some("true")) => Sign::Unsigned { bits },
            (Kind::Integer { bits: bits @ ..64, signed: false }, Some("false")) => Sign::Signed { bits },
            _ => Sign::AsStored,
        }
    }

    fn apply(self, value: i64) -> i64 {
        match self {
            Sign::AsStored => value,
            Sign::Unsigned { bits } => value & ((1 << bits) - 1),
            Sign::Signed { bits } => value << (64 - bits) >> (64 - bits),
        }
    }
}

impl Packing {
    fn of(variable: &Variable) -> Result<Self, Problem> {
        let single = variable.kind == Kind::Real32;
        let whole = match variable.kind {
            Kind::Real32 | Kind::Real64 => false,
            Kind::Integer { .. } => true,
            Kind::Text => return Err(no_numbers(variable, "text")),
            Kind::Other => return Err(no_numbers(variable, "neither numbers nor text")),
        };
        let sign = Sign::of(variable);
        let scale = number(variable, "scale_factor")?;
        let offset = number(variable, "add_offset")?;
        let mut packing = Packing {
            scale,
            offset,
            fills: Vec::new(),
            whole_fills: Vec::new(),
            valid: (f64::NEG_INFINITY, f64::INFINITY),
            valid_unpacked: false,
            sign,
        };
        for name in ["_FillValue", "missing_value"] {
            match variable.attribute(name) {
                None => {}
                Some(Attribute::Whole(fills)) => {
                    packing.fills.extend(fills.iter().map(|&fill| as_stored(fill as f64, single)));
                    packing.whole_fills.extend(fills.iter().map(|&fill| sign.apply(fill)));
                }
                Some(Attribute::Real(fills)) => {
                    packing.fills.extend(fills.iter().map(|&fill| as_stored(fill, single)));
                    // One that is no whole number, such as NaN, is no stored value either.
                    let whole = fills.iter().filter(|fill| fill.fract() == 0.0 && fill.abs() < 2f64.powi(63));
                    packing.whole_fills.extend(whole.map(|&fill| sign.apply(fill as i64)));
                }
                Some(other) => return Err(wrong(variable, name, other, "a number or several")),
            }
        }
        if variable.attribute("_FillValue").is_none() {
            packing.fills.push(as_stored(DEFAULT_REAL, single));
            packing.whole_fills.extend(default_whole(variable.kind).map(|fill| sign.apply(fill)));
        }
        let mut limit = |value: f64, real: bool| {
            packing.valid_unpacked |= whole && real && (scale.is_some() || offset.is_some());
            match (whole, real) {
                (true, false) => sign.apply(value as i64) as f64,
                _ => as_stored(value, single),
            }
        };
        let mut valid = packing.valid;
        for name in ["valid_min", "valid_max", "valid_range"] {
            let Some(attribute) = variable.attribute(name) else { continue };
            let (numbers, real) = match attribute {
                Attribute::Real(numbers) => (numbers.clone(), true),
                Attribute::Whole(numbers) => (numbers.iter().map(|&n| n as f64).collect(), false),
                other => return Err(wrong(variable, name, other, "a number")),
            };
            match (name, &numbers[..]) {
                ("valid_min", &[low]) => valid.0 = limit(low, real),
                ("valid_max", &[high]) => valid.1 = limit(high, real),
                ("valid_range", &[low, high]) => valid = (limit(low, real), limit(high, real)),
                ("valid_range", _) => return Err(wrong(variable, name, attribute, "two numbers")),
                _ => return Err(wrong(variable, name, attribute, "one number")),
            }
        }
        packing.valid = valid;
        Ok(packing)
    }

    fn unpack_real(&self, stored: f64, single: bool) -> f64 {
        if self.fills.contains(&as_stored(stored, single)) {
            return f64::NAN;
        }
        self.unpack(stored)
    }

    fn unpack_whole(&self, stored: i64) -> f64 {
        let stored = self.sign.apply(stored);
        if self.whole_fills.contains(&stored) {
            return f64::NAN;
        }
        self.unpack(stored as f64)
    }

    fn unpack(&self, stored: f64) -> f64 {
        let scaled = self.scale.map_or(stored, |scale| stored * scale);
        let unpacked = self.offset.map_or(scaled, |offset| scaled + offset);
        let judged = if self.valid_unpacked { unpacked } else { stored };
        // A limit that is NaN is none.
        if judged < self.valid.0 || judged > self.valid.1 { f64::NAN } else { unpacked }
    }
}

/// A number as the storage has it, in single precision or double.
fn as_stored(value: f64, single: bool) -> f64 {
    if single { f64::from(value as f32) } else { value }
}

/// The value that libnetcdf puts where whole numbers were never written.
fn default_whole(kind: Kind) -> Option<i64> {
    let Kind::Integer { bits, signed } = kind else { return None };
    match (bits, signed) {
        (16, true) => Some(-32767),
        (16, false) => Some(65535),
        (32, true) => Some(-2_147_483_647),
        (32, false) => Some(4_294_967_295),
        (64, true) => Some(-9_223_372_036_854_775_806),
        _ => None,
    }
}

/// An attribute that is one finite number.
fn number(variable: &Variable, name: &'static str) -> Result<Option<f64>, Problem> {
    let number = match variable.attribute(name) {
        None => return Ok(None),
        Some(Attribute::Real(numbers)) if numbers.len() == 1 => numbers[0],
        Some(Attribute::Whole(numbers)) if numbers.len() == 1 => numbers[0] as f64,
        Some(other) => return Err(wrong(variable, name, other, "one number")),
    };
    if number.is_finite() {
        Ok(Some(number))
    } else {
        Err(wrong(variable, name, &Attribute::Real(vec![number]), "a finite number"))
    }
}

fn wrong(variable: &Variable, attribute: &'static str, found: &Attribute, expected: &'static str) -> Problem {
    let found = match found {
        Attribute::Text(text) => format!("the text '{}'", text.escape_debug()),
        Attribute::Real(numbers) if numbers.len() == 1 => numbers[0].to_string(),
        Attribute::Whole(numbers) if numbers.len() == 1 => numbers[0].to_string(),
        Attribute::Real(numbers) => format!("{} numbers", numbers.len()),
        Attribute::Whole(numbers) => format!("{} numbers", numbers.len()),
        Attribute::Json(_) => "neither text nor numbers".to_owned(),
    };
    Problem::AttributeValue { variable: variable.path(), attribute, found, expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variable(kind: Kind, attributes: &[(&str, Attribute)]) -> Variable {
        let attributes = attributes.iter().map(|(n, a)| ((*n).to_owned(), a.clone())).collect();
        Variable { name: "v".into(), group: "/".into(), kind, dimensions: vec![], attributes }
    }

    fn packing(kind: Kind, attributes: &[(&str, Attribute)]) -> Packing {
        Packing::of(&variable(kind, attributes)).unwrap()
    }

    const I8: Kind = Kind::Integer { bits: 8, signed: true };
    const U8: Kind = Kind::Integer { bits: 8, signed: false };
    const I16: Kind = Kind::Integer { bits: 16, signed: true };
    const I64: Kind = Kind::Integer { bits: 64, signed: true };

    fn real(x: f64) -> Attribute {
        Attribute::Real(vec![x])
    }

    fn whole(x: i64) -> Attribute {
        Attribute::Whole(vec![x])
    }

    #[test]
    fn scale_then_offset_in_double() {
        let p = packing(I16, &[("scale_factor", real(-1.5)), ("add_offset", real(10.0))]);
        assert_eq!([p.unpack_whole(2), p.unpack_whole(-4)], [7.0, 16.0]);
        let p = packing(Kind::Real32, &[("scale_factor", whole(2))]);
        assert_eq!(p.unpack_real(0.25, true), 0.5);
        // The product, then the sum: no fused operation that rounds once.
        let (s, o) = (0.1, -0.3);
        let p = packing(I16, &[("scale_factor", real(s)), ("add_offset", real(o))]);
        assert_eq!(p.unpack_whole(3), 3.0 * s + o);
    }

    #[test]
    fn fills_are_compared_as_stored() {
        // A double attribute for single precision, and the reverse.
        let p = packing(Kind::Real32, &[("missing_value", real(1e20)), ("_FillValue", real(-9.99e8))]);
        assert!(p.unpack_real(f64::from(1e20f32), true).is_nan());
        assert!(p.unpack_real(f64::from(-9.99e8f32), true).is_nan());
        assert_eq!(p.unpack_real(1e19, true), 1e19);
        let p = packing(Kind::Real64, &[("missing_value", real(1e20))]);
        assert!(p.unpack_real(1e20, false).is_nan());
        assert_eq!(p.unpack_real(f64::from(1e20f32), false), f64::from(1e20f32));
        // Whole numbers that double precision cannot tell apart.
        let p = packing(I64, &[("_FillValue", whole(i64::MAX))]);
        assert!(p.unpack_whole(i64::MAX).is_nan() && !p.unpack_whole(i64::MAX - 1).is_nan());
        // Several, and real ones for whole numbers.
        let p = packing(I16, &[("missing_value", Attribute::Real(vec![7.0, f64::NAN, 8.0, 0.5]))]);
        assert!(p.unpack_whole(7).is_nan() && p.unpack_whole(8).is_nan());
        assert_eq!(p.unpack_whole(0), 0.0);
    }

    #[test]
    fn default_fills_where_none_is_named() {
        assert!(packing(I16, &[]).unpack_whole(-32767).is_nan());
        assert!(packing(Kind::Real32, &[]).unpack_real(f64::from(9.969_21e36f32), true).is_nan());
        assert!(packing(Kind::Real64, &[("missing_value", real(1.0))]).unpack_real(DEFAULT_REAL, false).is_nan());
        assert_eq!(packing(I16, &[("_FillValue", real(f64::NAN))]).unpack_whole(-32767), -32767.0);
        for v in [-128, -127, 127] {
            assert_eq!(packing(I8, &[]).unpack_whole(v), v as f64);
        }
    }

    #[test]
    fn valid_ranges() {
        let packed = packing(I16, &[("scale_factor", real(0.5)), ("valid_range", Attribute::Whole(vec![0, 10]))]);
        assert_eq!([packed.unpack_whole(0), packed.unpack_whole(10)], [0.0, 5.0]);
        assert!(packed.unpack_whole(-1).is_nan() && packed.unpack_whole(11).is_nan());
        // Real limits of packed whole numbers are those of the unpacked ones.
        let unpacked = packing(I16, &[("scale_factor", real(0.5)), ("valid_max", real(10.0))]);
        assert_eq!(unpacked.unpack_whole(20), 10.0);
        assert!(unpacked.unpack_whole(21).is_nan());
        // In single precision, the limit itself is valid.
        let single = packing(Kind::Real32, &[("valid_max", real(273.1))]);
        assert!(!single.unpack_real(f64::from(273.1f32), true).is_nan());
        assert!(single.unpack_real(f64::from(273.1f32.next_up()), true).is_nan());
    }

    #[test]
    fn other_signs() {
        let text = |t: &str| Attribute::Text(t.into());
        let p = packing(I8, &[("_Unsigned", text("true")), ("_FillValue", whole(-1)), ("valid_max", whole(-2))]);
        assert_eq!([p.unpack_whole(-2), p.unpack_whole(-128), p.unpack_whole(5)], [254.0, 128.0, 5.0]);
        assert!(p.unpack_whole(-1).is_nan());
        let p = packing(U8, &[("_Unsigned", text("false"))]);
        assert_eq!([p.unpack_whole(255), p.unpack_whole(128), p.unpack_whole(127)], [-1.0, -128.0, 127.0]);
    }

    #[test]
    fn attributes_of_the_wrong_type() {
        let many = Attribute::Real(vec![1.0, 2.0]);
        for (name, attribute) in [
            ("scale_factor", Attribute::Text("0.5".into())),
            ("scale_factor", many.clone()),
            ("scale_factor", real(f64::NAN)),
            ("add_offset", Attribute::Text(String::new())),
            ("_FillValue", Attribute::Text("none".into())),
            ("valid_min", many),
            ("valid_range", real(1.0)),
            ("valid_max", Attribute::Json(serde_json::Value::Null)),
        ] {
            let error = Packing::of(&variable(I16, &[(name, attribute)])).err().unwrap();
            assert!(error.to_string().starts_with(&format!("variable 'v' has {name} = ")), "{error}");
        }
        assert!(matches!(Packing::of(&variable(Kind::Text, &[])), Err(Problem::VariableKind { found: "text", .. })));
    }
}
