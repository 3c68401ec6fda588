//! Windows from prefix sums against windows summed directly.

use longan::contour::Field;
use longan::moments::{Selection, Weight};
use longan::window::{MovingWindows, Summation, SummationCounts};
use longan::{Body, Healpix, Map, Thresholds};

use longan_support::{masked, noise, rows};

const RANKS: u32 = 8;

/// Masked fraction, area, length and curvature, then ψ_s for s = 1…8, of all windows.
pub(crate) fn moments(
    map: &Map,
    at: &[f64],
    output: usize,
    radius: f64,
    summation: Summation,
    weight: Weight,
) -> (Vec<Vec<f64>>, SummationCounts) {
    let selection = Selection {
        area: true,
        length: true,
        curvature: true,
        ranks: (1..=RANKS).collect(),
        weight,
        by_threshold: false,
    };
    let thresholds = Thresholds::new(at.to_vec()).unwrap();
    let field = Field::new(map.grid(), map.values(), &thresholds, Body::Above);
    let mut all = MovingWindows {
        field: &field,
        selection: &selection,
        output: Healpix::new(output).unwrap(),
        radii: &[f64::to_radians(radius)],
        summation,
    }
    .visit(4 + 2 * RANKS as usize, |m, out| {
        out[..4].copy_from_slice(&[m.masked_fraction, m.area, m.length, m.curvature]);
        m.psi.iter().enumerate().for_each(|(i, p)| out[4 + 2 * i..][..2].copy_from_slice(&[p.re, p.im]));
    });
    let windows = all.remove(0);
    (rows(&windows.values[0]), windows.counts)
}

/// Compares prefix sums with direct ones and tells how many pairs were summed from prefix sums.
fn compare(map: &Map, output: usize, radius: f64, tolerance: f64, weight: Weight) -> SummationCounts {
    let nside = map.grid().nside();
    let run = |summation| moments(map, &[2.0, 4.5], output, radius, summation, weight);
    let (exact, _) = run(Summation::Exact);
    let (fast, ways) = run(Summation::Prefix(tolerance));
    assert!(ways.error <= tolerance);
    for p in 0..exact[0].len() {
        let what = || format!("Nside {nside} to {output}, {radius}°, pixel {p}, {tolerance:e}, {ways:?}");
        let length = exact[2][p];
        // Areas, lengths and masked fractions to rounding. Curvatures cancel within the window: their rounding is that of
        // the turns, of which a piece of contour may have π.
        for (row, scale) in
            [exact[0][p], exact[1][p], length, 30.0 * length * nside as f64 + 1.0].into_iter().enumerate()
        {
            let off = (fast[row][p] - exact[row][p]).abs();
            assert!(off <= 1e-11 * scale.abs() + 1e-13, "{}, row {row}: {off:e} of {}", what(), exact[row][p]);
        }
        for s in 1..=RANKS as usize {
            let off = (fast[2 + 2 * s][p] - exact[2 + 2 * s][p]).hypot(fast[3 + 2 * s][p] - exact[3 + 2 * s][p]);
            if weight == Weight::Length {
                assert!(off <= tolerance * length + 1e-13, "{}, rank {s}: {:e}", what(), off / length);
            }
        }
    }
    ways
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
                for tolerance in [1e-5, 1e-9] {
                    from_prefix_sums += compare(&map, output, radius, tolerance, Weight::Length).prefix;
                }
            }
        }
    }
    assert!(from_prefix_sums > 100_000, "{from_prefix_sums}");
}

/// Fine maps in few windows, about the poles and the seams of belt and caps among others: nearly all pairs are summed from
/// prefix sums at the default tolerance.
#[test]
fn prefix_sums_of_fine_maps_keep_their_tolerance() {
    for (nside, output, radius) in
        [(512, 8, 1.0), (512, 4, 6.0), (512, 2, 30.0), (256, 4, 60.0), (256, 3, 90.0), (128, 16, 10.0), (128, 6, 90.0)]
    {
        let grid = Healpix::new(nside).unwrap();
        // A partial sky with a ragged edge and many holes.
        let partial = |p: usize| grid.centre(p).0 + 0.1 * (p % 7) as f64 > 2.2 || p % 101 == 5;
        for holes in [false, true] {
            let map = masked(&noise(nside, 9, 5), |p| holes && partial(p));
            let ways = compare(&map, output, radius, 1e-7, Weight::Length);
            // Moments of rank 8 in windows of a hemisphere are the hardest.
            let most = if radius < 90.0 { ways.prefix / 10 } else { 2 * ways.prefix };
            assert!(ways.missed <= most && ways.direct == 0, "Nside {nside} to {output}, {radius}°: {ways:?}");
        }
    }
}

#[test]
fn curvature_weighs_as_well() {
    let map = masked(&noise(32, 9, 8), |p| p % 57 == 3);
    compare(&map, 32, 20.0, 1e-7, Weight::Curvature);
    let run = |summation| moments(&map, &[2.0, 4.5], 32, 20.0, summation, Weight::Curvature).0;
    let (exact, fast) = (run(Summation::Exact), run(Summation::Prefix(1e-7)));
    // Each of the two thresholds turns by less than 2π in every cell.
    let most = exact[2].iter().copied().fold(0.0, f64::max) * 32.0 * 2.0;
    for (exact, fast) in exact[4..].iter().zip(&fast[4..]) {
        assert!(longan_support::difference(exact, fast) < 1e-7 * most);
    }
}

/// Prefix sums of a window that holds a whole hemisphere cannot meet a tolerance of rounding: those pairs are summed
/// directly, which the ways tell and the result shows.
#[test]
fn what_misses_the_tolerance_is_summed_directly() {
    let map = noise(16, 9, 2);
    let run = |summation| moments(&map, &[4.5], 16, 140.0, summation, Weight::Length);
    let ((exact, _), (fast, ways)) = (run(Summation::Exact), run(Summation::Prefix(1e-12)));
    assert!(ways.missed > 0 && ways.error <= 1e-12, "{ways:?}");
    let longest = exact[2].iter().copied().fold(0.0, f64::max);
    for (exact, fast) in exact.iter().zip(&fast) {
        assert!(longan_support::difference(exact, fast) < 1e-11 * longest);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_windows() {
    let map = masked(&noise(32, 9, 4), |p| p % 29 == 11);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| moments(&map, &[2.0, 4.5], 64, 15.0, Summation::Prefix(1e-7), Weight::Length))
    };
    let (one, ways) = run(1);
    assert!(ways.prefix > 0);
    for threads in [2, 3, 7] {
        assert_eq!(run(threads), (one.clone(), ways), "{threads} threads");
    }
}
