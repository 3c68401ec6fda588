//! Reads from headers how Minkowski maps were made, and tells whether files go together.
//!
//! Only headers are read here.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use longan::measures::Quantity;
use longan::{Recipe, ThresholdUnit, Weight};
use longan_formats::{
    self as formats, At, Card, CardValue, Field, FieldDescription, GridDescription, Selection, TableDescription,
    TablePlace, is_alike, units_differ,
};
use longan_grid::{CoordinateSystem, Map};

use super::super::cards::{card, integer, numbered, real};
use super::super::identity::{INPUTS, Identity, RECIPE};
use super::super::mismatch::of_coordinates;
use super::super::options::{is_same_file, shown};
use super::super::quantity::of_measure;
use super::super::regridding;

/// A file of Minkowski maps.
pub(super) struct MadeFrom {
    /// The file.
    pub(super) path: PathBuf,
    /// How they were made.
    pub(super) recipe: Recipe,
    /// Their coordinate system, where the file names one.
    pub(super) coordinates: Option<CoordinateSystem>,
    /// Their columns.
    pub(super) columns: Vec<Column>,
    /// The unit in which thresholds were given: sigma, or the map's.
    threshold_unit: String,
    /// The place along other dimensions, of which the maps are.
    at: Vec<At>,
    /// The file of the mask; empty where there was none.
    mask: String,
    /// The spacing of what it was made of, in sides of a pixel, where the file says it.
    pub(super) ratio: Option<f64>,
    /// Entries that the comparison's header repeats.
    pub(super) repeated: Vec<Card>,
}

/// A map of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    /// The measure, with window and threshold where the file has several, as in EVQ_WINDOW_4_THRESHOLD_1.
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) quantity: Quantity,
    /// Radius of its windows in degrees, where the file tells.
    pub(super) window: Option<f64>,
    /// The measure as it was asked for: a name, or a formula.
    made: String,
    /// The thresholds that it is of, in the unit in which they were given.
    thresholds: Vec<f64>,
    /// The FITS extension that it is in.
    hdu: Option<usize>,
    /// The name of the map there.
    field: String,
}

impl Column {
    /// One that is still to be made.
    pub(super) fn to_be(name: String, unit: &str, quantity: Quantity) -> Self {
        let (field, made, thresholds) = (name.clone(), name.clone(), Vec::new());
        Column { name, unit: unit.to_owned(), quantity, window: None, made, thresholds, hdu: None, field }
    }

    /// Refuses what cannot be compared.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        ensure!(
            self.quantity.has_mean(),
            "{} is an angle, of which there is no mean or order; compare other measures",
            self.name
        );
        Ok(())
    }

    /// Its name without window and threshold.
    fn measure(&self) -> &str {
        PARTS
            .iter()
            .filter_map(|part| self.name.split_once(part))
            .map(|(measure, _)| measure)
            .next()
            .unwrap_or(&self.name)
    }

    /// Whether a name is its whole one.
    fn is(&self, name: &str) -> bool {
        is_alike(&self.name, name)
    }

    /// Whether a name is its, whole or without window and threshold.
    pub(super) fn is_called(&self, name: &str) -> bool {
        self.is(name) || is_alike(self.measure(), name)
    }

    /// Refuses another column that was not made in the same way.
    fn check_same(&self, path: &Path, other: &Column, other_path: &Path, unit: &str) -> anyhow::Result<()> {
        let window = |column: &Column| column.window.map(|window| format!("{window} degrees")).unwrap_or_default();
        let thresholds = |column: &Column| {
            let listed: Vec<String> = column.thresholds.iter().map(f64::to_string).collect();
            format!("{} {unit}", listed.join(", ")).trim_end().to_owned()
        };
        let facts = [
            ("a window of".to_owned(), window(self), window(other)),
            ("the measure".to_owned(), self.made.clone(), other.made.clone()),
            ("thresholds".to_owned(), thresholds(self), thresholds(other)),
            (format!("{} in the unit", self.name), self.unit.clone(), other.unit.clone()),
        ];
        for (what, mine, others) in &facts {
            ensure!(mine == others, differ(what, (path, mine), (other_path, others)));
        }
        Ok(())
    }
}

/// The beginnings of the names of windows and thresholds in those of columns.
const PARTS: [&str; 2] = ["_WINDOW_", "_THRESHOLD_"];

/// The complaint that a fact differs between two files.
fn differ(what: &str, (path, mine): (&Path, &str), (other, others): (&Path, &str)) -> String {
    let or_none = |value: &str| if value.is_empty() { "none".to_owned() } else { value.to_owned() };
    format!(
        "{} has {what} {}, but {} has {what} {}; compare maps that were made in the same way",
        shown(path),
        or_none(mine),
        shown(other),
        or_none(others)
    )
}

impl MadeFrom {
    /// The provenance that a file states; nothing where it holds no Minkowski map of longan.
    ///
    /// # Errors
    /// Where it cannot be read, or its maps have several times.
    pub(super) fn of(path: &Path, hdu: Option<usize>, at: &[At]) -> anyhow::Result<Option<Self>> {
        let tables = formats::describe(path)?.tables;
        let is_asked_for = |table: &&TableDescription| match table.place {
            TablePlace::Hdu { hdu: this, .. } => hdu.is_none_or(|hdu| hdu == this),
            _ => true,
        };
        let tables: Vec<_> = tables.iter().filter(is_asked_for).filter(|table| is_minkowski(table)).collect();
        let Some(first) = tables.first() else { return Ok(None) };
        if at.is_empty() {
            check_times(path, &tables)?;
        }
        let several = tables.len() > 1 && matches!(first.place, TablePlace::Hdu { .. });
        let identity = Identity::stated(first).with_context(|| shown(path))?;
        let Some(Identity { recipe, .. }) = identity else {
            bail!(
                "{}: an older release of longan made this Minkowski map, whose values may differ; make it again",
                shown(path)
            )
        };
        let columns = tables.iter().flat_map(|table| columns(table, &recipe, several)).collect();
        Ok(Some(Self { at: at.to_owned(), ..Self::of_table(path, first, recipe, columns) }))
    }

    fn of_table(path: &Path, table: &TableDescription, recipe: Recipe, columns: Vec<Column>) -> Self {
        let word = |key: &str| table.card(key).map(words).unwrap_or_default();
        let GridDescription::Healpix { coordinates, .. } = table.grid else { unreachable!("a Minkowski map") };
        let sigma = recipe.threshold_unit == ThresholdUnit::Sigma.name();
        MadeFrom {
            path: path.to_owned(),
            coordinates,
            threshold_unit: if sigma { "sigma".to_owned() } else { word("INUNIT") },
            mask: word("MASKFILE"),
            at: Vec::new(),
            ratio: table.card(regridding::RATIO).and_then(number),
            repeated: repeated(table, &recipe, &columns),
            recipe,
            columns,
        }
    }

    /// The way in which the field came to HEALPix; empty where it was there.
    pub(super) fn way(&self) -> &str {
        self.recipe.field.regridding.first().map_or("", String::as_str)
    }

    /// The choices that have to be the same in all files, each with its name and value.
    fn facts(&self) -> [(&'static str, String); 6] {
        let Recipe { revision, nside_out, body, weight, threshold_unit, min_contour, .. } = &self.recipe;
        [
            ("values of the revision", revision.to_string()),
            ("Nside", nside_out.to_string()),
            ("the body's side", body.clone()),
            ("the weight", weight.clone()),
            ("the unit of thresholds", threshold_unit.clone()),
            ("the least contour in window radii", min_contour.to_string()),
        ]
    }

    /// How masks were applied, each setting with its name and value.
    fn masking(&self) -> [(&'static str, String); 3] {
        let Recipe { field, max_masked, .. } = &self.recipe;
        let threshold = field.mask.iter().find_map(|setting| setting.strip_prefix("threshold="));
        [
            ("the mask", self.mask.clone()),
            ("the mask threshold", threshold.unwrap_or_default().to_owned()),
            ("the largest masked share", max_masked.to_string()),
        ]
    }

    /// Whether another file was made in the same way.
    ///
    /// # Errors
    /// Where a fact differs: the fact, both files and both values.
    pub(super) fn check(&self, other: &MadeFrom, ignore_coordsys: bool) -> anyhow::Result<()> {
        let (path, other_path) = (&*self.path, &*other.path);
        for ((what, mine), (_, others)) in std::iter::zip(self.facts(), other.facts()) {
            ensure!(mine == others, differ(what, (path, &mine), (other_path, &others)));
        }
        let [mine, others] = [self, other].map(MadeFrom::way);
        if !mine.is_empty() && !others.is_empty() {
            ensure!(mine == others, differ("the way to HEALPix", (path, mine), (other_path, others)));
        }
        let (unit, other_unit) = (&self.threshold_unit, &other.threshold_unit);
        ensure!(
            !units_differ(unit, other_unit),
            differ("thresholds in the unit", (path, unit), (other_path, other_unit))
        );
        let [mine, others] = [self, other].map(|file| (shown(&file.path), file.coordinates));
        if let Some(mismatch) = of_coordinates((&mine.0, mine.1), (&others.0, others.1)).filter(|_| !ignore_coordsys) {
            bail!(mismatch);
        }
        let pairs = self.columns.iter().filter_map(|column| Some((column, other.column(column)?)));
        pairs.into_iter().try_for_each(|(column, others)| column.check_same(path, others, other_path, unit))
    }

    /// The differences from the masks of another file, both sides named; nothing where there is none.
    pub(super) fn masked_otherwise(&self, other: &MadeFrom) -> Option<String> {
        let or_none = |value: &str| if value.is_empty() { "none".to_owned() } else { value.to_owned() };
        let same = |mine: &str, others: &str| {
            mine == others || !mine.is_empty() && !others.is_empty() && is_same_file(mine.as_ref(), others.as_ref())
        };
        let both = std::iter::zip(self.masking(), other.masking());
        let different = both.filter(|((_, mine), (_, others))| !same(mine, others));
        let [mine, others] = different
            .map(|((what, mine), (_, others))| [mine, others].map(|value| format!("{what} {}", or_none(&value))))
            .fold([Vec::new(), Vec::new()], |[mut mine, mut others], [one, other]| {
                mine.push(one);
                others.push(other);
                [mine, others]
            });
        let (path, other) = (shown(&self.path), shown(&other.path));
        (!mine.is_empty()).then(|| format!("{path} has {}, but {other} has {}", mine.join(", "), others.join(", ")))
    }

    /// Its column that is the same as one of another file.
    fn column(&self, column: &Column) -> Option<&Column> {
        self.columns.iter().find(|other| other.is(&column.name))
    }

    /// Whether it has a column that is the same.
    pub(super) fn has(&self, column: &Column) -> bool {
        self.column(column).is_some()
    }

    /// Its columns, for people.
    pub(super) fn listed(&self) -> String {
        self.columns.iter().map(|column| column.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// Reads a column.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub(super) fn read(&self, column: &Column) -> Result<Map, formats::Error> {
        let Column { hdu, field, .. } = self.column(column).unwrap_or(column).clone();
        let at = self.at.clone();
        formats::read(&self.path, &Selection { field: Some(Field::Name(field)), hdu, at, ..Selection::default() })
    }
}

/// Refuses maps of several times, of which a comparison takes one.
fn check_times(path: &Path, tables: &[&TableDescription]) -> anyhow::Result<()> {
    let along = tables.iter().find_map(|table| table.dimensions.first());
    if let Some(time) = along {
        bail!(
            "{}: there are maps for {} places along '{}', and a comparison takes one; choose one, such as with \
             --select {}=#0",
            shown(path),
            time.len,
            time.name,
            time.name
        );
    }
    let mut times: Vec<String> = tables.iter().map(|table| table.card("TIME").map(words).unwrap_or_default()).collect();
    times.dedup();
    if times.len() > 1 {
        let numbers: Vec<String> = tables
            .iter()
            .filter_map(|table| match table.place {
                TablePlace::Hdu { hdu, .. } => Some(hdu.to_string()),
                _ => None,
            })
            .collect();
        bail!(
            "{}: there are maps for {} times, and a comparison takes one; choose an extension with --hdu ({} to {}), or make \
             maps of one time alone, with `longan map --select time=...`",
            shown(path),
            times.len(),
            numbers.first().map_or("", String::as_str),
            numbers.last().map_or("", String::as_str)
        );
    }
    Ok(())
}

/// The columns of a table. Where it is one of `several` their names have its.
fn columns(table: &TableDescription, recipe: &Recipe, several: bool) -> Vec<Column> {
    let word = |key: &str| table.card(key).map(words).unwrap_or_default();
    let windows: Vec<f64> = word("WINDOW").split(',').filter_map(|window| window.trim().parse().ok()).collect();
    let weight = if recipe.weight == Weight::Curvature.name() { Weight::Curvature } else { Weight::Length };
    let column = |field: &FieldDescription| {
        let (hdu, field_name, own) = match &table.place {
            TablePlace::Hdu { hdu, name } => (Some(*hdu), field.name.clone(), name.as_deref()),
            TablePlace::Variable { variable } => (None, variable.clone(), None),
            TablePlace::File {} => (None, field.name.clone(), None),
        };
        let legal = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let own: String = own.iter().flat_map(|own| ["_", own]).flat_map(str::chars).map(legal).collect();
        let whole = field_name.clone() + &own;
        let name = if several { whole.clone() } else { field_name.clone() };
        let window = match windows[..] {
            [window] => Some(window),
            _ => windows.iter().copied().find(|window| {
                let part = format!("_WINDOW_{window}").replace('.', "_");
                name.split_once(&part).is_some_and(|(_, rest)| rest.is_empty() || rest.starts_with("_T"))
            }),
        };
        let place = whole.rsplit_once(PARTS[1]).and_then(|(_, place)| place.split('_').next()?.parse::<usize>().ok());
        let thresholds = match place.and_then(|place| recipe.thresholds.get(place.checked_sub(1)?)) {
            Some(threshold) => vec![*threshold],
            None => recipe.thresholds.clone(),
        };
        let bare = PARTS.iter().find_map(|part| Some(field_name.split_once(part)?.0)).unwrap_or(&field_name);
        let made = recipe.measures.iter().find(|measure| is_alike(&measure.column(), bare));
        let made = made.map_or_else(|| bare.to_owned(), ToString::to_string);
        let unit = field.unit.clone().unwrap_or_default();
        let quantity = of_measure(field.quantity.as_ref(), &name, &unit).weighted(weight);
        Column { name, unit, quantity, window, made, thresholds, hdu, field: field_name }
    };
    table.fields.iter().map(column).collect()
}

/// The entries of a table's header that the header of a comparison of these columns repeats.
fn repeated(table: &TableDescription, recipe: &Recipe, columns: &[Column]) -> Vec<Card> {
    const KEYS: [&str; 19] = [
        "INFILE",
        "INFIELD",
        "INUNIT",
        "INNSIDE",
        regridding::WAY,
        regridding::RATIO,
        "INMEAN",
        "INSIGMA",
        "MASKFILE",
        "MASKFLD",
        "MASKTHR",
        "MAXMASK",
        "MINCONT",
        "BODY",
        "WEIGHT",
        "THRUNIT",
        "WINDOW",
        RECIPE,
        INPUTS,
    ];
    let note = "of the map measured, or of how";
    let mut windows: Vec<String> = Vec::new();
    let mut thresholds: Vec<f64> = Vec::new();
    for column in columns {
        windows.extend(column.window.map(|window| window.to_string()).filter(|window| !windows.contains(window)));
        let new: Vec<f64> = column.thresholds.iter().copied().filter(|x| !thresholds.contains(x)).collect();
        thresholds.extend(new);
    }
    let repeat = |key: &str| {
        let value = match key {
            "WINDOW" if windows.len() > 1 => CardValue::Text(windows.join(", ")),
            _ => table.card(key)?.clone(),
        };
        Some(card(key, value, note))
    };
    let mut cards: Vec<Card> = KEYS.into_iter().filter_map(repeat).collect();
    cards.push(integer("NTHRESH", thresholds.len(), "number of thresholds"));
    let number = |key| table.card(key).and_then(number);
    let in_sigma = recipe.threshold_unit == ThresholdUnit::Sigma.name();
    let (zero, one) = match (in_sigma, number("INMEAN"), number("INSIGMA")) {
        (true, Some(mean), Some(sigma)) => (mean, sigma),
        _ => (0.0, 1.0),
    };
    let threshold =
        |(i, x): (usize, &f64)| real(&numbered("THR", i + 1), zero + one * x, "threshold, in the unit of the field");
    cards.extend(thresholds.iter().enumerate().map(threshold));
    cards
}

/// Whether these are Minkowski maps of longan.
pub(super) fn is_minkowski(table: &TableDescription) -> bool {
    let longan = matches!(table.card("CREATOR"), Some(CardValue::Text(creator)) if creator.starts_with("longan "));
    longan && table.card("WINDOW").is_some() && matches!(table.grid, GridDescription::Healpix { .. })
}

/// A value as text.
fn words(value: &CardValue) -> String {
    match value {
        CardValue::Text(text) => text.clone(),
        CardValue::Real(number) => number.to_string(),
        CardValue::Integer(number) => number.to_string(),
        CardValue::Logical(truth) => truth.to_string(),
    }
}

/// A value as a number, if it is one.
fn number(value: &CardValue) -> Option<f64> {
    match value {
        CardValue::Real(number) => Some(*number),
        CardValue::Integer(number) => Some(*number as f64),
        CardValue::Text(_) | CardValue::Logical(_) => None,
    }
}
