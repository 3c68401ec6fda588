//! The findings of a comparison, for people and for programs.

use std::fmt::Write;

use serde::Serialize;

use super::super::options::decimals;

/// The findings of all measures.
#[derive(Serialize)]
pub(super) struct Report {
    /// The file of the data.
    pub(super) data: String,
    /// The number of simulations.
    pub(super) simulations: usize,
    /// Nside of all maps.
    pub(super) nside: usize,
    /// Full width at half maximum of the smoothing.
    pub(super) smoothing_fwhm_deg: Option<f64>,
    /// How large deviations are that are listed, at least.
    pub(super) level_sigma: f64,
    /// The measures.
    pub(super) measures: Vec<OfMeasure>,
    /// The file of the maps.
    pub(super) output: String,
    /// Files of the scatter plot.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) scatter: Vec<String>,
}

/// The findings of one measure.
#[derive(Serialize)]
pub(super) struct OfMeasure {
    /// The column.
    pub(super) measure: String,
    /// Its unit.
    pub(super) unit: String,
    /// Radius of its windows.
    pub(super) window_deg: f64,
    /// The largest deviation of the data in standard deviations, without its sign.
    pub(super) largest_sigma: Option<f64>,
    /// The number of simulations whose largest deviation is as large, each compared with all other maps.
    pub(super) simulations_as_large: Option<usize>,
    /// The probability of one as large anywhere.
    pub(super) p_value: Option<f64>,
    /// The places of the largest deviations.
    pub(super) regions: Vec<Region>,
}

/// A place of large deviation.
#[derive(Serialize)]
pub(super) struct Region {
    pub(super) lon_deg: f64,
    pub(super) lat_deg: f64,
    /// The pixel in RING order.
    pub(super) pixel: usize,
    /// The data's value.
    pub(super) value: f64,
    /// Mean of the simulations.
    pub(super) mean: f64,
    pub(super) standard_deviation: f64,
    pub(super) sigma: f64,
    pub(super) local_percentile: f64,
    pub(super) global_percentile: f64,
    /// The number of simulations at this pixel.
    pub(super) simulations: usize,
}

impl Report {
    /// The report as text.
    pub(super) fn text(&self) -> String {
        let mut out = String::new();
        // Writing to a string does not fail.
        let _ = self.write(&mut out);
        out
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let Report { data, simulations, nside, .. } = self;
        let smoothed = self.smoothing_fwhm_deg.map(|fwhm| format!(", smoothed by {fwhm} deg")).unwrap_or_default();
        writeln!(out, "{data} among {simulations} simulations, Nside {nside}{smoothed}")?;
        for of in &self.measures {
            let unit = if of.unit.is_empty() { String::new() } else { format!(" [{}]", of.unit) };
            write!(out, "\n{}{unit} in windows of {} deg: ", of.measure, of.window_deg)?;
            let (Some(largest), Some(as_large), Some(p)) = (of.largest_sigma, of.simulations_as_large, of.p_value)
            else {
                writeln!(out, "no deviation is defined anywhere")?;
                continue;
            };
            writeln!(
                out,
                "largest deviation {largest:.2} sigma; {as_large} of {simulations} simulations have one as large \
                 somewhere, p = {}",
                decimals(p, 4)
            )?;
            if of.regions.is_empty() {
                writeln!(out, "  no deviation of {} sigma or more", self.level_sigma)?;
                continue;
            }
            let head = ["lon [deg]", "lat [deg]", "value", "mean", "std. dev.", "sigma", "local %", "global %", "sims"];
            let [lon, lat, value, mean, std, sigma, local, global, sims] = head;
            writeln!(
                out,
                "  {lon:>9} {lat:>9} {value:>12} {mean:>12} {std:>12} {sigma:>7} {local:>8} {global:>8} {sims:>6}"
            )?;
            for r in &of.regions {
                let [value, mean, std] = [r.value, r.mean, r.standard_deviation].map(|x| decimals(x, 4));
                writeln!(
                    out,
                    "  {:>9.2} {:>9.2} {value:>12} {mean:>12} {std:>12} {:>7.2} {:>8.2} {:>8.2} {:>6}",
                    r.lon_deg, r.lat_deg, r.sigma, r.local_percentile, r.global_percentile, r.simulations
                )?;
            }
        }
        let written: Vec<&str> = std::iter::once(&self.output).chain(&self.scatter).map(String::as_str).collect();
        writeln!(out, "\nwritten: {}", written.join(", "))
    }
}
