//! Reading the text of a formula, so that each fault is found at its place.

use std::ops::Range;

use super::names::{all_names, input, offered, written};
use super::operations::{CONSTANTS, FUNCTIONS, FUNCTIONS_OF_TWO, minus, operator};
use super::{BLANKS, Input, Step};
use crate::{Measure, find};

/// Brackets, signs and powers within each other, at most.
pub(super) const DEEPEST: usize = 50;

/// A fault of a text, and its bytes.
pub(super) struct Fault {
    pub(super) at: Range<usize>,
    pub(super) problem: String,
}

/// A formula's text, with the steps and inputs of what is read of it so far.
pub(super) struct Reader<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    pub(super) steps: Vec<Step>,
    pub(super) inputs: Vec<Input>,
    /// The names of the inputs, each once.
    names: Vec<String>,
}

/// The built-in whose name formulas may have, since people wrote it as a formula before it was built in.
const LONG_A_FORMULA: &str = "beta";

/// Each part of the grammar appends the steps that leave its value on the stack.
impl<'a> Reader<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Reader { text, at: 0, depth: 0, steps: Vec::new(), inputs: Vec::new(), names: Vec::new() }
    }

    /// The formula's name and the `=`.
    pub(super) fn heading(&mut self) -> Result<String, Fault> {
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

    /// The expression, up to the end of the text.
    pub(super) fn expression(&mut self) -> Result<(), Fault> {
        self.sum()?;
        match self.peek() {
            None => Ok(()),
            Some(')') => Err(self.fault_here("this ')' closes nothing")),
            Some(',') => Err(self.fault_here("this ',' is not within a function's brackets")),
            Some('=') => Err(self.fault_here("there is a second '='")),
            Some(_) => Err(self.fault_here("an operator, + - * / or ^, is missing")),
        }
    }

    fn sum(&mut self) -> Result<(), Fault> {
        self.product()?;
        while let Some(sign) = self.take(&['+', '-']) {
            self.product()?;
            self.steps.push(Step::OfTwo(operator(sign)));
        }
        Ok(())
    }

    fn product(&mut self) -> Result<(), Fault> {
        self.signed()?;
        while let Some(sign) = self.take(&['*', '/']) {
            self.signed()?;
            self.steps.push(Step::OfTwo(operator(sign)));
        }
        Ok(())
    }

    fn signed(&mut self) -> Result<(), Fault> {
        match self.take(&['+', '-']) {
            Some(sign) => {
                self.deeper(Self::signed)?;
                if sign == '-' {
                    self.steps.push(Step::OfOne(minus));
                }
                Ok(())
            }
            None => self.power(),
        }
    }

    /// Powers bind more than the sign before them, and are taken from the right: −2^2 = −4, 2^3^2 = 2^9.
    fn power(&mut self) -> Result<(), Fault> {
        self.operand()?;
        if let Some(sign) = self.take(&['^']) {
            self.deeper(Self::signed)?;
            self.steps.push(Step::OfTwo(operator(sign)));
        }
        Ok(())
    }

    fn operand(&mut self) -> Result<(), Fault> {
        match self.peek() {
            Some('(') => {
                let open = self.at;
                self.at += 1;
                self.deeper(Self::sum)?;
                self.close(open)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.name(),
            _ => Err(self.fault_here("a number, a name or '(' is missing")),
        }
    }

    fn number(&mut self) -> Result<(), Fault> {
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
        self.steps.push(Step::Number(value));
        Ok(())
    }

    /// A function, a constant, a measure or a part of a moment.
    fn name(&mut self) -> Result<(), Fault> {
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
        if let Some(&(name, function)) = FUNCTIONS.iter().find(|(known, _)| *known == name) {
            self.arguments(1, name, start..end)?;
            self.steps.push(Step::OfOne(function));
            return Ok(());
        }
        if let Some(&(name, function)) = FUNCTIONS_OF_TWO.iter().find(|(known, _)| *known == name) {
            self.arguments(2, name, start..end)?;
            self.steps.push(Step::OfTwo(function));
            return Ok(());
        }
        if called {
            let functions = FUNCTIONS.iter().map(|f| f.0).chain(FUNCTIONS_OF_TWO.iter().map(|f| f.0));
            let problem = format!("there is no function '{name}'{}", offered(name, functions.map(str::to_owned)));
            return Err(Fault { at: start..end, problem });
        }
        if let Some(&(_, value)) = CONSTANTS.iter().find(|(known, _)| *known == name) {
            self.steps.push(Step::Number(value));
            return Ok(());
        }
        let Some(input) = input(name) else { return Err(self.unknown(start..end)) };
        let place = self.names.iter().position(|known| known == name).unwrap_or_else(|| {
            self.names.push(name.to_owned());
            self.inputs.push(input);
            self.names.len() - 1
        });
        self.steps.push(Step::Input(place));
        Ok(())
    }

    /// The arguments of a function, in its brackets: so many as `count`, one or two.
    fn arguments(&mut self, count: usize, function: &str, named: Range<usize>) -> Result<(), Fault> {
        let open = self.at;
        if self.take(&['(']).is_none() {
            let commas = ["x", "x, y"][count - 1];
            return Err(Fault {
                at: named,
                problem: format!("'{function}' needs brackets, as in {function}({commas}),"),
            });
        }
        for i in 0..count {
            if i > 0 && self.take(&[',']).is_none() {
                return Err(self.fault_here(&format!("'{function}' takes {count} numbers, and a ',' is missing")));
            }
            self.deeper(Self::sum)?;
        }
        if self.peek() == Some(',') {
            return Err(
                self.fault_here(&format!("'{function}' takes no more than {count}, so there is a ',' too many"))
            );
        }
        self.close(self.text[..=open].rfind('(').unwrap_or(open))
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

    fn deeper(&mut self, read: fn(&mut Self) -> Result<(), Fault>) -> Result<(), Fault> {
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
