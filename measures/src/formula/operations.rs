//! The functions, operators and constants of formulas. An undefined step, which is NaN, makes all after it undefined.

/// A name of formulas with its meaning.
type Named<T> = (&'static str, T);

/// A function of one number.
pub(super) type OfOne = fn(f64) -> f64;

/// A function of two numbers, or an operator between them.
pub(super) type OfTwo = fn(f64, f64) -> f64;

/// Functions of one number. Angles are in radians.
pub(super) const FUNCTIONS: &[Named<OfOne>] = &[
    ("abs", |x| finite(x.abs())),
    ("acos", |x| finite(x.acos())),
    ("asin", |x| finite(x.asin())),
    ("atan", |x| finite(x.atan())),
    ("cbrt", |x| finite(x.cbrt())),
    ("ceil", |x| finite(x.ceil())),
    ("cos", |x| finite(x.cos())),
    ("cosh", |x| finite(x.cosh())),
    ("degrees", |x| finite(x.to_degrees())),
    ("exp", |x| finite(x.exp())),
    ("floor", |x| finite(x.floor())),
    ("ln", |x| finite(x.ln())),
    ("log10", |x| finite(x.log10())),
    ("log2", |x| finite(x.log2())),
    ("radians", |x| finite(x.to_radians())),
    ("round", |x| finite(x.round())),
    ("sin", |x| finite(x.sin())),
    ("sinh", |x| finite(x.sinh())),
    ("sqrt", |x| finite(x.sqrt())),
    ("tan", |x| finite(x.tan())),
    ("tanh", |x| finite(x.tanh())),
];

/// Functions of two numbers.
pub(super) const FUNCTIONS_OF_TWO: &[Named<OfTwo>] = &[
    ("atan2", |y, x| both(y, x, f64::atan2)),
    ("hypot", |x, y| both(x, y, f64::hypot)),
    ("max", |x, y| both(x, y, f64::max)),
    ("min", |x, y| both(x, y, f64::min)),
];

/// The function of an operator: + - * / or ^.
///
/// # Panics
/// For any other character.
pub(super) fn operator(sign: char) -> OfTwo {
    match sign {
        '+' => |x, y| finite(x + y),
        '-' => |x, y| finite(x - y),
        '*' => |x, y| finite(x * y),
        '/' => |x, y| finite(x / y),
        '^' => |x, y| both(x, y, f64::powf),
        _ => unreachable!("'{sign}' is not an operator"),
    }
}

/// The function of a sign −.
pub(super) fn minus(x: f64) -> f64 {
    -x
}

/// Constants.
pub(super) const CONSTANTS: &[Named<f64>] =
    &[("e", std::f64::consts::E), ("pi", std::f64::consts::PI), ("tau", std::f64::consts::TAU)];

/// The number, or NaN where it is not finite, so that no later step makes a number of it.
fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { f64::NAN }
}

/// As [`finite`], for functions that may make a number of NaN, such as 1 of NaN^0.
fn both(x: f64, y: f64, of: OfTwo) -> f64 {
    if x.is_nan() || y.is_nan() { f64::NAN } else { finite(of(x, y)) }
}
