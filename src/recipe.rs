//! The recipe of Minkowski maps: every choice that decides on their values, resolved, so that two recipes are equal
//! exactly where the results would be.
//!
//! A default that is written out makes the recipe that it makes where it is left out. Which files were taken, and how a
//! recipe is written, is left to others.

use longan_grid::Healpix;
use longan_measures::{Measure, Origin};
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

/// How a field was chosen, brought to HEALPix and masked: names and settings, whatever the file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FieldRecipe {
    /// The variable or column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variable: Option<String>,
    /// The table of a FITS file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hdu: Option<usize>,
    /// Places along dimensions, such as `level=500`, in the order of their names.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub select: Vec<String>,
    /// The way to HEALPix and its settings, for a field on another grid or at points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub regrid: Vec<String>,
    /// Pixels whose mask value is below this are masked, where there is a mask.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask_threshold: Option<f64>,
    /// The variable or column of the mask, and places along its dimensions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mask_field: Vec<String>,
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
                Origin::Plugin(plugin) => (None, Some(plugin)),
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
    /// The first choice that differs from another recipe's, with both values: `("windows", "[6.0]", "[4.0]")`.
    pub fn difference(&self, other: &Recipe) -> Option<(&'static str, String, String)> {
        macro_rules! differences {
            ($($field:ident),*) => {
                [$((stringify!($field), format!("{:?}", self.$field), format!("{:?}", other.$field))),*]
            };
        }
        let all = differences!(
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
            field
        );
        all.into_iter().find(|(_, one, other)| one != other)
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
        assert_ne!(formula("x = psi2/w1"), formula("x = psi2/w2"));
        let (coarse, fine) = (Healpix::new(8).unwrap(), Healpix::new(32).unwrap());
        let evq = [find("evq").unwrap()];
        assert_ne!(Analysis::default().recipe(coarse, &evq), Analysis::default().recipe(fine, &evq));
    }
}
