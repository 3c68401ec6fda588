//! Surfaces in PLY: every layout gives the same map, and the map is that of plain geometry over all triangles.

use longan_formats::{Ask, ErrorKind, GridDescription};

use crate::*;

/// A surface with values.
#[derive(Clone, Default)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<[f64; 3]>,
    pub(crate) values: Vec<f64>,
    pub(crate) faces: Vec<Vec<usize>>,
}

impl Mesh {
    fn with_values(mut self, value: impl Fn([f64; 3]) -> f64) -> Self {
        self.values = self.vertices.iter().map(|&v| value(v)).collect();
        self
    }

    fn moved(mut self, to: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.vertices.iter_mut().for_each(|v| *v = to(*v));
        self
    }

    /// Both surfaces in one.
    fn and(mut self, other: Mesh) -> Self {
        let first = self.vertices.len();
        self.vertices.extend(other.vertices);
        self.values.extend(other.values);
        self.faces.extend(other.faces.into_iter().map(|face| face.into_iter().map(|v| v + first).collect()));
        self
    }

    /// A text file.
    pub(crate) fn ply(&self) -> Vec<u8> {
        Layout::default().write(self)
    }
}

/// An octahedron whose faces are cut into four, several times; vertices are single-precision numbers.
pub(crate) fn sphere(levels: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let axes =
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    mesh.vertices.extend(axes);
    for i in 0..4 {
        mesh.faces.extend([vec![i, (i + 1) % 4, 4], vec![(i + 1) % 4, i, 5]]);
    }
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let vertices = &mut mesh.vertices;
        let mut middle = |a: usize, b: usize| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let sum: [f64; 3] = std::array::from_fn(|i| vertices[a][i] + vertices[b][i]);
                vertices.push(sum.map(|c| f64::from((c / dot(sum, sum).sqrt()) as f32)));
                vertices.len() - 1
            })
        };
        let cut = |face: Vec<usize>| {
            let [a, b, c] = face[..] else { unreachable!() };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [vec![a, ab, ca], vec![b, bc, ab], vec![c, ca, bc], vec![ab, bc, ca]]
        };
        mesh.faces = std::mem::take(&mut mesh.faces).into_iter().flat_map(cut).collect();
    }
    mesh.with_values(harmonic)
}

/// A binary file.
pub(crate) fn binary(mesh: &Mesh) -> Vec<u8> {
    Layout { format: "binary_little_endian", ..Layout::default() }.write(mesh)
}

/// A field of the second degree, in single precision.
fn harmonic([x, y, z]: [f64; 3]) -> f64 {
    f64::from((0.3 + x - 2.0 * y + 3.0 * x * z) as f32)
}

/// How a file is laid out.
#[derive(Clone, Copy)]
struct Layout {
    format: &'static str,
    /// Type of positions and values.
    real: &'static str,
    /// Types of the corners of faces.
    list: [&'static str; 2],
    /// Whether there are other elements, lists and properties.
    extra: bool,
    faces_first: bool,
    end: &'static str,
    corners: &'static str,
}

impl Default for Layout {
    fn default() -> Self {
        Layout {
            format: "ascii",
            real: "double",
            list: ["uchar", "int"],
            extra: false,
            faces_first: false,
            end: "\n",
            corners: "vertex_indices",
        }
    }
}

impl Layout {
    /// Appends a number.
    fn put(&self, to: &mut Vec<u8>, kind: &str, value: f64) {
        let mut bytes = match kind {
            "char" | "int8" => (value as i8).to_le_bytes().to_vec(),
            "uchar" | "uint8" => (value as u8).to_le_bytes().to_vec(),
            "short" | "int16" => (value as i16).to_le_bytes().to_vec(),
            "ushort" | "uint16" => (value as u16).to_le_bytes().to_vec(),
            "int" | "int32" => (value as i32).to_le_bytes().to_vec(),
            "uint" | "uint32" => (value as u32).to_le_bytes().to_vec(),
            "float" | "float32" => (value as f32).to_le_bytes().to_vec(),
            "double" | "float64" => value.to_le_bytes().to_vec(),
            _ => unreachable!(),
        };
        match self.format {
            "ascii" => bytes = format!("{value} ").into_bytes(),
            "binary_big_endian" => bytes.reverse(),
            _ => {}
        }
        to.extend(bytes);
    }

    fn end_line(&self, to: &mut Vec<u8>) {
        if self.format == "ascii" {
            to.extend(self.end.bytes());
        }
    }

    fn write(&self, mesh: &Mesh) -> Vec<u8> {
        let (real, [count, corner]) = (self.real, self.list);
        let mut header =
            vec!["ply".to_owned(), format!("format {} 1.0", self.format), "comment element x 3".to_owned()];
        let mut body = Vec::new();
        if self.extra {
            header.extend(
                ["obj_info made here", "element patch 2", "property list ushort double weights", "property char id"]
                    .map(str::to_owned),
            );
            for entry in [vec![1.5, 2.5, -3.5], vec![]] {
                self.put(&mut body, "ushort", entry.len() as f64);
                entry.iter().for_each(|&w| self.put(&mut body, "double", w));
                self.put(&mut body, "char", -7.0);
                self.end_line(&mut body);
            }
            header.push("element nothing 99999999999".to_owned());
        }
        let vertices = || {
            let (mut header, mut body) = (vec![format!("element vertex {}", mesh.vertices.len())], Vec::new());
            let extras = ["uchar red", "list uint8 int16 rings", "float32 nx", "ushort flags"];
            if self.extra {
                header.extend(extras.map(|extra| format!("property {extra}")));
            }
            header.extend(["z", "value", "x", "y"].map(|name| format!("property {real} {name}")));
            for (&[x, y, z], &value) in mesh.vertices.iter().zip(&mesh.values) {
                if self.extra {
                    for (kind, number) in [
                        ("uchar", 200.0),
                        ("uint8", 2.0),
                        ("int16", -300.0),
                        ("int16", 5.0),
                        ("float32", 0.5),
                        ("ushort", 9.0),
                    ] {
                        self.put(&mut body, kind, number);
                    }
                }
                [z, value, x, y].into_iter().for_each(|v| self.put(&mut body, real, v));
                self.end_line(&mut body);
            }
            (header, body)
        };
        let faces = || {
            let (mut header, mut body) = (vec![format!("element face {}", mesh.faces.len())], Vec::new());
            if self.extra {
                header.push("property list uchar float texcoord".to_owned());
            }
            header.push(format!("property list {count} {corner} {}", self.corners));
            if self.extra {
                header.push("property double area".to_owned());
            }
            for face in &mesh.faces {
                if self.extra {
                    [2.0, 0.25, 0.5]
                        .into_iter()
                        .zip(["uchar", "float", "float"])
                        .for_each(|(v, kind)| self.put(&mut body, kind, v));
                }
                self.put(&mut body, count, face.len() as f64);
                face.iter().for_each(|&v| self.put(&mut body, corner, v as f64));
                if self.extra {
                    self.put(&mut body, "double", 1.0);
                }
                self.end_line(&mut body);
            }
            (header, body)
        };
        let parts = if self.faces_first { [faces(), vertices()] } else { [vertices(), faces()] };
        for (lines, bytes) in parts {
            header.extend(lines);
            body.extend(bytes);
        }
        header.push("end_header".to_owned());
        let mut file: Vec<u8> = header.iter().flat_map(|line| (line.clone() + self.end).into_bytes()).collect();
        file.extend(body);
        file
    }
}

/// What a ray meets of a triangle: the distance and the value (Möller & Trumbore 1997).
fn meet(mesh: &Mesh, [a, b, c]: [usize; 3], ray: [f64; 3]) -> Option<(f64, f64)> {
    let minus = |p: [f64; 3], q: [f64; 3]| std::array::from_fn::<f64, 3, _>(|i| p[i] - q[i]);
    let origin = mesh.vertices[a];
    let (to_b, to_c) = (minus(mesh.vertices[b], origin), minus(mesh.vertices[c], origin));
    let p = cross(ray, to_c);
    let determinant = dot(to_b, p);
    let from = minus([0.0; 3], origin);
    let u = dot(from, p) / determinant;
    let q = cross(from, to_b);
    let (v, t) = (dot(ray, q) / determinant, dot(to_c, q) / determinant);
    let inside = determinant != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0;
    inside.then(|| (t, (1.0 - u - v) * mesh.values[a] + u * mesh.values[b] + v * mesh.values[c]))
}

/// All that a ray meets, the outermost first.
fn met(mesh: &Mesh, ray: [f64; 3]) -> Vec<(f64, f64)> {
    let triangles = mesh.faces.iter().flat_map(|f| (1..f.len() - 1).map(|i| [f[0], f[i], f[i + 1]]));
    let mut met: Vec<_> = triangles.filter_map(|triangle| meet(mesh, triangle, ray)).collect();
    met.sort_by(|a, b| b.0.total_cmp(&a.0));
    met
}

/// A direction in no special relation to the axes.
fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (s, c) = 0.7f64.sin_cos();
    let (x, y) = (c * x - s * y, s * x + c * y);
    let (y, z) = (c * y - s * z, s * y + c * z);
    [c * x + s * z, y, c * z - s * x]
}

fn centred() -> Regrid {
    Regrid { centre: Some([0.0; 3]), ..Regrid::default() }
}

#[test]
fn every_layout_gives_the_same_map() {
    let mesh = sphere(3);
    let expected = read_with(&mesh.ply(), &Selection::default()).unwrap();
    assert_eq!((expected.grid().nside(), expected.name.as_str()), (4, "value"));
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (real, list) in [
            ("double", ["uchar", "int"]),
            ("float", ["uint8", "uint32"]),
            ("float32", ["int", "ushort"]),
            ("float64", ["char", "int16"]),
            ("double", ["ushort", "double"]),
        ] {
            for (extra, faces_first) in [(false, false), (true, false), (false, true), (true, true)] {
                let layout = Layout { format, real, list, extra, faces_first, ..Layout::default() };
                assert_same(&read_with(&layout.write(&mesh), &Selection::default()).unwrap(), &expected);
                let layout = Layout { end: "\r\n", corners: "vertex_index", ..layout };
                assert_same(&read_with(&layout.write(&mesh), &Selection::default()).unwrap(), &expected);
            }
        }
    }
}

#[test]
fn whole_numbers_as_values() {
    let mesh = sphere(2).with_values(|[x, y, _]| (100.0 * x - 27.0 * y).round());
    let expected = read_with(&mesh.ply(), &Selection::default()).unwrap();
    for kind in ["char", "short", "int", "float"] {
        let text = String::from_utf8(mesh.ply()).unwrap().replace("double value", &format!("{kind} value"));
        assert_same(&read_with(text.as_bytes(), &Selection::default()).unwrap(), &expected);
    }
}

#[test]
fn an_octahedron_has_exact_values() {
    // Where |x| + |y| + |z| = 1, the point on a ray is known, and so is a field that is linear in space. Centres of
    // pixels lie on the edges.
    let field = |[x, y, z]: [f64; 3]| 0.5 + x - 2.0 * y + 3.0 * z;
    let mesh = sphere(0).with_values(field);
    for n in [1, 2, 3, 16, 64] {
        let map = read_with(&mesh.ply(), &nside(n, Regrid::default())).unwrap();
        let exact = |d: [f64; 3]| field(d.map(|c| c / d.iter().map(|c| c.abs()).sum::<f64>()));
        assert!(map.values().iter().all(|v| v.is_finite()));
        assert!(largest_error(&map, exact) < 1e-14);
    }
}

#[test]
fn a_cube_of_squares_has_exact_values() {
    let field = |[x, y, z]: [f64; 3]| 0.5 + x - 2.0 * y + 3.0 * z;
    let vertices = (0..8).map(|i| [1, 2, 4].map(|bit| if i & bit == 0 { -1.0 } else { 1.0 })).collect();
    let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let mesh = Mesh { vertices, values: Vec::new(), faces: faces.map(Vec::from).to_vec() }.with_values(field);
    let map = read_with(&mesh.ply(), &nside(32, Regrid::default())).unwrap();
    let exact = |d: [f64; 3]| field(d.map(|c| c / d.iter().fold(0.0, |m: f64, c| m.max(c.abs()))));
    assert!(largest_error(&map, exact) < 1e-14);
    assert!(map.values().iter().all(|v| v.is_finite()));
}

#[test]
fn every_ray_meets_what_plain_geometry_says() {
    // A bumpy surface, seen from inside.
    let mut next = noise(1);
    let mesh = sphere(3).moved(turned);
    let mesh = Mesh {
        vertices: mesh
            .vertices
            .iter()
            .map(|v| {
                let r = 0.5 + next();
                v.map(|c| r * c)
            })
            .collect(),
        ..mesh
    };
    let map = read_with(&mesh.ply(), &nside(16, centred())).unwrap();
    for (p, found) in map.values().iter().enumerate() {
        let met = met(&mesh, centre(map.grid(), p));
        let (_, expected) = met[0];
        assert!(met.len() == 1 && (found - expected).abs() < 1e-12, "pixel {p}: {found} {met:?}");
    }
}

#[test]
fn errors_fall_with_the_square_of_the_edges() {
    let errors: Vec<f64> = (2..6)
        .map(|levels| {
            let field = |[x, y, z]: [f64; 3]| 0.3 + x - 2.0 * y + 3.0 * x * z + z * z;
            let mesh = sphere(levels).moved(turned).with_values(field);
            largest_error(&read_with(&mesh.ply(), &nside(32, centred())).unwrap(), field)
        })
        .collect();
    for pair in errors.windows(2) {
        assert!((3.0..5.0).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

#[test]
fn the_centre_is_the_mean_of_the_vertices_unless_given() {
    let mesh = sphere(3);
    let expected = read_with(&mesh.ply(), &nside(16, Regrid::default())).unwrap();
    let away = mesh.clone().moved(|[x, y, z]| [50.0 * x + 1000.0, 50.0 * y - 30.0, 50.0 * z + 7.0]);
    for centre in [None, Some([1000.0, -30.0, 7.0])] {
        let map = read_with(&away.ply(), &nside(16, Regrid { centre, ..Regrid::default() })).unwrap();
        for (found, expected) in map.values().iter().zip(expected.values()) {
            assert!((found - expected).abs() < 1e-6);
        }
    }
    // A vertex in no triangle does not count.
    let mut stray = mesh.clone();
    stray.vertices.push([1e6, 0.0, 0.0]);
    stray.values.push(7.0);
    assert_same(&read_with(&stray.ply(), &nside(16, Regrid::default())).unwrap(), &expected);
    // From another point inside the map is another, from outside it is none.
    let other = Regrid { centre: Some([0.4, 0.0, 0.2]), ..Regrid::default() };
    let map = read_with(&mesh.ply(), &nside(16, other)).unwrap();
    let moved = mesh.clone().moved(|[x, y, z]| [x - 0.4, y, z - 0.2]);
    for (p, found) in map.values().iter().enumerate() {
        // The ray may lie on an edge, which the plain way may lose or count twice.
        let met = met(&moved, crate::centre(map.grid(), p));
        assert!(met.first().is_none_or(|(_, expected)| (found - expected).abs() < 1e-10));
    }
    let outside = Regrid { centre: Some([3.0, 0.0, 0.0]), ..Regrid::default() };
    let (error, told) = problem_with(&mesh.ply(), &nside(16, outside));
    let longan_grid::Error::Crossings { never, several } = grid(&error) else { panic!("{told}") };
    assert_eq!(never.pixels + several.pixels, never.of);
    assert!(told.contains("centre") && told.contains("allow folds"), "{told}");
    assert_eq!((error.kind(), error.ask()), (ErrorKind::Grid, Some(&Ask::Folds)));
}

/// Half a sphere.
fn half() -> Mesh {
    let mut mesh = sphere(4);
    let Mesh { vertices, faces, .. } = &mut mesh;
    faces.retain(|face| face.iter().all(|&v| vertices[v][2] >= 0.0));
    mesh.moved(turned)
}

#[test]
fn folds_and_holes() {
    let outer = sphere(4).moved(turned).with_values(|[x, _, _]| x + 5.0);
    let cap = half().moved(|v| v.map(|c| 1.5 * c));
    let folded = outer.clone().and(cap.clone());
    let folds = Regrid { allow_folds: true, ..centred() };
    for (mesh, never, several) in [(&folded, 0.0, 0.5), (&cap, 0.5, 0.0), (&outer, 0.0, 0.0)] {
        let share = |percent: longan_grid::Percent| percent.pixels as f64 / percent.of as f64;
        match longan_formats::read(&scratch(&mesh.ply()).path, &nside(16, centred())) {
            Ok(_) => assert_eq!(never + several, 0.0),
            Err(error) => {
                assert!(error.path().is_some());
                let told = error.problem().to_string();
                let longan_grid::Error::Crossings { never: n, several: s } = *grid(&error) else { panic!("{told}") };
                assert!((share(n) - never).abs() < 0.02 && (share(s) - several).abs() < 0.02, "{told}");
                assert!(told.contains(&n.to_string()) && told.contains(&s.to_string()), "{told}");
            }
        }
        let map = read_with(&mesh.ply(), &nside(16, folds.clone())).unwrap();
        for (p, found) in map.values().iter().enumerate() {
            match met(mesh, centre(map.grid(), p)).first() {
                None => assert!(found.is_nan()),
                Some((_, expected)) => assert!((found - expected).abs() < 1e-12, "pixel {p}: {found} {expected}"),
            }
        }
    }
}

#[test]
fn a_triangle_that_lies_twice_is_a_fold() {
    let mut mesh = sphere(1).moved(turned);
    mesh.faces.push(mesh.faces[5].clone());
    let error = problem_with(&mesh.ply(), &nside(32, centred())).0;
    let longan_grid::Error::Crossings { never, several } = grid(&error) else { panic!("{error}") };
    assert_eq!(never.pixels, 0);
    assert!((several.pixels as f64 / several.of as f64 - 1.0 / 32.0).abs() < 0.02);
}

#[test]
fn vertices_without_values_mask_their_triangles() {
    for missing in [f64::NAN, f64::INFINITY, longan_grid::UNSEEN] {
        let mut mesh = sphere(3).moved(turned);
        for v in [0, 17, 80] {
            mesh.values[v] = missing;
        }
        let layout = Layout { format: "binary_little_endian", ..Layout::default() };
        let map = read_with(&layout.write(&mesh), &nside(32, centred())).unwrap();
        mesh.values.iter_mut().for_each(|v| {
            if *v == missing || missing.is_nan() && v.is_nan() {
                *v = f64::NAN
            }
        });
        assert!(map.values().iter().any(|v| v.is_nan()));
        for (p, found) in map.values().iter().enumerate() {
            let expected = met(&mesh, centre(map.grid(), p))[0].1;
            assert!(
                found.is_nan() && expected.is_nan() || (found - expected).abs() < 1e-12,
                "pixel {p}: {found} {expected}"
            );
        }
    }
}

#[test]
fn the_value_must_be_told_apart() {
    let text = String::from_utf8(Layout { extra: true, ..Layout::default() }.write(&sphere(1))).unwrap();
    let two = text.replace("ushort flags", "ushort quality");
    let (error, told) = problem_with(two.as_bytes(), &Selection::default());
    assert!(
        is(&error, ErrorKind::Ambiguous, "several columns could be the map") && told.contains("0 'quality', 1 'value'"),
        "{told}"
    );
    let expected = read_with(text.as_bytes(), &Selection::default()).unwrap();
    for name in ["value", "VALUE", "1"] {
        assert_same(&read_with(two.as_bytes(), &field(name)).unwrap(), &expected);
    }
    // What is no value unasked can be asked for.
    let map = read_with(text.as_bytes(), &field("red")).unwrap();
    assert!(map.name == "red" && map.values().iter().all(|v| (v - 200.0).abs() < 1e-10));
    let (error, _) = problem_with(text.as_bytes(), &field("rings"));
    assert!(is(&error, ErrorKind::Unknown, "there is no column"));
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let file = scratch(&sphere(4).ply());
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| longan_formats::read(&file.path, &nside(32, Regrid::default()))).unwrap()
    };
    assert_same(&with(5), &with(1));
}

#[test]
fn points_in_a_table_and_vertices_lie_at_the_same_places() {
    let mesh = sphere(4).moved(turned).moved(|[x, y, z]| [2.0 * x + 3.0, 2.0 * y, 2.0 * z - 1.0]);
    let rows: String =
        mesh.vertices.iter().zip(&mesh.values).map(|([x, y, z], v)| format!("{x};{y};{z};{v}\n")).collect();
    let table = "x;y;z;v\n".to_owned() + &rows;
    let from_mesh = read_with(&mesh.ply(), &Selection::default()).unwrap();
    let from_table = read_with(table.as_bytes(), &Selection::default()).unwrap();
    assert_eq!(from_mesh.grid(), from_table.grid());
    // At a pixel around a vertex the two differ by what the field changes from there to the pixel's centre.
    let fine = |bytes: &[u8]| read_with(bytes, &nside(256, gather(Gather::Nearest))).unwrap();
    let (fine_mesh, fine_table) = (fine(&mesh.ply()), fine(table.as_bytes()));
    for (&[x, y, z], value) in mesh.vertices.iter().zip(&mesh.values) {
        let d = [x - 3.0, y, z + 1.0];
        let pixel = fine_table.grid().pixel_at(d[0].hypot(d[1]).atan2(d[2]), d[1].atan2(d[0]));
        assert_eq!(fine_table.values()[pixel], *value);
        assert!((fine_mesh.values()[pixel] - value).abs() < 0.02);
    }
}

#[test]
fn descriptions_say_what_there_is() {
    let whole = sphere(4).moved(turned).moved(|[x, y, z]| [x + 2.0, y, z]);
    let layout = Layout { extra: true, ..Layout::default() };
    let described = |mesh: &Mesh| {
        let description = longan_formats::describe(&scratch(&layout.write(mesh)).path).unwrap();
        assert_eq!(description.tables[0].fields.iter().map(|f| f.name.as_str()).collect::<Vec<_>>(), ["value"]);
        description.tables[0].grid.clone()
    };
    let GridDescription::Surface { vertices, triangles, centre, nside, covered, folded } = described(&whole) else {
        panic!()
    };
    assert_eq!((vertices, triangles, nside, covered, folded), (1026, 2048, 8, 1.0, 0.0));
    assert!((centre[0] - 2.0).abs() < 1e-9 && centre[1].abs() < 1e-9);
    let GridDescription::Surface { covered, folded, .. } = described(&half().and(half())) else { panic!() };
    assert!((covered - folded).abs() < 1e-12, "{covered} {folded}");
    // Half a sphere is seen from its own middle, half way to its top: the rim is 120° from there.
    assert!((0.7..0.8).contains(&covered), "{covered}");
}

#[test]
fn values_are_those_of_the_file() {
    let mesh = sphere(1);
    let mut maps = longan_formats::open(&scratch(&mesh.ply()).path, &Selection::default()).unwrap();
    assert_eq!(maps.values(0).unwrap(), mesh.values);
}
