//! The picture of a graph: a panel for each measure, curves of all maps, bands of the ensemble.

use longan::Body;
use longan::graph::{BAND_68, BAND_95, Density, Ensemble, Graph, GraphError, Ordinate};
use longan_picture::Drawing;
use longan_picture::axes::BLACK;
use longan_picture::chart::{Band, Chart, Curve, Panel, Sample, Shared};
use ndarray::Array2;

use super::{MapCurves, in_sigma};

/// Ratios of successive thresholds that differ by no more than this share are the same.
const EVEN: f64 = 1e-9;

/// Points of a smooth curve from one threshold to the next.
const FINER: usize = 8;

/// The picture.
pub(super) fn draw(graph: &Graph, data: &[MapCurves], ensemble: Option<&Ensemble>) -> anyhow::Result<Drawing> {
    Ok(chart(graph, data, ensemble)?.draw()?)
}

fn chart(graph: &Graph, data: &[MapCurves], ensemble: Option<&Ensemble>) -> Result<Chart, GraphError> {
    let among = ensemble.map(|ensemble| Among::new(ensemble, data)).transpose()?;
    let panels: Vec<Panel> = (0..graph.ordinates().len()).map(|q| panel(graph, data, among.as_ref(), q)).collect();
    let units: Vec<&str> = data.iter().filter_map(|map| map.unit.as_deref()).collect();
    let unit = match units.first() {
        _ if in_sigma(graph) => "σ",
        Some(unit) if units.len() == data.len() && units.iter().all(|other| other == unit) => unit,
        _ => "",
    };
    let mut legend: Vec<(Sample, String)> =
        data.iter().enumerate().map(|(i, map)| (Sample::Line(i), map.label())).collect();
    if graph.gaussian {
        legend.push((Sample::Dashed, "Gaussian field of the same σ₀, σ₁".to_owned()));
    }
    if let Some(ensemble) = ensemble {
        legend.push((Sample::Bands, format!("68 %, 95 % of {} simulations", ensemble.simulations())));
        if panels.iter().flat_map(|panel| &panel.curves).any(|curve| !curve.marked.is_empty()) {
            legend.push((Sample::Dot, "outside 95 %".to_owned()));
        }
    }
    if graph.analysis.body == Body::Below {
        legend.push((Sample::None, "body below the threshold".to_owned()));
    }
    if let Some([longitude, latitude, radius]) = graph.region.map(|region| region.degrees()) {
        let place = format!("within {radius}° of longitude {longitude}°, latitude {latitude}°");
        // A true minus sign, as on the axes.
        legend.push((Sample::None, place.replace('-', "−")));
    }
    let shared = Shared {
        name: "threshold".to_owned(),
        unit: unit.to_owned(),
        logarithmic: !in_sigma(graph) && evenly_in_logarithm(graph.analysis.thresholds.values()),
    };
    Ok(Chart { shared, panels, legend })
}

/// Whether thresholds were spaced logarithmically.
fn evenly_in_logarithm(thresholds: &[f64]) -> bool {
    let ratio = |pair: &[f64]| pair[1] / pair[0];
    let even = |three: &[f64]| (ratio(&three[1..]) / ratio(three) - 1.0).abs() < EVEN;
    thresholds.len() > 2 && thresholds[0] > 0.0 && thresholds.windows(3).all(even)
}

/// The bands of an ensemble, and the data that lie outside of the widest: ordinate × threshold.
struct Among {
    /// Both ends, and whether the band lies within the other.
    bands: Vec<([Array2<f64>; 2], bool)>,
    /// For each map of data.
    outside: Vec<Array2<bool>>,
}

impl Among {
    fn new(ensemble: &Ensemble, data: &[MapCurves]) -> Result<Self, GraphError> {
        let bands = [BAND_95, BAND_68].map(|band| (ensemble.band(band), band == BAND_68)).into();
        let outside = data.iter().map(|map| ensemble.outside(&map.curves, BAND_95)).collect::<Result<_, _>>()?;
        Ok(Among { bands, outside })
    }
}

fn panel(graph: &Graph, data: &[MapCurves], among: Option<&Among>, q: usize) -> Panel {
    let x = |map: &MapCurves, t: usize| if in_sigma(graph) { map.curves.sigmas[t] } else { map.curves.thresholds[t] };
    let ordinate = &graph.ordinates()[q];
    let thresholds = 0..graph.analysis.thresholds.values().len();
    let mut panel = Panel { name: title(graph, ordinate), unit: ordinate.unit().to_owned(), ..Panel::default() };
    for ([low, high], inner) in among.iter().flat_map(|among| &among.bands) {
        let ends = thresholds.clone().map(|t| (x(&data[0], t), low[[q, t]], high[[q, t]])).collect();
        panel.bands.push(Band { ends, inner: *inner });
    }
    for (colour, map) in data.iter().enumerate() {
        let is_outside = |t: &usize| among.is_some_and(|among| among.outside[colour][[q, *t]]);
        panel.curves.push(Curve {
            points: thresholds.clone().map(|t| (x(map, t), map.curves.values[[q, t]])).collect(),
            colour,
            dashed: false,
            marked: thresholds.clone().filter(is_outside).collect(),
        });
    }
    if let Ordinate::Density(density) = ordinate {
        for (colour, map) in data.iter().enumerate() {
            let Some(gaussian) = &map.curves.gaussian else { continue };
            let expected =
                |(x, threshold): (f64, f64)| (x, density.of(&gaussian.per_area(threshold, graph.analysis.body)));
            let points = thresholds.clone().flat_map(|t| {
                let next = (t + 1).min(thresholds.end - 1);
                let steps = if t < next { FINER } else { 1 };
                (0..steps).map(move |i| (t, next, i as f64 / FINER as f64))
            });
            let between = |a: f64, b: f64, share: f64| a + (b - a) * share;
            let points = points.map(|(t, next, share)| {
                let threshold = between(map.curves.thresholds[t], map.curves.thresholds[next], share);
                (between(x(map, t), x(map, next), share), threshold)
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

fn title(graph: &Graph, ordinate: &Ordinate) -> String {
    let density = match ordinate {
        Ordinate::Mean(_) => match graph.analysis.windows[0] {
            0.0 => return format!("⟨{}⟩ of pixels", ordinate.name()),
            window => return format!("⟨{}⟩, windows of {window}°", ordinate.name()),
        },
        Ordinate::Density(density) => density,
    };
    match density {
        Density::Area => "area fraction W₀/A",
        Density::Length => "contour length W₁/A",
        Density::Curvature => "curvature W₂/A",
        Density::Euler => "Euler characteristic χ/A",
    }
    .to_owned()
}
