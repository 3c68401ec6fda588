//! The numbers of a graph as CSV, one value a row.

use longan::graph::{BAND_68, BAND_95, Ensemble, Graph};

use super::MapCurves;

/// Shares of the ensemble whose quantiles are told, each with its column.
const QUANTILES: [(f64, &str); 5] = [
    (0.5, "ensemble_median"),
    (BAND_95[0], "ensemble_p2.5"),
    (BAND_68[0], "ensemble_p16"),
    (BAND_68[1], "ensemble_p84"),
    (BAND_95[1], "ensemble_p97.5"),
];

/// The CSV. Columns that do not apply to the graph are left out, cells that do not apply to a row are empty.
pub(super) fn csv(graph: &Graph, data: &[MapCurves], ensemble: Option<&Ensemble>) -> anyhow::Result<Vec<u8>> {
    let timed = data.iter().any(|map| map.time.is_some());
    let mut head = vec!["input"];
    head.extend(timed.then_some("time"));
    head.extend(["measure", "unit", "body"]);
    if graph.region.is_some() {
        head.extend(["region_lon", "region_lat", "region_radius"]);
    }
    head.extend(["window", "threshold", "threshold_sigma", "value", "area_sr", "windows"]);
    if graph.gaussian {
        head.extend(["sigma0", "sigma1", "gaussian"]);
    }
    if ensemble.is_some() {
        head.extend(["simulations", "percentile"]);
        head.extend(QUANTILES.map(|(_, column)| column));
    }
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(&head)?;
    let body = graph.analysis.body.name();
    let quantiles: Vec<_> =
        ensemble.iter().flat_map(|ensemble| QUANTILES.map(|(share, _)| ensemble.quantile(share))).collect();
    let counts = ensemble.map(Ensemble::counts);
    for MapCurves { path, time, curves, .. } in data {
        let percentiles = ensemble.map(|ensemble| ensemble.percentile(curves)).transpose()?;
        for (q, curve) in curves.iter().enumerate() {
            for (t, value) in curve.values.iter().enumerate() {
                let mut row = vec![path.to_string_lossy().into_owned()];
                row.extend(timed.then(|| time.clone().unwrap_or_default()));
                row.extend([curve.ordinate.name(), curve.ordinate.unit().to_owned(), body.to_owned()]);
                row.extend(graph.region.iter().flat_map(|region| region.degrees()).map(number));
                row.push(curve.windows.map(|_| number(graph.analysis.windows[0])).unwrap_or_default());
                row.extend([curves.thresholds[t], curves.sigmas[t], *value].map(number));
                row.push(curves.area.filter(|_| curve.windows.is_none()).map(number).unwrap_or_default());
                row.push(curve.windows.map(|windows| windows[t].to_string()).unwrap_or_default());
                if let Some(of_map) = &curves.gaussian {
                    row.extend([of_map.sigma0, of_map.sigma1].map(number));
                    row.push(curve.expected.map(|expected| number(expected[t])).unwrap_or_default());
                }
                if let (Some(counts), Some(percentiles)) = (&counts, &percentiles) {
                    row.extend([counts[[q, t]].to_string(), number(percentiles[[q, t]])]);
                    row.extend(quantiles.iter().map(|quantile| number(quantile[[q, t]])));
                }
                csv.write_record(&row)?;
            }
        }
    }
    Ok(csv.into_inner()?)
}

/// A number in full; nothing for one that is not defined.
fn number(x: f64) -> String {
    match x.abs() {
        _ if x.is_nan() => String::new(),
        0.0 | 1e-5..1e16 => x.to_string(),
        _ => format!("{x:e}"),
    }
}
