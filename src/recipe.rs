//! The recipe of Minkowski maps: every choice that decides on their values, resolved, so that two recipes are equal
//! exactly where the results would be.
//!
//! A default that is written out makes the recipe that it makes where it is left out. Which files were taken, and how a
//! recipe is written, is left to others.

use std::fmt;

use longan_grid::Healpix;
use longan_measures::{Measure, Origin, column_of};
use serde::{Deserialize, Serialize};

use crate::analysis::{Analysis, AnalysisError};
use crate::window::Summation;

/// Goes up whenever the same recipe gives other values than before: 2 since curvature sits at vertices and all moments
/// are made up for masked cells.
pub const REVISION: u32 = 2;

/// Every choice that decides on the values of Minkowski maps of a field.
///
/// A recipe is written as a map of names to values by serde. Fields that an older release did not write have their
/// defaults when it is read back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// [`REVISION`] of the release that made the values.
    pub revision: u32,
    /// The measures, in the order of the results.
    pub measures: Vec<MeasureRecipe>,
    /// Radii of the windows in degrees.
    pub windows: Vec<f64>,
    /// The thresholds, counted in `threshold_unit`.
    pub thresholds: Vec<f64>,
    /// `sigma` or `value`.
    pub threshold_unit: String,
    /// `above` or `below`.
    pub body: String,
    /// `length` or `curvature`.
    pub weight: String,
    /// Nside of the field.
    pub nside: usize,
    /// Nside of the result.
    pub nside_out: usize,
    /// Windows with a larger share of masked cells are masked.
    pub max_masked: f64,
    /// Least contour for measures that are ratios or directions, in window radii.
    #[serde(default)]
    pub min_contour: f64,
    /// Whether each threshold is kept by itself.
    #[serde(default)]
    pub by_threshold: bool,
    /// Largest error of ψ_s as a share of the sum of |weights|; 0 where windows are summed pixel by pixel.
    pub tolerance: f64,
    /// How the field was had; empty for one that was handed over.
    #[serde(default)]
    pub field: FieldRecipe,
}

/// One measure of a recipe.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasureRecipe {
    /// Its name.
    pub name: String,
    /// The formula that it is, if it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub formula: Option<String>,
    /// Name and version of the plugin that it comes from, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plugin: Option<String>,
}

/// How a field was had and how results are laid out: settings in words, equal where the choices are.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FieldRecipe {
    /// The table, the field and the places along other dimensions, such as `hdu=1`, `field=z`, `level=500`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub place: Vec<String>,
    /// The way to HEALPix and its settings, for a field on another grid or at points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub regridding: Vec<String>,
    /// The place of the mask in its file and the value below which it masks, where there is a mask.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mask: Vec<String>,
    /// Ordering and precision of what is written.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layout: Vec<String>,
}

impl Analysis {
    /// The recipe of this analysis for a field on a grid.
    ///
    /// # Errors
    /// See [`check`](Self::check).
    pub fn recipe(&self, field: Healpix, measures: &[impl AsRef<dyn Measure>]) -> Result<Recipe, AnalysisError> {
        let output = self.check(field)?;
        let measure = |measure: &dyn Measure| {
            let (formula, plugin) = match measure.origin() {
                Origin::Program => (None, None),
                Origin::Formula(formula) => (Some(formula), None),
                Origin::Plugin(plugin) => (None, Some(format!("{} {}", plugin.name, plugin.version))),
            };
            MeasureRecipe { name: measure.name(), formula, plugin }
        };
        Ok(Recipe {
            revision: REVISION,
            measures: measures.iter().map(|m| measure(m.as_ref())).collect(),
            windows: self.windows.clone(),
            thresholds: self.thresholds.values().to_vec(),
            threshold_unit: self.threshold_unit.name().to_owned(),
            body: self.body.name().to_owned(),
            weight: self.weight.name().to_owned(),
            nside: field.nside(),
            nside_out: output.nside(),
            max_masked: self.max_masked,
            min_contour: self.min_contour,
            by_threshold: self.by_threshold,
            tolerance: match self.summation {
                Summation::Exact => 0.0,
                Summation::Tolerance(tolerance) | Summation::Prefix(tolerance) => tolerance,
            },
            field: FieldRecipe::default(),
        })
    }
}

impl Recipe {
    /// The first choice that differs from another recipe's, with both values in words: `("windows", "6", "4")`. Of lists
    /// only what the other lacks is named, where both have such.
    pub fn difference(&self, other: &Recipe) -> Option<(&'static str, String, String)> {
        let pairs = std::iter::zip(self.choices(), other.choices());
        let ((name, one), (_, other)) = pairs.into_iter().find(|((_, one), (_, other))| one != other)?;
        let lacks = |these: &[String], those: &[String]| -> Vec<String> {
            these.iter().filter(|value| !those.contains(value)).cloned().collect()
        };
        let (only_one, only_other) = (lacks(&one, &other), lacks(&other, &one));
        let both = !only_one.is_empty() && !only_other.is_empty();
        let words = |all: Vec<String>, only: Vec<String>| match if both { only } else { all } {
            list if list.is_empty() => "none".to_owned(),
            list => list.join(", "),
        };
        Some((name, words(one, only_one), words(other, only_other)))
    }

    /// Every choice by its name, with its values in words.
    fn choices(&self) -> [(&'static str, Vec<String>); 17] {
        fn words<T: ToString>(values: &[T]) -> Vec<String> {
            values.iter().map(T::to_string).collect()
        }
        // A new choice does not compile until it is listed.
        let Recipe {
            revision,
            measures,
            windows,
            thresholds,
            threshold_unit,
            body,
            weight,
            nside,
            nside_out,
            max_masked,
            min_contour,
            by_threshold,
            tolerance,
            field,
        } = self;
        let FieldRecipe { place, regridding, mask, layout } = field;
        [
            ("revision", vec![revision.to_string()]),
            ("measures", words(measures)),
            ("windows", words(windows)),
            ("thresholds", words(thresholds)),
            ("threshold unit", vec![threshold_unit.clone()]),
            ("body", vec![body.clone()]),
            ("weight", vec![weight.clone()]),
            ("Nside of the field", vec![nside.to_string()]),
            ("Nside of the result", vec![nside_out.to_string()]),
            ("largest masked share", vec![max_masked.to_string()]),
            ("least contour", vec![min_contour.to_string()]),
            ("each threshold by itself", vec![by_threshold.to_string()]),
            ("tolerance", vec![tolerance.to_string()]),
            ("field", words(place)),
            ("way to HEALPix", words(regridding)),
            ("mask", words(mask)),
            ("layout", words(layout)),
        ]
    }
}

impl MeasureRecipe {
    /// The name of the measure's column in a file.
    pub fn column(&self) -> String {
        column_of(&self.name)
    }
}

impl fmt::Display for MeasureRecipe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.formula, &self.plugin) {
            (Some(formula), _) => f.write_str(formula),
            (None, Some(plugin)) => write!(f, "{} of {plugin}", self.name),
            (None, None) => f.write_str(&self.name),
        }
    }
}

#[cfg(test)]
mod tests {
    use longan_measures::{Formula, Weight, find};

    use super::*;
    use crate::analysis::ThresholdUnit;
    use crate::contour::Body;

    fn recipe(analysis: &Analysis) -> Recipe {
        analysis.recipe(Healpix::new(64).unwrap(), &[find("evq").unwrap()]).unwrap()
    }

    #[test]
    fn a_default_written_out_makes_no_other_recipe() {
        let written = Analysis {
            windows: vec![6.0],
            thresholds: "-3:3:13".parse().unwrap(),
            nside_out: Some(16),
            ..Analysis::default()
        };
        assert_eq!(recipe(&Analysis::default()), recipe(&written));
        assert_eq!(recipe(&written).difference(&recipe(&Analysis::default())), None);
    }

    #[test]
    fn every_choice_makes_another_recipe() {
        let default = Analysis::default;
        let others = [
            Analysis { windows: vec![5.0], ..default() },
            Analysis { windows: vec![6.0, 5.0], ..default() },
            Analysis { thresholds: "0".parse().unwrap(), ..default() },
            Analysis { threshold_unit: ThresholdUnit::Value, ..default() },
            Analysis { body: Body::Below, ..default() },
            Analysis { weight: Weight::Curvature, ..default() },
            Analysis { nside_out: Some(8), ..default() },
            Analysis { max_masked: 0.5, ..default() },
            Analysis { min_contour: 1.0, ..default() },
            Analysis { by_threshold: true, ..default() },
            Analysis { summation: Summation::Exact, ..default() },
            Analysis { summation: Summation::Tolerance(1e-5), ..default() },
        ];
        let mut seen = vec![recipe(&default())];
        for analysis in others {
            let recipe = recipe(&analysis);
            assert!(!seen.contains(&recipe), "{analysis:?}");
            assert!(recipe.difference(&seen[0]).is_some());
            seen.push(recipe);
        }
        let formula = |text| {
            let measure: [Box<dyn Measure>; 1] = [Box::new(Formula::new(text).unwrap())];
            Analysis::default().recipe(Healpix::new(64).unwrap(), &measure).unwrap()
        };
        let [one, other] = ["x = psi2/w1", "x = psi2/w2"].map(formula);
        assert_eq!(one.difference(&other), Some(("measures", "x = psi2/w1".to_owned(), "x = psi2/w2".to_owned())));
        let mut masked = one.clone();
        masked.field.mask = vec!["threshold=0.9".to_owned()];
        assert_eq!(one.difference(&masked), Some(("mask", "none".to_owned(), "threshold=0.9".to_owned())));
        let (coarse, fine) = (Healpix::new(8).unwrap(), Healpix::new(32).unwrap());
        let evq = [find("evq").unwrap()];
        assert_ne!(Analysis::default().recipe(coarse, &evq), Analysis::default().recipe(fine, &evq));
    }
}
