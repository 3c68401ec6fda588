//! Windows from prefix sums against windows summed directly.

use longan::contour::Field;
use longan::moments::{Selection, Weight};
use longan::window::{MovingWindows, Summation, Ways};
use longan::{Body, Healpix, Map, Thresholds};

use super::{masked, noise};

const RANKS: u32 = 8;

/// Masked fraction, area, length and curvature, then ψ_s for s = 1…8, of all windows.
pub(crate) fn moments(
    map: &Map,
    at: &[f64],
    output: usize,
    radius: f64,
    summation: Summation,
    weight: Weight,
) -> (Vec<Vec<f64>>, Ways) {
    let selection = Selection { area: true, length: true, curvature: true, ranks: (1..=RANKS).collect(), weight };
    let thresholds = Thresholds::new(at.to_vec()).unwrap();
    let field = Field::new(map.grid(), map.values(), &thresholds, Body::Above);
    let mut all = MovingWindows {
        field: &field,
        selection: &selection,
        output: Healpix::new(output).unwrap(),
        radii: &[f64::to_radians(radius)],
        summation,
    }
    .visit(
        4 + 2 * RANKS as usize,
        |m, out| {
            out[..4].copy_from_slice(&[m.masked_fraction, m.area, m.length, m.curvature]);
            m.psi.iter().enumerate().for_each(|(i, p)| out[4 + 2 * i..][..2].copy_from_slice(&[p.re, p.im]));
        },
        |_| (),
    );
    let windows = all.remove(0);
    (windows.columns, windows.ways)
}

#[test]
fn prefix_sums_keep_their_tolerance() {
    let mut from_prefix_sums = 0;
    for (nside, output) in [(1, 8), (2, 16), (8, 8), (13, 16), (16, 16), (32, 32), (64, 24)] {
        for radius in [1.0, 3.0, 10.0, 30.0, 60.0, 90.0] {
            if output * nside > 1000 && radius > 30.0 {
                continue;
            }
            for holes in [false, true] {
                let map = masked(&noise(nside, 9, 3), |p| holes && (p % 13 == 4 || p < nside));
                let run = |summation| moments(&map, &[2.0, 4.5], output, radius, summation, Weight::Length);
                let (exact, _) = run(Summation::Exact);
                for tolerance in [1e-5, 1e-9] {
                    let (fast, ways) = run(Summation::Prefix(tolerance));
                    from_prefix_sums += ways.prefix;
                    assert!(ways.error <= tolerance);
                    for p in 0..exact[0].len() {
                        let what = format!("Nside {nside} to {output}, {radius}°, pixel {p}, {tolerance:e}, {ways:?}");
                        let length = exact[2][p];
                        for row in 0..4 {
                            let scale = exact[row][p].abs() + [0.0, 0.0, 0.0, 30.0 * length / nside as f64 + 1e-3][row];
                            assert!(
                                (fast[row][p] - exact[row][p]).abs() <= 1e-11 * scale + 1e-13,
                                "{what}, row {row}: {} {}",
                                fast[row][p],
                                exact[row][p]
                            );
                        }
                        for s in 1..=RANKS as usize {
                            let off = (fast[2 + 2 * s][p] - exact[2 + 2 * s][p])
                                .hypot(fast[3 + 2 * s][p] - exact[3 + 2 * s][p]);
                            assert!(off <= tolerance * length + 1e-13, "{what}, rank {s}: {:e}", off / length);
                        }
                    }
                }
            }
        }
    }
    assert!(from_prefix_sums > 100_000, "{from_prefix_sums}");
}
