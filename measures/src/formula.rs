//! Measures written as formulas: `axis = (w1 - psi2)/(w1 + psi2)`.
//!
//! The text is read here, so that each fault is found at its place, and handed on with all names and brackets resolved
//! to `exmex`, which evaluates it. In a formula the hyphens of names are written as underscores: a hyphen is always a
//! subtraction. Whatever is undefined stays so: a measure without a value, and any step without a finite number.

use std::fmt::{self, Display};
use std::ops::Range;

use exmex::{BinOp, Express, FlatEx, MakeOperators, Operator};

use crate::registry::names_like;
use crate::{BuiltIn, Measure, MeasureError, Needs, Origin, Window, find};

/// Longest text of a formula, in bytes.
const LONGEST: usize = 1000;

/// Brackets, signs and powers within each other, at most.
const DEEPEST: usize = 50;

/// What separates words.
const BLANKS: [char; 4] = [' ', '\t', '\r', '\n'];

/// Names offered in place of a wrong one, at most.
const OFFERED: usize = 3;

/// Something with its name.
type Named<T> = (&'static str, T);

type OfOne = fn(f64) -> f64;

type OfTwo = fn(f64, f64) -> f64;

/// Functions of one number. Angles are in radians.
const FUNCTIONS: &[Named<OfOne>] = &[
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
const FUNCTIONS_OF_TWO: &[Named<OfTwo>] = &[
    ("atan2", |y, x| both(y, x, f64::atan2)),
    ("hypot", |x, y| both(x, y, f64::hypot)),
    ("max", |x, y| both(x, y, f64::max)),
    ("min", |x, y| both(x, y, f64::min)),
];

const OPERATORS: &[Named<OfTwo>] = &[
    ("+", |x, y| finite(x + y)),
    ("-", |x, y| finite(x - y)),
    ("*", |x, y| finite(x * y)),
    ("/", |x, y| finite(x / y)),
    ("^", |x, y| both(x, y, f64::powf)),
];

const CONSTANTS: &[Named<f64>] =
    &[("e", std::f64::consts::E), ("pi", std::f64::consts::PI), ("tau", std::f64::consts::TAU)];

/// The number, or NaN: what is not finite must not come back as a number later.
fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { f64::NAN }
}

/// The same of a function that may make a number of NaN, as 0 of NaN^0.
fn both(x: f64, y: f64, of: OfTwo) -> f64 {
    if x.is_nan() || y.is_nan() { f64::NAN } else { finite(of(x, y)) }
}

/// The operators as `exmex` wants them. No order of precedence: the text has all brackets.
#[derive(Clone, Debug)]
struct Operators;

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        let of_two = OPERATORS.iter().chain(FUNCTIONS_OF_TWO).map(|&(name, apply)| {
            let operator = BinOp { apply, prio: 0, is_commutative: false };
            if name == "-" {
                Operator::make_bin_unary(name, operator, |x| -x)
            } else {
                Operator::make_bin(name, operator)
            }
        });
        of_two.chain(FUNCTIONS.iter().map(|&(name, apply)| Operator::make_unary(name, apply))).collect()
    }
}

/// A measure that a formula makes of others.
#[derive(Clone, Debug)]
pub struct Formula {
    name: String,
    text: String,
    inputs: Vec<Input>,
    expression: FlatEx<f64, Operators>,
}

/// What a name in a formula stands for.
#[derive(Clone, Copy, Debug)]
enum Input {
    Measure(BuiltIn),
    Re(u32),
    Im(u32),
}

/// What is wrong with a formula, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormulaError {
    /// The formula.
    pub formula: String,
    /// The characters that are wrong, counted from 0.
    pub at: Range<usize>,
    /// What is wrong with them.
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
    /// The formula, and below it a mark under what is wrong.
    pub fn marked(&self) -> String {
        let formula = self.formula.replace(char::is_control, "\u{fffd}");
        format!("{formula}\n{}{}", " ".repeat(self.at.start), "^".repeat(self.at.len().max(1)))
    }
}

impl Formula {
    /// The formula that a text `name = expression` gives.
    ///
    /// # Errors
    /// What is wrong, where, and which names there are instead.
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
        let mut reader = Reader { text, at: 0, depth: 0, inputs: Vec::new(), names: Vec::new() };
        let name = reader.heading().map_err(error)?;
        let resolved = reader.whole().map_err(error)?;
        let expression = FlatEx::parse(&resolved)
            .map_err(|e| error(Fault { at: 0..text.len(), problem: format!("this cannot be evaluated ({e})") }))?;
        Ok(Formula { name, text: text.to_owned(), inputs: reader.inputs, expression })
    }

    fn value(&self, window: &Window<'_>, inputs: &mut Vec<f64>) -> Option<f64> {
        inputs.clear();
        for input in &self.inputs {
            inputs.push(match *input {
                Input::Measure(measure) => measure.evaluate(window)?,
                Input::Re(rank) => window.psi(rank).re,
                Input::Im(rank) => window.psi(rank).im,
            });
        }
        self.expression.eval(inputs).ok().filter(|value| value.is_finite())
    }
}

impl Measure for Formula {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn definition(&self) -> String {
        self.text.clone()
    }

    /// None: a formula does not say.
    fn unit(&self) -> &str {
        ""
    }

    /// The largest of those that it is made of.
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
        self.value(window, &mut Vec::with_capacity(self.inputs.len()))
    }

    fn evaluate_all(&self, windows: &[Window<'_>], values: &mut [f64]) -> Result<(), MeasureError> {
        let mut inputs = Vec::with_capacity(self.inputs.len());
        for (value, window) in values.iter_mut().zip(windows) {
            *value = self.value(window, &mut inputs).unwrap_or(f64::NAN);
        }
        Ok(())
    }

    fn origin(&self) -> Origin {
        Origin::Formula(self.text.clone())
    }
}

/// What is wrong, at which bytes.
struct Fault {
    at: Range<usize>,
    problem: String,
}

/// A formula's text as far as it is read.
struct Reader<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    inputs: Vec<Input>,
    /// The names of the inputs, each once.
    names: Vec<String>,
}

/// The built-in that people wrote as a formula of this name before it was one, which goes on to work.
const LONG_A_FORMULA: &str = "beta";

/// Each part returns what it read for `exmex`, in brackets.
impl Reader<'_> {
    /// The formula's name and the `=`.
    fn heading(&mut self) -> Result<String, Fault> {
        let Some(end) = self.text.find('=') else {
            return Err(Fault { at: 0..0, problem: "a name is missing, as in 'x = …',".to_owned() });
        };
        let name = self.text[..end].trim_end_matches(BLANKS);
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if let Some((i, c)) = name.char_indices().find(|&(i, c)| !allowed(c) || (i == 0 && !c.is_ascii_alphabetic())) {
            let problem = "the name before '=' must be a letter followed by letters, digits, '_' and '-',".to_owned();
            return Err(Fault { at: i..i + c.len_utf8(), problem });
        }
        if name.is_empty() {
            return Err(Fault { at: 0..1, problem: "a name is missing, as in 'x = …',".to_owned() });
        }
        if let Some(known) = find(name).ok().filter(|known| known.name() != LONG_A_FORMULA) {
            let problem = format!("'{}' is a measure already, so choose another name than the one", known.name());
            return Err(Fault { at: 0..name.len(), problem });
        }
        let name = name.to_owned();
        self.at = end + 1;
        Ok(name)
    }

    fn whole(&mut self) -> Result<String, Fault> {
        let read = self.sum()?;
        match self.peek() {
            None => Ok(read),
            Some(')') => Err(self.fault_here("this ')' closes nothing")),
            Some(',') => Err(self.fault_here("this ',' is not within a function's brackets")),
            Some('=') => Err(self.fault_here("there is a second '='")),
            Some(_) => Err(self.fault_here("an operator, + - * / or ^, is missing")),
        }
    }

    fn sum(&mut self) -> Result<String, Fault> {
        let mut read = self.product()?;
        while let Some(operator) = self.take(&['+', '-']) {
            read = format!("({read}{operator}{})", self.product()?);
        }
        Ok(read)
    }

    fn product(&mut self) -> Result<String, Fault> {
        let mut read = self.signed()?;
        while let Some(operator) = self.take(&['*', '/']) {
            read = format!("({read}{operator}{})", self.signed()?);
        }
        Ok(read)
    }

    fn signed(&mut self) -> Result<String, Fault> {
        match self.take(&['+', '-']) {
            Some('-') => Ok(format!("(-{})", self.deeper(Self::signed)?)),
            Some(_) => self.deeper(Self::signed),
            None => self.power(),
        }
    }

    /// Powers bind more than the sign before them, and are taken from the right: −2^2 = −4, 2^3^2 = 2^9.
    fn power(&mut self) -> Result<String, Fault> {
        let base = self.operand()?;
        match self.take(&['^']) {
            Some(_) => Ok(format!("({base}^{})", self.deeper(Self::signed)?)),
            None => Ok(base),
        }
    }

    fn operand(&mut self) -> Result<String, Fault> {
        match self.peek() {
            Some('(') => {
                let open = self.at;
                self.at += 1;
                let read = self.deeper(Self::sum)?;
                self.close(open)?;
                Ok(read)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.name(),
            _ => Err(self.fault_here("a number, a name or '(' is missing")),
        }
    }

    fn number(&mut self) -> Result<String, Fault> {
        let bytes = self.text.as_bytes();
        let start = self.at;
        let mut end = start;
        let digits =
            |from: usize| from + bytes[from..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
        end = digits(end);
        if matches!(bytes.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            if bytes.get(end + 1 + sign).is_some_and(u8::is_ascii_digit) {
                end = digits(end + 1 + sign);
            }
        }
        let text = &self.text[start..end];
        let value = text.parse().ok().filter(|x: &f64| x.is_finite());
        let fault = || Fault { at: start..end, problem: format!("'{text}' is not a finite number") };
        let value = value.ok_or_else(fault)?;
        self.at = end;
        // All digits, and no exponent, which exmex does not know.
        Ok(format!("({value})"))
    }

    /// A function, a constant, a measure or a part of a moment.
    fn name(&mut self) -> Result<String, Fault> {
        let start = self.at;
        let word = |from: usize| {
            let allowed = |c: &char| c.is_ascii_alphanumeric() || *c == '_';
            from + self.text[from..].chars().take_while(allowed).count()
        };
        let mut end = word(start);
        if self.text[end..].starts_with('.') {
            end = word(end + 1);
        }
        let name = &self.text[start..end];
        self.at = end;
        let called = self.peek() == Some('(');
        if let Some(&(name, _)) = FUNCTIONS.iter().find(|(known, _)| *known == name) {
            let [argument] = self.arguments(name, start..end)?;
            return Ok(format!("({name}({argument}))"));
        }
        if let Some(&(name, _)) = FUNCTIONS_OF_TWO.iter().find(|(known, _)| *known == name) {
            let [first, second] = self.arguments(name, start..end)?;
            return Ok(format!("({first} {name} {second})"));
        }
        if called {
            let functions = FUNCTIONS.iter().map(|f| f.0).chain(FUNCTIONS_OF_TWO.iter().map(|f| f.0));
            let problem = format!("there is no function '{name}'{}", offered(name, functions.map(str::to_owned)));
            return Err(Fault { at: start..end, problem });
        }
        if let Some((_, value)) = CONSTANTS.iter().find(|(known, _)| *known == name) {
            return Ok(format!("({value})"));
        }
        let Some(input) = input(name) else { return Err(self.unknown(start..end)) };
        let place = self.names.iter().position(|known| known == name).unwrap_or_else(|| {
            self.names.push(name.to_owned());
            self.inputs.push(input);
            self.names.len() - 1
        });
        // exmex sorts its variables by their names.
        Ok(format!("{{{place:04}}}"))
    }

    /// The arguments of a function, in its brackets.
    fn arguments<const N: usize>(&mut self, function: &str, named: Range<usize>) -> Result<[String; N], Fault> {
        let open = self.at;
        if self.take(&['(']).is_none() {
            let commas = ["x", "x, y"][N - 1];
            return Err(Fault {
                at: named,
                problem: format!("'{function}' needs brackets, as in {function}({commas}),"),
            });
        }
        let mut arguments = [const { String::new() }; N];
        for (i, argument) in arguments.iter_mut().enumerate() {
            if i > 0 && self.take(&[',']).is_none() {
                return Err(self.fault_here(&format!("'{function}' takes {N} numbers, and a ',' is missing")));
            }
            *argument = self.deeper(Self::sum)?;
        }
        if self.peek() == Some(',') {
            return Err(self.fault_here(&format!("'{function}' takes no more than {N}, so there is a ',' too many")));
        }
        self.close(self.text[..=open].rfind('(').unwrap_or(open))?;
        Ok(arguments)
    }

    /// The bracket that closes the one at `open`.
    fn close(&mut self, open: usize) -> Result<(), Fault> {
        match self.peek() {
            Some(')') => {
                self.at += 1;
                Ok(())
            }
            None => Err(Fault { at: open..open + 1, problem: "there is no ')' for the '('".to_owned() }),
            Some(',') => Err(self.fault_here("this ',' is not within a function's brackets")),
            Some(_) => Err(self.fault_here("an operator, + - * / or ^, or a ')' is missing")),
        }
    }

    fn deeper(&mut self, read: fn(&mut Self) -> Result<String, Fault>) -> Result<String, Fault> {
        if self.depth == DEEPEST {
            return Err(self.fault_here(&format!("more than {DEEPEST} levels are within each other")));
        }
        self.depth += 1;
        let read = read(self);
        self.depth -= 1;
        read
    }

    /// The next character that is no space.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start_matches(BLANKS).len();
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, these: &[char]) -> Option<char> {
        let next = self.peek().filter(|c| these.contains(c))?;
        self.at += next.len_utf8();
        Some(next)
    }

    fn fault_here(&mut self, problem: &str) -> Fault {
        let next = self.peek();
        let problem = match next {
            Some(c) if !c.is_ascii() || !(c.is_ascii_alphanumeric() || "+-*/^(),=._".contains(c)) => {
                format!("'{}' means nothing in a formula", c.escape_debug())
            }
            _ => problem.to_owned(),
        };
        Fault { at: self.at..self.at + next.map_or(0, char::len_utf8), problem }
    }

    /// A name that nothing has, perhaps since it was written with hyphens.
    fn unknown(&self, at: Range<usize>) -> Fault {
        let is_of_name = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        let start = self.text[..at.start].rfind(|c| !is_of_name(c)).map_or(0, |i| i + 1);
        let end = self.text[at.start..].find(|c| !is_of_name(c)).map_or(self.text.len(), |i| at.start + i);
        if let Some(measure) =
            Some(&self.text[start..end]).filter(|whole| whole.contains('-')).and_then(|name| find(name).ok())
        {
            let name = written(&measure.name());
            let problem = format!("a hyphen is a subtraction in a formula, so write '{name}' for the name");
            return Fault { at: start..end, problem };
        }
        let name = &self.text[at.clone()];
        let problem = format!("there is no measure or moment '{name}'{}", offered(name, all_names(name)));
        Fault { at, problem }
    }
}

/// A measure's name as it stands in formulas.
fn written(name: &str) -> String {
    name.replace('-', "_")
}

/// What a name stands for.
fn input(name: &str) -> Option<Input> {
    let name = name.to_lowercase();
    let Some((moment, part)) = name.split_once('.') else { return find(&name).ok().map(Input::Measure) };
    let digits = moment.strip_prefix("psi")?;
    let rank: u32 = digits.parse().ok()?;
    match part {
        _ if rank.to_string() != digits => None,
        "re" => Some(Input::Re(rank)),
        "im" => Some(Input::Im(rank)),
        _ => None,
    }
}

/// All names but functions', with the rank that `like` has.
fn all_names(like: &str) -> impl Iterator<Item = String> {
    let measures: Vec<String> = names_like(like).map(|name| written(&name)).collect();
    let moments: Vec<String> = measures.iter().filter(|name| input(&format!("{name}.re")).is_some()).cloned().collect();
    let parts = moments.into_iter().flat_map(|name| ["re", "im"].map(|part| format!("{name}.{part}")));
    measures.into_iter().chain(parts).chain(CONSTANTS.iter().map(|(name, _)| (*name).to_owned()))
}

/// The names most like this one, as a question.
fn offered(name: &str, known: impl Iterator<Item = String>) -> String {
    let near = |known: String| (strsim::damerau_levenshtein(&known, &name.to_lowercase()), known);
    let mut near: Vec<_> = known.map(near).filter(|(distance, known)| 2 * distance <= known.len()).collect();
    near.sort();
    near.dedup();
    let names: Vec<String> = near.into_iter().take(OFFERED).map(|(_, name)| format!("'{name}'")).collect();
    match names.split_last() {
        None => String::new(),
        Some((last, [])) => format!(" (did you mean {last}?)"),
        Some((last, others)) => format!(" (did you mean {} or {last}?)", others.join(", ")),
    }
}

#[cfg(test)]
mod tests {
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
