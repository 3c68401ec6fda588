use std::collections::BTreeMap;

use serde_json::Value;

use super::*;

/// Measures with the quantities, symmetries among them, that their columns state.
const MEASURES: [(&str, &str, Option<u32>); 10] = [
    ("w0", "area", None),
    ("w1", "length", None),
    ("w2", "curvature", None),
    ("psi3", "length", None),
    ("rank4-mid", "length", None),
    ("q2", "ratio", None),
    ("evq-direction", "angle", Some(2)),
    ("psi5-direction", "angle", Some(5)),
    ("masked-fraction", "ratio", None),
    ("slant = degrees(psi2_direction)", "number", None),
];

/// The columns of [`MEASURES`].
fn columns() -> Vec<String> {
    let name = |text: &str| text.split(' ').next().unwrap().to_uppercase().replace('-', "_");
    MEASURES.iter().map(|(text, ..)| name(text)).collect()
}

fn measures() -> String {
    MEASURES.map(|(text, ..)| format!("--measure '{text}'")).join(" ")
}

/// The quantities and symmetries of a file's fields, by name, as `longan info` has them.
fn listed(folder: &Folder, name: &str) -> BTreeMap<String, (Option<String>, Option<u64>)> {
    let info: Value = serde_json::from_str(&folder.done(&format!("info {name} --format json"))).unwrap();
    let mut found = BTreeMap::new();
    fields(&info, &mut |field| {
        let quantity = field["quantity"].as_str().map(str::to_owned);
        found.insert(field["name"].as_str().unwrap().to_owned(), (quantity, field["symmetry"].as_u64()));
    });
    found
}

/// Visits all descriptions of fields, wherever they stand.
fn fields(value: &Value, visit: &mut impl FnMut(&Value)) {
    match value {
        Value::Array(values) => values.iter().for_each(|value| fields(value, visit)),
        Value::Object(entries) => {
            for (key, value) in entries {
                match (key.as_str(), value) {
                    ("fields", Value::Array(described)) => described.iter().for_each(&mut *visit),
                    _ => fields(value, visit),
                }
            }
        }
        _ => (),
    }
}

/// Puts one text in place of another of the same length, wherever the file has it.
fn replaced(folder: &Folder, from: &str, to: &str, texts: &[(&str, &str)]) {
    let mut bytes = std::fs::read(folder.path(from)).unwrap();
    for (old, new) in texts {
        assert_eq!(old.len(), new.len());
        let places: Vec<usize> =
            (0..bytes.len() - old.len()).filter(|&at| bytes[at..].starts_with(old.as_bytes())).collect();
        assert!(!places.is_empty(), "{old}");
        places.iter().for_each(|&at| bytes[at..at + new.len()].copy_from_slice(new.as_bytes()));
    }
    folder.write(to, &bytes);
}

#[test]
fn files_state_the_quantity_of_each_column() {
    let folder = Folder::with_sky();
    let options = format!("{} --window 20 --nside-out 4 -q", measures());
    folder.done(&format!("map sky.fits -o out.fits {options}"));
    folder.done(&format!("map sky.fits -o out.nc {options}"));
    let header = &folder.headers("out.fits")[0];
    let cube = netcdf::open(folder.path("out.nc")).unwrap();
    let [of_fits, of_netcdf] = ["out.fits", "out.nc"].map(|name| listed(&folder, name));
    for (i, ((_, quantity, symmetry), name)) in (1..).zip(MEASURES.iter().zip(columns())) {
        assert_eq!(header[&format!("TTYPE{i}")], name);
        assert_eq!(header[&format!("TQTY{i}")], *quantity, "{name}");
        assert_eq!(header.get(&format!("TSYM{i}")).cloned(), symmetry.map(|s| s.to_string()), "{name}");
        let variable = cube.variable(&name).unwrap();
        let stated = variable.attribute("quantity").unwrap().value().unwrap();
        assert_eq!(String::try_from(stated).unwrap(), *quantity, "{name}");
        let turns = variable.attribute("symmetry").map(|turns| i32::try_from(turns.value().unwrap()).unwrap());
        assert_eq!(turns, symmetry.map(|s| s as i32), "{name}");
        let expected = (Some((*quantity).to_owned()), symmetry.map(u64::from));
        assert_eq!((&of_fits[&name], &of_netcdf[&name]), (&expected, &expected), "{name}");
    }
    drop(cube);
    // The weight tells what a moment is, and each window has its own columns.
    folder.done("map sky.fits -o w2.nc --measure psi3,trace --weight curvature --window 10,20 --nside-out 4 -q");
    let weighted = listed(&folder, "w2.nc");
    assert_eq!(weighted.len(), 4, "{weighted:?}");
    assert!(weighted.values().all(|(quantity, _)| quantity.as_deref() == Some("curvature")), "{weighted:?}");
    assert!(listed(&folder, "sky.fits").values().all(|stated| *stated == (None, None)));
}

#[test]
fn pictures_follow_the_file_and_else_the_name() {
    let folder = Folder::with_sky();
    folder.done("map sky.fits -o maps.fits --measure evq,evq-direction --window 20 --nside-out 4 -q");
    let plot = |name: &str, words: &str| {
        folder.done(&format!("plot {name} -o {name}.svg --width 300 --overwrite {words}"));
        std::fs::read_to_string(folder.path(format!("{name}.svg"))).unwrap()
    };
    let is_of_directions = |svg: &str| ["−90", "90", "degrees"].iter().all(|text| svg.contains(text));
    let expected = plot("maps.fits", "--column evq_direction --rods evq_direction --title t --label degrees");
    assert!(is_of_directions(&expected));
    // By another name.
    replaced(&folder, "maps.fits", "renamed.fits", &[("EVQ_DIRECTION", "WHERE_TO_LOOK")]);
    let renamed = plot("renamed.fits", "--column where_to_look --rods where_to_look --title t --label degrees");
    assert_eq!(renamed, expected);
    // A file that does not state it, as those of older releases.
    let unstated = [("TQTY1 ", "XQTY1 "), ("TQTY2 ", "XQTY2 "), ("TSYM2 ", "XSYM2 ")];
    replaced(&folder, "maps.fits", "older.fits", &unstated);
    let older = plot("older.fits", "--column evq_direction --rods evq_direction --title t --label degrees");
    assert_eq!(older, expected);
    replaced(&folder, "renamed.fits", "unknown.fits", &unstated);
    folder
        .refused("plot unknown.fits -o a.svg --rods where_to_look", &["'WHERE_TO_LOOK' is not a column of directions"]);

    // What a variable states goes before its name, too.
    folder.done("map sky.fits -o maps.nc --measure evq,evq-direction --window 20 --nside-out 4 -q");
    plot("maps.nc", "--column evq --rods evq_direction");
    folder.refused("plot maps.nc -o a.svg --column evq --rods evq", &["'EVQ' is not a column of directions"]);
    {
        let mut cube = netcdf::append(folder.path("maps.nc")).unwrap();
        let mut state = |variable: &str, quantity: &str| {
            cube.variable_mut(variable).unwrap().put_attribute("quantity", quantity).unwrap();
        };
        state("EVQ", "angle");
        state("EVQ_DIRECTION", "ratio");
        cube.variable_mut("EVQ").unwrap().put_attribute("symmetry", 4).unwrap();
    }
    unlock(&folder.path("maps.nc"));
    assert!(plot("maps.nc", "--column evq --rods evq").contains("45"));
    folder.refused(
        "plot maps.nc -o a.svg --column evq --rods evq_direction",
        &["'EVQ_DIRECTION' is not a column of directions"],
    );
}

#[test]
fn comparisons_follow_the_file_and_else_the_name() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("raw")).unwrap();
    for i in 0..3 {
        folder.done(&format!("simulate waves -o raw/{i}.fits --nside 16 --correlation 15 --seed {i}"));
    }
    let raw = "raw/0.fits raw/1.fits raw/2.fits";
    folder.done(&format!(
        "map {raw} -o maps --measure 'psi2,evq-direction,my-direction = psi2/w1' --window 20 --nside-out 4 -q"
    ));
    let of = |folder: &str| [0, 1, 2].map(|i| format!("{folder}/{i}.fits")).join(" ");
    // An angle is none by its name alone.
    let ran = folder.run(&format!("compare {} -o out.fits", of("maps")));
    assert!(ran.code == Some(0) && ran.err.matches("left out is").count() == 1, "{ran:?}");
    assert!(ran.err.contains("left out is EVQ_DIRECTION: it is an angle"), "{ran:?}");
    let header = &folder.headers("out.fits")[0];
    let stated = |name: &str| {
        let number = header.iter().find(|(key, value)| key.starts_with("TTYPE") && *value == name).unwrap().0;
        header[&number.replace("TTYPE", "TQTY")].clone()
    };
    for (column, quantity) in [
        ("PSI2_MEAN", "length"),
        ("PSI2_STD", "length"),
        ("PSI2_SIGMA", "deviation"),
        ("PSI2_LOCAL_PERCENTILE", "percentile"),
        ("PSI2_GLOBAL_PERCENTILE", "percentile"),
        ("PSI2_COUNT", "count"),
        ("MY_DIRECTION_MEAN", "number"),
    ] {
        assert_eq!(stated(column), quantity, "{column}");
    }
    // An angle by another name, and one of a file that states nothing.
    std::fs::create_dir(folder.path("renamed")).unwrap();
    std::fs::create_dir(folder.path("older")).unwrap();
    for i in 0..3 {
        let [maps, renamed, older] = ["maps", "renamed", "older"].map(|name| format!("{name}/{i}.fits"));
        replaced(&folder, &maps, &renamed, &[("EVQ_DIRECTION", "WHERE_TO_LOOK")]);
        replaced(&folder, &maps, &older, &[("TQTY", "XQTY"), ("TSYM", "XSYM")]);
    }
    folder.refused(
        &format!("compare {} -o a.fits --measure where_to_look", of("renamed")),
        &["WHERE_TO_LOOK is an angle"],
    );
    folder
        .refused(&format!("compare {} -o a.fits --measure evq_direction", of("older")), &["EVQ_DIRECTION is an angle"]);
    folder.done(&format!("compare {} -o older.fits --measure psi2", of("older")));
    assert_eq!(folder.headers("older.fits")[0]["TQTY1"], "length");
    // Graphs know the measure itself.
    folder.misused("graph raw/0.fits -o a.csv --measure psi4-direction", &["means nothing"]);
    folder.done("graph raw/0.fits -o a.csv --measure 'my-direction = psi2/w1' --window 20 --nside-out 2");
}

#[test]
fn measures_are_listed_with_their_quantity() {
    let folder = Folder::new();
    let text = folder.done("measures");
    let line = |name: &str| text.lines().find(|line| line.starts_with(&format!("{name} "))).unwrap().to_owned();
    for (name, quantity) in [
        ("w0", "area"),
        ("psiN", "moment"),
        ("evq-direction", "angle/2"),
        ("psiN-direction", "angle/N"),
        ("qN", "ratio"),
    ] {
        assert_eq!(line(name).split_whitespace().nth(2), Some(quantity), "{name}");
    }
    let listed: Vec<Value> = serde_json::from_str(&folder.done("measures --format json")).unwrap();
    let row = |name: &str| listed.iter().find(|row| row["name"] == name).unwrap();
    assert_eq!((&row("w2")["quantity"], row("w2").get("symmetry")), (&Value::from("curvature"), None));
    assert_eq!(
        (&row("psiN-direction")["quantity"], &row("psiN-direction")["symmetry"]),
        (&"angle".into(), &"N".into())
    );
}
