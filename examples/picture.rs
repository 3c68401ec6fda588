//! A picture of a Minkowski map with the contours of its field, as SVG and PNG.
//!
//! Run with `cargo run --release --example picture`, which writes `evq.svg` and `evq.png`.

use longan::measures::find;
use longan::simulate::Waves;
use longan::{Analysis, Healpix, ThresholdUnit, Thresholds, contour_lines, go_on};
use longan_picture::{Circle, Colouring, Options, Overlays, draw};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let field = Waves::new(8.0, 1)?.map(Healpix::new(128)?);
    let one = Thresholds::new(vec![1.0])?;
    let analysis = Analysis {
        windows: vec![10.0],
        thresholds: one.clone(),
        threshold_unit: ThresholdUnit::Value,
        nside_out: Some(64),
        ..Analysis::default()
    };
    let maps = analysis.minkowski_maps(&field, &[find("evq")?], go_on)?;

    let options = Options {
        title: "Where the outlines above 1 are stretched".to_owned(),
        label: "EVQ in windows of 10°".to_owned(),
        colouring: Colouring { log: true, range: (Some(1.0), Some(10.0)), ..Colouring::default() },
        overlays: Overlays {
            lines: contour_lines(&field, &one, analysis.body),
            circles: vec![Circle { centre: (0.0, 0.0), radius: maps.blocks[0].window }],
            ..Overlays::default()
        },
        ..Options::default()
    };
    let drawing = draw(&maps["evq"], &options)?;
    std::fs::write("evq.svg", drawing.svg())?;
    Ok(std::fs::write("evq.png", drawing.png()?)?)
}
