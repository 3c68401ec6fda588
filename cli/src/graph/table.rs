//! The numbers of a graph as CSV, one value a row.

use super::ensemble::{Ensemble, percentile, quantile};
use super::{Curves, Kind, Plan, Value};

/// Shares of the ensemble whose quantiles are told, each with its column.
const QUANTILES: [(f64, &str); 5] = [
    (0.5, "ensemble_median"),
    (0.025, "ensemble_p2.5"),
    (0.16, "ensemble_p16"),
    (0.84, "ensemble_p84"),
    (0.975, "ensemble_p97.5"),
];

/// The CSV. Columns that do not apply to the graph are left out, cells that do not apply to a row are empty.
pub(super) fn csv(plan: &Plan, data: &[Curves], ensemble: Option<&Ensemble>) -> anyhow::Result<Vec<u8>> {
    let timed = data.iter().any(|curves| curves.time.is_some());
    let mut head = vec!["input"];
    head.extend(timed.then_some("time"));
    head.extend(["measure", "unit", "body"]);
    if plan.region.is_some() {
        head.extend(["region_lon", "region_lat", "region_radius"]);
    }
    head.extend(["window", "threshold", "threshold_sigma", "value", "area_sr", "windows"]);
    if plan.gaussian {
        head.extend(["sigma0", "sigma1", "gaussian"]);
    }
    if ensemble.is_some() {
        head.extend(["simulations", "percentile"]);
        head.extend(QUANTILES.map(|(_, column)| column));
    }
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(&head)?;
    for curves in data {
        for (q, quantity) in plan.quantities.iter().enumerate() {
            for (t, Value { value, windows, gaussian }) in curves.values[q].iter().enumerate() {
                let mut row = vec![curves.path.to_string_lossy().into_owned()];
                row.extend(timed.then(|| curves.time.clone().unwrap_or_default()));
                row.extend([quantity.name.clone(), plan.unit(quantity).to_owned(), plan.body().to_owned()]);
                row.extend(plan.region.iter().flat_map(|region| region.degrees()).map(number));
                let of_windows = matches!(quantity.kind, Kind::Mean(_));
                row.push(if of_windows { number(plan.analysis.windows[0]) } else { String::new() });
                row.push(number(curves.thresholds[t]));
                row.push(curves.in_sigma(plan, t).map(number).unwrap_or_default());
                row.push(number(*value));
                row.push(curves.area.filter(|_| !of_windows).map(number).unwrap_or_default());
                row.push(windows.map(|windows| windows.to_string()).unwrap_or_default());
                if let Some(of_map) = &curves.gaussian {
                    row.extend([of_map.sigma0, of_map.sigma1].map(number));
                    row.push(gaussian.map(number).unwrap_or_default());
                }
                if let Some(ensemble) = ensemble {
                    let all = ensemble.at(q, t);
                    row.extend([all.len().to_string(), number(percentile(all, *value))]);
                    row.extend(QUANTILES.map(|(share, _)| number(quantile(all, share))));
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
