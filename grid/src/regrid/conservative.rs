//! Weights that keep integrals: the areas that cells and pixels share.
//!
//! In the HEALPix projection (Górski et al. 2005, ApJ 622, 759; Calabretta & Roukema 2007, MNRAS 381, 865) areas are
//! those on the sphere, pixels are squares on their tip, parallels horizontal, and meridians straight: upright about the
//! equator, towards the tip of their quadrant in the polar caps. So the part of a pixel between two parallels and west
//! of a meridian is a trapezoid cut by a line. A cell's share is the difference of two of these.
//!
//! The plane's unit is half a pixel's diagonal: x runs from 0 to 8 Nside with longitude, y from −2 Nside at the south
//! pole to 2 Nside, and pixels lie at whole numbers, one unit to each tip.

use super::{LatLon, RingWeights, for_rings};
use crate::Healpix;

/// The weights of each ring.
pub(super) fn weights(from: &LatLon, to: Healpix) -> Vec<RingWeights> {
    let nside = to.nside() as f64;
    let rows: Vec<Row> = from.latitudes.cells.iter().map(|cell| Row::new(nside, cell)).collect();
    let columns = columns(from, nside);
    for_rings(to, |i| ring(from, to, &rows, &columns, i))
}

/// A parallel.
#[derive(Clone, Copy)]
struct Level {
    y: f64,
    /// The distance from the pole, 2 Nside − |y|, without cancellation near it.
    from_pole: f64,
}

impl Level {
    fn of_latitude(nside: f64, degrees: f64) -> Self {
        // The root of 3 (1 − |z|), which is 1 at the edge of the caps.
        let sigma = 6f64.sqrt() * (0.5 * (90.0 - degrees.abs()).to_radians()).sin();
        if sigma < 1.0 {
            let from_pole = nside * sigma;
            Level { y: (2.0 * nside - from_pole).copysign(degrees), from_pole }
        } else {
            Level::at(nside, 1.5 * nside * degrees.to_radians().sin())
        }
    }

    fn at(nside: f64, y: f64) -> Self {
        Level { y, from_pole: 2.0 * nside - y.abs() }
    }
}

/// A row of cells.
struct Row {
    /// The number of its latitude.
    index: usize,
    south: Level,
    north: Level,
}

impl Row {
    fn new(nside: f64, cell: &super::lat_lon::Cell) -> Self {
        let [south, north] = [cell.low, cell.high].map(|degrees| Level::of_latitude(nside, degrees));
        Row { index: cell.index, south, north }
    }
}

/// A column of cells, or the part of one on either side of longitude 0, by its meridians' x at the equator.
struct Column {
    /// The number of its longitude.
    index: usize,
    west: f64,
    east: f64,
}

/// All columns from 0 to 8 Nside eastward, preceded by what a pixel at x = 0 meets of the last ones.
fn columns(from: &LatLon, nside: f64) -> Vec<Column> {
    let x = |degrees: f64| degrees / 45.0 * nside;
    let around = 8.0 * nside;
    let mut columns = Vec::new();
    for cell in &from.longitudes.cells {
        let index = cell.index;
        let turn = 360.0 * (cell.low / 360.0).floor();
        let (west, east) = (x(cell.low - turn), x(cell.high - turn));
        columns.push(Column { index, west, east: east.min(around) });
        if east > around {
            columns.push(Column { index, west: 0.0, east: x(cell.high - (turn + 360.0)) });
        }
    }
    let last = columns.iter().filter(|column| column.east > around - 1.0);
    let before: Vec<Column> =
        last.map(|c| Column { index: c.index, west: c.west - around, east: c.east - around }).collect();
    columns.extend(before);
    columns.retain(|column| column.west < column.east);
    columns.sort_by(|a, b| a.west.total_cmp(&b.west));
    columns
}

/// What of a pixel's northern or southern half is in a row of cells: between two parallels, for all pixels of a ring.
struct Slab {
    height: f64,
    ends: [End; 2],
}

/// A slab's upper or lower end.
struct End {
    /// Half the pixel's width here.
    half: f64,
    /// The distance between meridians, as a part of that at the equator.
    scale: f64,
    /// The inverse of `scale`; 0 at the pole, where there is no width.
    inverse: f64,
}

impl Slab {
    /// The slab between two whole y, of which one is that of the pixels' centres, `y`.
    fn new(nside: f64, [low, high]: [f64; 2], y: f64, row: &Row) -> Option<Self> {
        let in_cap = low >= nside || high <= -nside;
        let distance = |a: Level, b: Level| if in_cap { a.from_pole - b.from_pole } else { a.y - b.y }.abs();
        let [low, high, centre] = [low, high, y].map(|y| Level::at(nside, y));
        let low = if row.south.y > low.y { row.south } else { low };
        let high = if row.north.y < high.y { row.north } else { high };
        let height = distance(low, high);
        let ends = [low, high].map(|level| {
            let scale = if in_cap { level.from_pole / nside } else { 1.0 };
            End { half: 1.0 - distance(level, centre), scale, inverse: if scale > 0.0 { scale.recip() } else { 0.0 } }
        });
        (low.y < high.y && height > 0.0).then_some(Slab { height, ends })
    }

    /// The area west of a meridian. The meridian's x at the equator and that of the pixel's centre count from a meridian
    /// that is upright all along the pixel.
    fn west_of(&self, meridian: f64, centre: f64) -> f64 {
        let [a, b] = &self.ends;
        let [at_a, at_b] = [a, b].map(|end| meridian * end.scale - centre);
        // How far the meridian is east of the western and of the eastern edge.
        let (west_a, west_b) = (at_a + a.half, at_b + b.half);
        let (east_a, east_b) = (at_a - a.half, at_b - b.half);
        if west_a <= 0.0 && west_b <= 0.0 {
            0.0
        } else if east_a >= 0.0 && east_b >= 0.0 {
            (a.half + b.half) * self.height
        } else {
            (mean_positive_part(west_a, west_b) - mean_positive_part(east_a, east_b)) * self.height
        }
    }
}

/// The mean of what is positive of a linear function, from its values at both ends.
fn mean_positive_part(a: f64, b: f64) -> f64 {
    if a >= 0.0 && b >= 0.0 {
        0.5 * (a + b)
    } else {
        let (low, high) = (a.min(b), a.max(b));
        if high <= 0.0 { 0.0 } else { 0.5 * high * (high / (high - low)) }
    }
}

/// What of a ring's pixels is in one row of cells.
struct Strip {
    /// The number of the row's latitude.
    row: usize,
    slabs: Vec<Slab>,
    /// The first column that a pixel meets; it never goes back along the ring.
    first: usize,
}

impl Strip {
    /// Where the pixel's westernmost and easternmost meridians cross the equator.
    fn extent(&self, centre: f64) -> (f64, f64) {
        let ends = self.slabs.iter().flat_map(|slab| &slab.ends);
        ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(west, east), end| {
            (west.min((centre - end.half) * end.inverse), east.max((centre + end.half) * end.inverse))
        })
    }

    fn west_of(&self, meridian: f64, centre: f64) -> f64 {
        self.slabs.iter().map(|slab| slab.west_of(meridian, centre)).sum()
    }
}

/// The weights of the pixels on one ring.
fn ring(from: &LatLon, to: Healpix, rows: &[Row], columns: &[Column], i: usize) -> RingWeights {
    const PIXEL_AREA: f64 = 2.0;
    let nside = to.nside() as f64;
    // Coordinates of the plane are rounded by this; smaller shares of a pixel are nothing else.
    let rounding = nside * f64::EPSILON;
    let ring = to.ring(i);
    let y = 2.0 * nside - i as f64;
    let reached = rows.partition_point(|row| row.north.y <= y - 1.0);
    let met = rows[reached..].iter().take_while(|row| row.south.y < y + 1.0);
    let mut strips: Vec<Strip> = met
        .map(|row| {
            let halves = [[y - 1.0, y], [y, y + 1.0]];
            let slabs = halves.into_iter().filter_map(|half| Slab::new(nside, half, y, row)).collect();
            Strip { row: row.index, slabs, first: 0 }
        })
        .collect();

    let mut weights = RingWeights::default();
    for j in 0..ring.len {
        let (upright, centre) = place(to, i, j, ring.shifted);
        for strip in &mut strips {
            let (west, east) = strip.extent(centre);
            let passed = columns[strip.first..].iter().take_while(|column| column.east - upright <= west).count();
            strip.first += passed;
            // How much is west of the last meridian.
            let mut last = (f64::NEG_INFINITY, 0.0);
            for column in columns[strip.first..].iter().take_while(|column| column.west - upright < east) {
                let before = match last {
                    (meridian, area) if meridian == column.west => area,
                    _ => strip.west_of(column.west - upright, centre),
                };
                let area = strip.west_of(column.east - upright, centre);
                last = (column.east, area);
                let share = (area - before) / PIXEL_AREA;
                if share > rounding {
                    weights.push(from.place(strip.row, column.index), share);
                }
            }
        }
        weights.end_pixel();
    }
    weights
}

/// The x of a meridian that is upright all along a pixel, and how far east of it the pixel's centre is.
fn place(to: Healpix, i: usize, j: usize, shifted: bool) -> (f64, f64) {
    let nside = to.nside();
    let from_pole = i.min(4 * nside - i);
    if from_pole <= nside {
        // The middle of the quadrant.
        let (quadrant, number) = (j / from_pole, j % from_pole);
        ((nside + 2 * nside * quadrant) as f64, (2 * number + 1) as f64 - from_pole as f64)
    } else {
        ((2 * j + usize::from(shifted)) as f64, 0.0)
    }
}
