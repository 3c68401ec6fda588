//! Values at points against plain sums over all of them, and against the fields that they are samples of.

use crate::*;
use longan_formats::{Ask, Error, ErrorKind};

/// A field of the first and second degree.
fn harmonic([x, y, z]: [f64; 3]) -> f64 {
    0.3 + x - 2.0 * y + 3.0 * x * z + z * z
}

const GATHERS: [Gather; 4] =
    [Gather::Mean, Gather::Nearest, Gather::Gaussian { fwhm: 9.0 }, Gather::Gaussian { fwhm: 0.5 }];

/// Points that lie densely in places, some of them on each other.
fn uneven(count: usize) -> Vec<[f64; 3]> {
    let mut next = noise(7);
    let mut points: Vec<[f64; 3]> = Vec::new();
    for i in 0..count {
        let (z, phi) = (1.0 - 2.0 * next().powi(2), TAU * next());
        let r = (1.0 - z * z).sqrt();
        points.push(if i % 10 == 9 { points[i / 2] } else { [r * phi.cos(), r * phi.sin(), z] });
    }
    points
}

/// Gathers by plain sums, with the angle to the nearest point for each pixel.
fn plainly(points: &[[f64; 3]], values: &[f64], grid: Healpix, gather: Gather) -> Vec<(f64, f64)> {
    let pixel = |&[x, y, z]: &[f64; 3]| grid.pixel_at(x.hypot(y).atan2(z), y.atan2(x));
    let pixels: Vec<usize> = points.iter().map(pixel).collect();
    let mean = |weights: &[f64]| {
        let sum: f64 = weights.iter().zip(values).map(|(w, v)| w * v).sum();
        sum / weights.iter().sum::<f64>()
    };
    let of_pixel = |p: usize| {
        let angles: Vec<f64> = points.iter().map(|&point| angle(point, centre(grid, p))).collect();
        let near = angles.iter().copied().fold(f64::INFINITY, f64::min);
        let nearest = values[angles.iter().position(|&a| a < near + 1e-9).unwrap()];
        let weights: Vec<f64> = match gather {
            Gather::Nearest => vec![0.0; points.len()],
            Gather::Mean => pixels.iter().map(|&q| f64::from(u8::from(q == p))).collect(),
            Gather::Gaussian { fwhm } => {
                // The width at which the weight is one half, on either side.
                let sigma = fwhm.to_radians() / 2.0 / (2.0 * 2f64.ln()).sqrt();
                angles.iter().map(|a| if *a < 6.0 * sigma { (-0.5 * (a / sigma).powi(2)).exp() } else { 0.0 }).collect()
            }
        };
        (if weights.iter().all(|w| *w == 0.0) { nearest } else { mean(&weights) }, near)
    };
    (0..grid.pixels()).map(of_pixel).collect()
}

#[test]
fn every_way_agrees_with_plain_sums() {
    let points = uneven(400);
    // Values that tell points on each other apart.
    let values: Vec<f64> = points.iter().enumerate().map(|(i, &p)| harmonic(p) + i as f64 * 0.01).collect();
    let rows = points.iter().zip(&values).map(|(&p, v)| format!("{},{},{v}\n", degrees(p).0, degrees(p).1));
    let text = "lon,lat,v\n".to_owned() + &rows.collect::<String>();
    for gather in GATHERS {
        for reach in [8.0, 180.0] {
            let regrid = Regrid { gather: Some(gather), reach: Some(reach), ..Regrid::default() };
            let map = read_with(text.as_bytes(), &nside(8, regrid)).unwrap();
            let plain = plainly(&points, &values, map.grid(), gather);
            assert!(reach > 90.0 || map.values().iter().any(|v| v.is_nan()));
            for (p, (found, (expected, near))) in map.values().iter().zip(plain).enumerate() {
                let near = near.to_degrees();
                assert!((near - reach).abs() > 1e-9, "the test decides nothing");
                assert_eq!(found.is_nan(), near > reach, "{gather:?}, pixel {p}, {near}°");
                assert!(found.is_nan() || (found - expected).abs() < 1e-9, "{gather:?}, pixel {p}: {found} {expected}");
            }
        }
    }
}

#[test]
fn a_constant_stays_what_it_is() {
    let text = table(&uneven(500), |_| 0.1);
    for gather in GATHERS {
        let map = read_with(text.as_bytes(), &nside(16, super::gather(gather))).unwrap();
        assert!(map.values().iter().all(|v| *v == 0.1 || v.is_nan()));
        assert!(map.values().contains(&0.1));
    }
}

/// The root mean square difference between a map and the field.
fn error(map: &Map) -> f64 {
    let squares = map.values().iter().enumerate().map(|(p, v)| (v - harmonic(centre(map.grid(), p))).powi(2));
    (squares.sum::<f64>() / map.grid().pixels() as f64).sqrt()
}

#[test]
fn errors_fall_with_the_distance_between_points() {
    // At four times the points, at half the distance, errors of the first order are half as large.
    for (way, least, most) in [(0, 1.7, 2.3), (1, 1.7, 2.3), (2, 3.6, 4.4)] {
        let errors: Vec<f64> = [768, 3072, 12288, 49152]
            .into_iter()
            .map(|count| {
                let spacing = (4.0 * std::f64::consts::PI / count as f64).sqrt().to_degrees();
                let gather = [Gather::Nearest, Gather::Mean, Gather::Gaussian { fwhm: 2.0 * spacing }][way];
                let selection = Selection { regrid: super::gather(gather), ..Selection::default() };
                let map = read_with(table(&fibonacci(count), harmonic).as_bytes(), &selection).unwrap();
                assert_eq!(map.grid().pixels(), count, "the pixels are as large as the distance between points");
                error(&map)
            })
            .collect();
        for pair in errors.windows(2) {
            assert!((least..most).contains(&(pair[0] / pair[1])), "way {way}: {errors:?}");
        }
    }
}

#[test]
fn a_gaussian_damps_harmonics_as_it_should() {
    // Of degree l by exp(−l (l + 1) σ² / 2), up to terms of higher order in σ.
    let text = table(&fibonacci(60_000), |[_, y, z]| y * z);
    let map = read_with(text.as_bytes(), &nside(8, gather(Gather::Gaussian { fwhm: 10.0 }))).unwrap();
    let sigma = 10f64.to_radians() / 2.354820045;
    let damped = (-3.0 * sigma * sigma).exp();
    assert!(1.0 - damped > 0.015);
    assert!(largest_error(&map, |[_, y, z]| damped * y * z) < 1e-4);
}

#[test]
fn the_uncovered_half_is_masked() {
    let points: Vec<[f64; 3]> = fibonacci(6000).into_iter().filter(|[_, _, z]| *z > 0.0).collect();
    let text = table(&points, harmonic);
    let spacing = (4.0 * std::f64::consts::PI / 6000.0).sqrt();
    for gather in GATHERS {
        let default = read_with(text.as_bytes(), &nside(32, super::gather(gather))).unwrap();
        for (p, v) in default.values().iter().enumerate() {
            let latitude = centre(default.grid(), p)[2].asin();
            if latitude > 0.0 {
                assert!(v.is_finite());
            } else if latitude < -2.3 * spacing {
                assert!(v.is_nan());
            }
        }
        let reach = Regrid { gather: Some(gather), reach: Some(20.0), ..Regrid::default() };
        let map = read_with(text.as_bytes(), &nside(32, reach)).unwrap();
        let covered = map.values().iter().filter(|v| v.is_finite()).count() as f64 / map.grid().pixels() as f64;
        assert!((covered - (1.0 + 20f64.to_radians().sin()) / 2.0).abs() < 0.01, "{covered}");
    }
}

#[test]
fn coincident_points() {
    // Twice the same place, written in two ways, and another one.
    let text = "lon,lat,v\n0,45,1\n360,45,3\n90,-45,10\n";
    let at = |gather| {
        let map = read_with(
            text.as_bytes(),
            &nside(1, Regrid { gather: Some(gather), reach: Some(180.0), ..Regrid::default() }),
        )
        .unwrap();
        map.values()[map.grid().pixel_at(45f64.to_radians(), 0.0)]
    };
    assert_eq!(at(Gather::Mean), 2.0);
    assert_eq!(at(Gather::Nearest), 1.0);
    assert!((at(Gather::Gaussian { fwhm: 20.0 }) - 2.0).abs() < 1e-12);
    // Beyond the Gaussian's end, the nearest.
    assert_eq!(at(Gather::Gaussian { fwhm: 5.0 }), 1.0);
}

#[test]
fn one_place_needs_settings() {
    let text = "lon,lat,v\n10,20,1\n10,20,2\n";
    let one_place = |error: &Error| {
        assert_eq!(grid(error), &longan_grid::Error::OnePlace);
        assert_eq!((error.kind(), error.ask()), (ErrorKind::Incomplete, Some(&Ask::Reach)));
    };
    one_place(&problem_with(text.as_bytes(), &Selection::default()).0);
    let reach = Regrid { reach: Some(30.0), ..Regrid::default() };
    one_place(&problem_with(text.as_bytes(), &Selection { regrid: reach.clone(), ..Selection::default() }).0);
    one_place(&problem_with(text.as_bytes(), &nside(4, Regrid::default())).0);
    let map = read_with(text.as_bytes(), &nside(16, reach)).unwrap();
    let covered = map.values().iter().filter(|v| v.is_finite()).count() as f64 / map.grid().pixels() as f64;
    assert!((covered - (1.0 - 30f64.to_radians().cos()) / 2.0).abs() < 0.01);
}

#[test]
fn any_nside_will_do() {
    let text = table(&fibonacci(1000), harmonic);
    for n in [1, 3, 10] {
        assert_eq!(read_with(text.as_bytes(), &nside(n, Regrid::default())).unwrap().grid().nside(), n);
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let file = scratch(table(&uneven(3000), harmonic).as_bytes());
    for gather in GATHERS {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| longan_formats::read(&file.path, &nside(32, super::gather(gather)))).unwrap()
        };
        assert_same(&with(5), &with(1));
    }
}

#[test]
fn settings_that_cannot_be() {
    let text = table(&fibonacci(100), harmonic);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for regrid in [Regrid { reach: Some(bad), ..Regrid::default() }, gather(Gather::Gaussian { fwhm: bad })] {
            let (error, told) = problem_with(text.as_bytes(), &nside(4, regrid));
            assert!(
                matches!(grid(&error), longan_grid::Error::Setting { .. }) && told.contains(&bad.to_string()),
                "{told}"
            );
        }
    }
    for bad in [0, usize::MAX, 1 << 29] {
        let error = problem_with(text.as_bytes(), &nside(bad, Regrid::default())).0;
        assert!(
            matches!(grid(&error), longan_grid::Error::Nside { .. } | longan_grid::Error::Memory { .. }),
            "{error}"
        );
    }
}
