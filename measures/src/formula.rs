//! Measures written as formulas: `axis = (w1 - psi2)/(w1 + psi2)`.
//!
//! The text is read once ([`reader`]) into steps on a stack, which each window runs through. In a formula the hyphens of
//! names are written as underscores: a hyphen is always a subtraction. An undefined measure, and any step without a finite
//! number, leave the formula undefined.

mod names;
mod operations;
mod reader;

use std::fmt::{self, Display};
use std::ops::Range;

use crate::{BuiltIn, Measure, MeasureError, Needs, Origin, Quantity, Window};
use operations::{OfOne, OfTwo};
use reader::{Fault, Reader};

/// Longest text of a formula, in bytes.
const LONGEST: usize = 1000;

/// Characters that separate words.
const BLANKS: [char; 4] = [' ', '\t', '\r', '\n'];

/// A measure that a formula makes of others.
#[derive(Clone, Debug)]
pub struct Formula {
    name: String,
    text: String,
    inputs: Vec<Input>,
    steps: Vec<Step>,
}

/// A step of a formula, which takes its numbers from the top of a stack and leaves one there.
#[derive(Clone, Copy, Debug)]
enum Step {
    Number(f64),
    /// The input of this number.
    Input(usize),
    OfOne(OfOne),
    OfTwo(OfTwo),
}

/// The meaning of a name in a formula.
#[derive(Clone, Copy, Debug)]
enum Input {
    Measure(BuiltIn),
    Re(u32),
    Im(u32),
}

/// A fault of a formula, with its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormulaError {
    /// The formula.
    pub formula: String,
    /// The characters that are wrong, counted from 0.
    pub at: Range<usize>,
    /// The fault, in words.
    pub problem: String,
}

impl Display for FormulaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let formula = self.formula.replace(char::is_control, "\u{fffd}");
        write!(f, "{} at character {} of the formula '{formula}'", self.problem, self.at.start + 1)
    }
}

impl std::error::Error for FormulaError {}

impl FormulaError {
    /// The formula, and on a line below it a mark under the fault.
    pub fn marked(&self) -> String {
        let formula = self.formula.replace(char::is_control, "\u{fffd}");
        format!("{formula}\n{}{}", " ".repeat(self.at.start), "^".repeat(self.at.len().max(1)))
    }
}

impl Formula {
    /// The formula that a text `name = expression` gives.
    ///
    /// # Errors
    /// The first fault, with its place, and with the names most like a wrong one.
    pub fn new(text: &str) -> Result<Self, FormulaError> {
        // A header holds it on one line.
        let text = &text.trim().replace(BLANKS, " ");
        let error = |fault: Fault| FormulaError {
            formula: text.to_owned(),
            at: text[..fault.at.start].chars().count()..text[..fault.at.end].chars().count(),
            problem: fault.problem,
        };
        if text.len() > LONGEST {
            return Err(FormulaError {
                formula: text.chars().take(20).collect::<String>() + "…",
                at: 0..0,
                problem: format!("{} bytes are more than the {LONGEST} that a formula may have,", text.len()),
            });
        }
        let mut reader = Reader::new(text);
        let name = reader.heading().map_err(error)?;
        reader.expression().map_err(error)?;
        let Reader { inputs, steps, .. } = reader;
        Ok(Formula { name, text: text.to_owned(), inputs, steps })
    }

    /// The formula of a window; `inputs` and `stack` are room to work in.
    fn value(&self, window: &Window<'_>, inputs: &mut Vec<f64>, stack: &mut Vec<f64>) -> Option<f64> {
        inputs.clear();
        stack.clear();
        for input in &self.inputs {
            inputs.push(match *input {
                Input::Measure(measure) => measure.evaluate(window)?,
                Input::Re(rank) => window.psi(rank).re,
                Input::Im(rank) => window.psi(rank).im,
            });
        }
        for step in &self.steps {
            let value = match *step {
                Step::Number(number) => number,
                Step::Input(place) => inputs[place],
                Step::OfOne(function) => function(stack.pop()?),
                Step::OfTwo(function) => {
                    let second = stack.pop()?;
                    function(stack.pop()?, second)
                }
            };
            stack.push(value);
        }
        stack.pop().filter(|value| value.is_finite())
    }
}

impl Measure for Formula {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn definition(&self) -> String {
        self.text.clone()
    }

    /// A number: the text of a formula does not state what its value is.
    fn quantity(&self) -> Quantity {
        Quantity::Number
    }

    /// None: the text does not state a unit.
    fn unit(&self) -> &str {
        ""
    }

    /// The largest rank of the measures and moments in it.
    fn rank(&self) -> u32 {
        let rank = |input: &Input| match *input {
            Input::Measure(measure) => measure.rank(),
            Input::Re(rank) | Input::Im(rank) => rank,
        };
        self.inputs.iter().map(rank).max().unwrap_or(0)
    }

    fn needs(&self) -> Needs {
        let mut all = Needs::default();
        for input in &self.inputs {
            let needs = match *input {
                Input::Measure(measure) => measure.needs(),
                Input::Re(rank) | Input::Im(rank) => Needs { ranks: vec![rank], ..Needs::default() },
            };
            all.area |= needs.area;
            all.length |= needs.length;
            all.curvature |= needs.curvature;
            all.ranks.extend(needs.ranks);
        }
        all.ranks.sort_unstable();
        all.ranks.dedup();
        all
    }

    fn evaluate(&self, window: &Window<'_>) -> Option<f64> {
        self.value(window, &mut Vec::with_capacity(self.inputs.len()), &mut Vec::new())
    }

    fn evaluate_all(&self, windows: &[Window<'_>], values: &mut [f64]) -> Result<(), MeasureError> {
        let (mut inputs, mut stack) = (Vec::with_capacity(self.inputs.len()), Vec::new());
        for (value, window) in values.iter_mut().zip(windows) {
            *value = self.value(window, &mut inputs, &mut stack).unwrap_or(f64::NAN);
        }
        Ok(())
    }

    fn origin(&self) -> Origin {
        Origin::Formula(self.text.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::reader::DEEPEST;
    use super::*;
    use num_complex::Complex64;
    use proptest::prelude::*;

    const PSI: [Complex64; 2] = [Complex64::new(0.3, -0.4), Complex64::new(-0.25, 0.125)];

    fn window() -> Window<'static> {
        Window { area: 0.5, length: 2.0, psi0: 2.0, ranks: &[2, 4], psi: &PSI, ..Window::default() }
    }

    fn value(expression: &str) -> Option<f64> {
        Formula::new(&format!("x = {expression}")).unwrap_or_else(|e| panic!("{e}")).evaluate(&window())
    }

    #[test]
    fn arithmetic_is_that_of_mathematics() {
        for (expression, expected) in [
            ("1 + 2*3", 7.0),
            ("(1 + 2)*3", 9.0),
            ("-2^2", -4.0),
            ("2^-1", 0.5),
            ("2^3^2", 512.0),
            ("2 - 3 - 4", -5.0),
            ("24/4/3", 2.0),
            ("2*-3", -6.0),
            ("--3", 3.0),
            ("1e-3 + .5 + 2.E+1", 20.501),
            ("max(min(3, 1), min(5, 2))*2", 4.0),
            ("atan2(1, -1)*4/pi", 3.0),
            ("sqrt(abs(-16)) + ln(e) + log10(1000) + cos(tau)", 9.0),
            ("degrees(pi) + radians(180)/pi", 181.0),
            ("w1 - psi2", 1.5),
            ("(w1 - psi2)/(w1 + psi2)", 0.6),
            ("psi2.re*psi2.im + psi4.re", -0.37),
            ("psi0.re + psi0.im", 2.0),
            ("contour_length + w0", 2.5),
            ("psi2-w0", 0.0),
        ] {
            let value = value(expression).unwrap();
            assert!((value - expected).abs() < 1e-14, "{expression} is {value}");
        }
    }

    #[test]
    fn what_is_undefined_stays_so() {
        for expression in [
            "1/0",
            "1/(1/0)",
            "(0/0)^0",
            "1^(0/0)",
            "min(0/0, 1)",
            "max(1, 0/0)",
            "hypot(1/0, 1)",
            "sqrt(-1)*0",
            "ln(0)",
            "exp(1000)/exp(1000)",
            "1/exp(1000)",
            "w1/(w1 - w1)",
            "0*psi8_direction^0",
        ] {
            let formula = Formula::new(&format!("x = {expression}")).unwrap();
            let window = Window { ranks: &[2, 4, 8], psi: &[PSI[0], PSI[1], Complex64::ZERO], ..window() };
            assert_eq!(formula.evaluate(&window), None, "{expression}");
        }
    }

    #[test]
    fn only_what_is_named_is_needed() {
        let needs = |text: &str| Formula::new(text).unwrap().needs();
        assert_eq!(needs("x = w0/2"), Needs { area: true, ..Needs::default() });
        assert_eq!(needs("x = psi3.re + psi0.re + psi3"), Needs { ranks: vec![0, 3], ..Needs::default() });
        let all = Needs { length: true, curvature: true, ranks: vec![0, 2, 4], ..Needs::default() };
        assert_eq!(needs("x = rank4_mid + w1*w2"), all);
        assert_eq!(Formula::new("x = psi5.im + q2").unwrap().rank(), 5);
    }

    #[test]
    fn formulas_are_numbers_whatever_they_are_made_of() {
        for (text, is_relative) in
            [("x = w1 - psi2", true), ("x = evq_direction", true), ("x = w0", true), ("x = 1/masked_fraction", false)]
        {
            let formula = Formula::new(text).unwrap();
            assert_eq!((formula.quantity(), formula.is_relative()), (Quantity::Number, is_relative), "{text}");
        }
    }

    #[test]
    fn formulas_keep_the_contract() {
        for text in ["a-b = w1 - psi2", "x2 = evq*psi3_direction", "x = 1/masked_fraction", "x = 3"] {
            crate::testing::check(&Formula::new(text).unwrap());
        }
    }

    #[test]
    fn faults_are_found_at_their_place() {
        for (text, at, parts) in [
            ("beta = (w1 - psy2)/w1", 13..17, &["no measure or moment 'psy2'", "did you mean 'psi2'"][..]),
            ("x = psi03.re", 4..12, &["'psi3.re'"]),
            ("x = psi2.real", 4..13, &["'psi2.re'"]),
            ("x = PSJ2", 4..8, &["'psi2'"]),
            ("x = rank4-mid", 4..13, &["a hyphen is a subtraction", "'rank4_mid'"]),
            ("x = 1 + psi2-direction", 8..22, &["'psi2_direction'"]),
            ("x = sqr(w1)", 4..7, &["no function 'sqr'", "'sqrt'"]),
            ("x = w1(2)", 4..6, &["no function 'w1'"]),
            ("x = sqrt w1", 4..8, &["sqrt(x)"]),
            ("x = max(w1)", 10..11, &["'max' takes 2 numbers"]),
            ("x = max(w1, 2, 3)", 13..14, &["no more than 2"]),
            ("x = sqrt(1, 2)", 10..11, &["no more than 1"]),
            ("x = (w1 + 1", 4..5, &["no ')' for the '('"]),
            ("x = abs (w1 + 1", 8..9, &["no ')' for the '('"]),
            ("x = w1 + 1)", 10..11, &["closes nothing"]),
            ("x = w1 + ", 8..8, &["is missing"]),
            ("x = w1 w2", 7..8, &["an operator"]),
            ("x = w1 * / w2", 9..10, &["is missing"]),
            ("x = (w1, w2)", 7..8, &["','"]),
            ("x = 1.2.3", 4..9, &["not a finite number"]),
            ("x = 1e999", 4..9, &["not a finite number"]),
            ("x = ψ2", 4..5, &["'ψ' means nothing"]),
            ("x = w1 ° 2", 7..8, &["'°' means nothing"]),
            ("x = 2 == 3", 6..7, &["second '='"]),
            ("é = 2", 0..1, &["the name before '='"]),
            ("2x = 2", 0..1, &["the name before '='"]),
            ("= 2", 0..1, &["a name is missing"]),
            ("w1 + 2", 0..0, &["a name is missing"]),
            ("EVQ = 2", 0..3, &["'evq' is a measure already"]),
            ("psi2_direction = 2", 0..14, &["is a measure already"]),
            ("x = ", 3..3, &["is missing"]),
        ] {
            let error = Formula::new(text).unwrap_err();
            assert_eq!(error.at, at, "{error}");
            let sentence = error.to_string();
            assert!(sentence.contains(&format!("at character {} of", at.start + 1)) && !sentence.contains('\n'));
            assert!(parts.iter().all(|part| sentence.contains(part)), "{sentence}");
        }
        for (open, close) in [("(", ")"), ("-", ""), ("abs(", ")"), ("2^", "")] {
            let deep = |n: usize| Formula::new(&format!("x = {}1{}", open.repeat(n), close.repeat(n)));
            assert!(deep(DEEPEST).is_ok() && deep(DEEPEST + 1).unwrap_err().problem.contains("50 levels"));
        }
        assert!(Formula::new(&format!("x = {}1", "1+".repeat(600))).unwrap_err().problem.contains("1205 bytes"));
    }

    /// An expression with its value, worked out as it is put together.
    fn expressions() -> impl Strategy<Value = (String, f64)> {
        let leaf = prop_oneof![
            (-9.0..9.0).prop_map(|x: f64| (format!("({x})"), x)),
            Just(("psi2.re".to_owned(), PSI[0].re)),
            Just(("psi4.im".to_owned(), PSI[1].im)),
            Just(("w1".to_owned(), 2.0)),
        ];
        leaf.prop_recursive(6, 40, 2, |inner| {
            let two = (inner.clone(), inner.clone(), 0..5usize);
            let two = two.prop_map(|((a, x), (b, y), i)| {
                let value = [x + y, x - y, x * y, x / y, x.min(y)][i];
                let text =
                    if i == 4 { format!("min({a}, {b})") } else { format!("({a} {} {b})", ["+", "-", "*", "/"][i]) };
                (text, value)
            });
            let one = (inner, 0..3usize);
            let one =
                one.prop_map(|((a, x), i)| (format!("{}({a})", ["-", "abs", "sin"][i]), [-x, x.abs(), x.sin()][i]));
            prop_oneof![two, one]
        })
    }

    proptest! {
        #[test]
        fn values_are_those_of_the_parts((text, expected) in expressions()) {
            prop_assume!(text.len() < LONGEST - 10);
            let value = value(&text);
            // Infinite steps end it, which a later division may hide in the plain arithmetic.
            match value {
                Some(value) => prop_assert_eq!(value, expected, "{}", text),
                None => prop_assert!(!expected.is_finite() || text.contains('/'), "{}", text),
            }
        }

        #[test]
        fn no_text_makes_it_panic(text in "(x = )?[-+*/^(), .0-9a-zψ_=]{0,40}") {
            let _ = Formula::new(&text);
        }
    }
}
