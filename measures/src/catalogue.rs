//! All measures that a run can name: built-ins, measures of plugins, and formulas.
//!
//! A plugin's measure is written by its own name, or as `plugin:measure` where others have that name too.

use std::sync::Arc;

use crate::plugin::{Plugin, PluginMeasure};
use crate::registry::{names_like, usual};
use crate::{Formula, FormulaError, Measure, UnknownMeasure, find};

/// The plugins of a run, beside the built-in measures.
#[derive(Clone, Debug, Default)]
pub struct Catalogue {
    plugins: Vec<Plugin>,
}

/// The reason why a text gives no measure.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CatalogueError {
    /// A name that no measure has.
    #[error(transparent)]
    Unknown(#[from] UnknownMeasure),
    /// A formula with a fault.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// A name that several measures have.
    #[error("'{name}' is the name of several measures; choose {}", names.join(" or "))]
    Ambiguous {
        /// The name.
        name: String,
        /// The names to write instead.
        names: Vec<String>,
    },
    /// A text that is neither name nor formula.
    #[error("'{text}' is not a measure's name; a formula needs a name of its own, as in 'x = {text}'")]
    Nameless {
        /// The text.
        text: String,
    },
    /// Two plugins of one name.
    #[error("the plugins {first} and {second} have the same name, '{name}'; load one of them only")]
    Clash {
        /// The name.
        name: String,
        /// The file of one.
        first: String,
        /// The file of another.
        second: String,
    },
}

/// The first part of a built-in's whole name, `longan:evq`.
const BUILT_IN: &str = "longan";

impl Catalogue {
    /// A catalogue with these plugins.
    ///
    /// # Errors
    /// Two plugins of one name.
    pub fn new(plugins: Vec<Plugin>) -> Result<Self, CatalogueError> {
        for (i, second) in plugins.iter().enumerate() {
            if let Some(first) = plugins[..i].iter().find(|first| first.name() == second.name()) {
                let [first, second] = [first, second].map(|plugin| plugin.path().display().to_string());
                return Err(CatalogueError::Clash { name: plugins[i].name().to_owned(), first, second });
            }
        }
        Ok(Catalogue { plugins })
    }

    /// The plugins.
    pub fn plugins(&self) -> &[Plugin] {
        &self.plugins
    }

    /// The name to be written for a plugin's measure: its own, or where that is ambiguous `plugin:measure`.
    pub fn name_of(&self, plugin: &Plugin, measure: &PluginMeasure) -> String {
        let name = measure.name();
        if self.named(&name).count() + usize::from(find(&name).is_ok()) > 1 {
            format!("{}:{name}", plugin.name())
        } else {
            name
        }
    }

    /// The measure that a text names, or the formula that it is.
    ///
    /// # Errors
    /// See [`CatalogueError`].
    pub fn find(&self, text: &str) -> Result<Arc<dyn Measure>, CatalogueError> {
        let text = text.trim();
        if text.contains('=') {
            return Ok(Arc::new(Formula::new(text)?));
        }
        let usual = usual(text);
        if let Some((first, name)) = usual.split_once(':') {
            if first == BUILT_IN {
                return Ok(Arc::new(find(name)?));
            }
            let plugin = self.plugins.iter().find(|plugin| plugin.name() == first);
            let measure = plugin.and_then(|p| Some((p, p.measures().iter().find(|measure| measure.name() == name)?)));
            let (plugin, measure) = measure.ok_or_else(|| self.unknown(text))?;
            return Ok(Arc::new(measure.clone().renamed(self.name_of(plugin, measure))));
        }
        let built_in = find(text);
        let mut named = self.named(&usual);
        match (built_in, named.next(), named.next()) {
            (Ok(measure), None, _) => Ok(Arc::new(measure)),
            (Err(_), Some((_, measure)), None) => Ok(Arc::new(measure.clone())),
            (Err(_), None, _) if text.contains(['(', ')', '+', '*', '/', '^', ' ']) => {
                Err(CatalogueError::Nameless { text: text.to_owned() })
            }
            (Err(_), None, _) => Err(self.unknown(text).into()),
            (built_in, ..) => {
                let built_in = built_in.ok().map(|_| format!("{BUILT_IN}:{usual}"));
                let plugins = self.named(&usual).map(|(plugin, _)| format!("{}:{usual}", plugin.name()));
                let names = built_in.into_iter().chain(plugins).map(|name| format!("'{name}'")).collect();
                Err(CatalogueError::Ambiguous { name: text.to_owned(), names })
            }
        }
    }

    fn named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = (&'a Plugin, &'a PluginMeasure)> {
        let of = move |plugin: &'a Plugin| plugin.measures().iter().map(move |measure| (plugin, measure));
        self.plugins.iter().flat_map(of).filter(move |(_, measure)| measure.name() == name)
    }

    fn unknown(&self, name: &str) -> UnknownMeasure {
        let names = self.plugins.iter().flat_map(|plugin| {
            let both = |m: &PluginMeasure| [m.name(), format!("{}:{}", plugin.name(), m.name())];
            plugin.measures().iter().flat_map(both)
        });
        UnknownMeasure::new(name, names_like(name).chain(names))
    }
}

/// The parts of a list, separated by commas outside of brackets.
pub fn split(list: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    let (mut depth, mut start) = (0usize, 0);
    for (i, c) in list.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            ',' if depth == 0 => {
                parts.push(&list[start..i]);
                start = i + 1;
            }
            _ => (),
        }
    }
    parts.push(&list[start..]);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_split_at_their_own_commas_only() {
        assert_eq!(split("evq, w1"), ["evq", " w1"]);
        assert_eq!(split("a = max(w1, min(2, 3)),evq"), ["a = max(w1, min(2, 3))", "evq"]);
        assert_eq!(split(""), [""]);
        assert_eq!(split("a),b,"), ["a)", "b", ""]);
    }

    #[test]
    fn names_and_formulas_are_found() {
        let catalogue = Catalogue::default();
        let name = |text: &str| catalogue.find(text).map(|measure| measure.name()).map_err(|e| e.to_string());
        assert_eq!(name(" evq ").as_deref(), Ok("evq"));
        assert_eq!(name("Longan:Psi2_Direction").as_deref(), Ok("psi2-direction"));
        assert_eq!(name("longan:psi3").as_deref(), Ok("psi3"));
        assert_eq!(name("x = w1").as_deref(), Ok("x"));
        assert!(name("w1 + w2").unwrap_err().contains("as in 'x = w1 + w2'"));
        assert!(name("none:evq").unwrap_err().contains("no measure 'none:evq'"));
        assert!(name("longan:evk").unwrap_err().contains("'evq'"));
    }
}
