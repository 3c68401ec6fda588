use longan::{contour::*, moments::*, thresholds::*, totals::*, window::*};
use longan_formats::Healpix;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&a[1]).unwrap();
    let values: Vec<f64> = bytes.chunks_exact(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect();
    let grid = Healpix::with_pixels(values.len()).unwrap();
    // csv header
    let csv = std::fs::read_to_string(&a[2]).unwrap();
    let line = csv.lines().find(|l| l.starts_with("# thresholds:")).unwrap();
    let t = Thresholds::new(line[13..].split_whitespace().map(|x| x.parse().unwrap()).collect()).unwrap();
    let radius: f64 = a[3].parse::<f64>().unwrap().to_radians();
    let out = Healpix::new(a[4].parse().unwrap()).unwrap();
    let sel = Selection { area: true, length: true, curvature: true, ranks: (1..=8).collect(), weight: Weight::Length };
    let t0 = std::time::Instant::now();
    let field = Field::new(grid, &values, &t, Body::Above);
    let w = windows(&field, &sel, out, radius, 20, |m, o| { o[0]=m.masked_fraction; o[1]=m.area; o[2]=m.length; o[3]=m.curvature; for (i,p) in m.psi.iter().enumerate() { o[4+2*i]=p.re; o[5+2*i]=p.im; } }, |_| {});
    println!("all: {:?}", t0.elapsed());
    let rows: Vec<Vec<f64>> = csv.lines().filter(|l| !l.starts_with('#')).skip(1).map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    let names: Vec<&str> = csv.lines().find(|l| l.starts_with("pixel")).unwrap().split(',').collect();
    assert_eq!(rows.len(), w[0].len());
    for c in 1..21 {
        let max = rows.iter().map(|r| r[c].abs()).fold(0.0, f64::max);
        let err = rows.iter().zip(&w[c-1]).map(|(r, v)| (v - r[c]).abs()).fold(0.0, f64::max);
        println!("{} {:e} {:e}", names[c], err, err / max);
    }
    let (tot, masked) = totals(&field);
    let csv = std::fs::read_to_string(a[2].replace(".csv", "_totals.csv")).unwrap();
    for (l, t) in csv.lines().skip(2).zip(tot) { let r: Vec<f64> = l.split(',').map(|x| x.parse().unwrap()).collect();
        println!("{:e} {:e} {:e}", t.area - r[1], t.length - r[2], t.curvature - r[3]); }
    println!("masked {masked}");
    for sel in [Selection { length: true, ranks: vec![2], ..Selection::default() }] {
    for _ in 0..3 {
    let t0 = std::time::Instant::now();
    let field = Field::new(grid, &values, &t, Body::Above);
    println!("bins: {:?}", t0.elapsed());
    let w = windows(&field, &sel, out, radius, 1, |m, o| o[0] = m.length, |_| {});
    println!("evq: {:?} {}", t0.elapsed(), w[0][0]);
    }}
}
