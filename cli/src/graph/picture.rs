//! The picture of a graph: a panel for each measure, curves of all maps, bands of the ensemble.

use longan::Body;
use longan_picture::Drawing;
use longan_picture::axes::BLACK;
use longan_picture::chart::{Band, Chart, Curve, Panel, Sample, Shared};

use super::ensemble::{Ensemble, percentile, quantile};
use super::{Curves, Kind, Plan, Quantity};

/// Lower ends of the bands, as shares of the ensemble; the upper ones are as far from 1.
const BANDS: [f64; 2] = [0.025, 0.16];

/// Ratios of successive thresholds that differ by no more than this share are the same.
const EVEN: f64 = 1e-9;

/// Points of a smooth curve from one threshold to the next.
const FINER: usize = 8;

/// The picture.
pub(super) fn draw(plan: &Plan, data: &[Curves], ensemble: Option<&Ensemble>) -> anyhow::Result<Drawing> {
    Ok(chart(plan, data, ensemble).draw()?)
}

fn chart(plan: &Plan, data: &[Curves], ensemble: Option<&Ensemble>) -> Chart {
    let panels: Vec<Panel> = (0..plan.quantities.len()).map(|q| panel(plan, data, ensemble, q)).collect();
    let units: Vec<&str> = data.iter().filter_map(|curves| curves.unit.as_deref()).collect();
    let unit = match units.first() {
        _ if plan.in_sigma() => "σ",
        Some(unit) if units.len() == data.len() && units.iter().all(|other| other == unit) => unit,
        _ => "",
    };
    let mut legend: Vec<(Sample, String)> =
        data.iter().enumerate().map(|(i, curves)| (Sample::Line(i), curves.label())).collect();
    if plan.gaussian {
        legend.push((Sample::Dashed, "Gaussian field of the same σ₀, σ₁".to_owned()));
    }
    if let Some(ensemble) = ensemble {
        legend.push((Sample::Bands, format!("68 %, 95 % of {} simulations", ensemble.count)));
        if panels.iter().flat_map(|panel| &panel.curves).any(|curve| !curve.marked.is_empty()) {
            legend.push((Sample::Dot, "outside 95 %".to_owned()));
        }
    }
    if plan.analysis.body == Body::Below {
        legend.push((Sample::None, "body below the threshold".to_owned()));
    }
    if let Some([longitude, latitude, radius]) = plan.region.map(|region| region.degrees()) {
        let place = format!("within {radius}° of longitude {longitude}°, latitude {latitude}°");
        // A true minus sign, as on the axes.
        legend.push((Sample::None, place.replace('-', "−")));
    }
    let shared = Shared {
        name: "threshold".to_owned(),
        unit: unit.to_owned(),
        logarithmic: !plan.in_sigma() && evenly_in_logarithm(plan.analysis.thresholds.values()),
    };
    Chart { shared, panels, legend }
}

/// Whether thresholds were spaced logarithmically.
fn evenly_in_logarithm(thresholds: &[f64]) -> bool {
    let ratio = |pair: &[f64]| pair[1] / pair[0];
    let even = |three: &[f64]| (ratio(&three[1..]) / ratio(three) - 1.0).abs() < EVEN;
    thresholds.len() > 2 && thresholds[0] > 0.0 && thresholds.windows(3).all(even)
}

fn panel(plan: &Plan, data: &[Curves], ensemble: Option<&Ensemble>, q: usize) -> Panel {
    let x = |curves: &Curves, t: usize| match plan.in_sigma() {
        true => plan.analysis.thresholds.values()[t],
        false => curves.thresholds[t],
    };
    let quantity = &plan.quantities[q];
    let thresholds = 0..plan.analysis.thresholds.values().len();
    let mut panel = Panel { name: title(plan, quantity), unit: plan.unit(quantity).to_owned(), ..Panel::default() };
    if let Some(ensemble) = ensemble {
        panel.bands.extend(BANDS.map(|share| {
            Band {
                ends: thresholds
                    .clone()
                    .map(|t| {
                        let all = ensemble.at(q, t);
                        (x(&data[0], t), quantile(all, share), quantile(all, 1.0 - share))
                    })
                    .collect(),
                inner: share != BANDS[0],
            }
        }));
    }
    for (colour, curves) in data.iter().enumerate() {
        let values = &curves.values[q];
        let outside = |t: &usize| {
            let percent = ensemble.map_or(f64::NAN, |ensemble| percentile(ensemble.at(q, *t), values[*t].value));
            (percent - 50.0).abs() > 100.0 * (0.5 - BANDS[0])
        };
        let points = thresholds.clone().map(|t| (x(curves, t), values[t].value)).collect();
        panel.curves.push(Curve {
            points,
            colour,
            dashed: false,
            marked: thresholds.clone().filter(outside).collect(),
        });
    }
    if let Kind::Density(density) = &quantity.kind {
        for (colour, curves) in data.iter().enumerate() {
            let Some(gaussian) = &curves.gaussian else { continue };
            let expected =
                |(x, threshold): (f64, f64)| (x, (density.of)(&gaussian.per_area(threshold, plan.analysis.body)));
            let points = thresholds.clone().flat_map(|t| {
                let next = (t + 1).min(thresholds.end - 1);
                let steps = if t < next { FINER } else { 1 };
                (0..steps).map(move |i| (t, next, i as f64 / FINER as f64))
            });
            let between = |a: f64, b: f64, share: f64| a + (b - a) * share;
            let points = points.map(|(t, next, share)| {
                (
                    between(x(curves, t), x(curves, next), share),
                    between(curves.thresholds[t], curves.thresholds[next], share),
                )
            });
            // One alone stands out in black.
            let colour = if data.len() == 1 { BLACK } else { colour };
            panel.curves.push(Curve {
                points: points.map(expected).collect(),
                colour,
                dashed: true,
                marked: Vec::new(),
            });
        }
    }
    panel
}

fn title(plan: &Plan, quantity: &Quantity) -> String {
    match (&quantity.kind, plan.analysis.windows[0]) {
        (Kind::Density(density), _) => density.title.to_owned(),
        (Kind::Mean(_), 0.0) => format!("⟨{}⟩ of pixels", quantity.name),
        (Kind::Mean(_), window) => format!("⟨{}⟩, windows of {window}°", quantity.name),
    }
}
