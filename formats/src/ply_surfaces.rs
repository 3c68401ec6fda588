//! Surfaces in PLY files, text or binary: the adapter that reads them.
//!
//! Nothing is believed of the header but what the file's size bears out. The way from a surface to a map is left to
//! [`longan_grid::Surface`].

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use crate::adapter::{About, Adapter, MapSeries, MemoryEstimate, Target, field_place};
use crate::columns::{self, Column};
use crate::describe::{Description, GridDescription};
use crate::error::{self, Error, ErrorKind, Reason};
use crate::request::Selection;
use crate::text::shortened;
use longan_grid::directions::FARTHEST;
use longan_grid::{Map, Regrid, Sphere, Time, UNSEEN, is_bad};
use longan_grid::{Surface, SurfaceSummary};

/// No line of a header is longer than this, and no number in a text.
const LONGEST: u64 = 1 << 16;

/// Properties of vertices that are no values: positions, normals, colours, places in pictures, marks.
const NO_VALUES: [&str; 27] = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "red",
    "green",
    "blue",
    "alpha",
    "r",
    "g",
    "b",
    "a",
    "diffuse_red",
    "diffuse_green",
    "diffuse_blue",
    "diffuse_alpha",
    "s",
    "t",
    "u",
    "v",
    "texture_u",
    "texture_v",
    "texture_s",
    "texture_t",
    "flags",
];

/// A PLY file that holds no surface with values.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error("line {line} of the header is '{text}', which is not {expected}; correct it")]
    Header { line: usize, text: String, expected: &'static str },
    #[error("this PLY file has no {missing}; save it as a surface of triangles with a value at each vertex")]
    Lacks { missing: &'static str },
    #[error(
        "the file ends after {found} of {count} entries of '{element}'; it is cut short or its header is wrong, so fetch it again"
    )]
    Truncated { element: String, found: u64, count: u64 },
    #[error(
        "face {face} (from 0) has vertex {vertex}, but the file has {vertices} vertices, numbered from 0; correct the faces"
    )]
    FaceVertex { face: u64, vertex: f64, vertices: u64 },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::Header { .. } => ErrorKind::Corrupt,
            Problem::Lacks { .. } => ErrorKind::NoMap,
            Problem::Truncated { .. } => ErrorKind::Truncated,
            Problem::FaceVertex { .. } => ErrorKind::Invalid,
        }
    }
}

/// The adapter for surfaces in PLY files.
pub(crate) struct SurfacePly;

impl Adapter for SurfacePly {
    fn name(&self) -> &'static str {
        "surface of triangles (PLY)"
    }

    fn recognises(&self, head: &[u8]) -> bool {
        let first = head.split(|&b| b == b'\n').next().unwrap_or_default();
        first.trim_ascii_end() == b"ply" && first.len() < head.len()
    }

    fn describe(&self, path: &Path) -> Result<Description, Error> {
        let mut input = BufReader::new(File::open(path).map_err(Error::io("open it"))?);
        let header = Header::parse(&mut input)?;
        let columns = header.columns()?;
        // A surface is the same whatever values it has.
        let surface = header.surface(input, "x")?;
        let SurfaceSummary { centre, nside, covered, folded } = surface.summary()?;
        let (vertices, triangles) = (surface.vertices.len(), surface.triangles.len());
        let grid = GridDescription::Surface { vertices, triangles, centre, nside, covered, folded };
        Ok(columns::describe(self.name(), grid, &columns))
    }

    fn open(&self, path: &Path, selection: &Selection) -> Result<Box<dyn MapSeries>, Error> {
        columns::check(selection)?;
        let mut input = BufReader::new(File::open(path).map_err(Error::io("open it"))?);
        let header = Header::parse(&mut input)?;
        let mut columns = header.columns()?;
        let column = columns.swap_remove(columns::choose(&columns, selection.field.as_ref())?);
        let surface = header.surface(input, &column.name)?;
        Ok(Box::new(SingleMap { surface, name: column.name, nside: selection.nside, regrid: selection.regrid.clone() }))
    }
}

/// The one map of a surface.
struct SingleMap {
    surface: Surface,
    name: String,
    nside: Option<usize>,
    regrid: Regrid,
}

impl MapSeries for SingleMap {
    fn times(&self) -> &[Time] {
        &[]
    }

    fn about(&self) -> About {
        About { name: self.name.clone(), unit: None, coordinates: None, sphere: Sphere::Body, quantity: None }
    }

    fn place(&self) -> Vec<String> {
        vec![field_place(&self.name)]
    }

    fn target(&mut self) -> Result<Target, Error> {
        let (grid, [x, y, z]) = self.surface.grid_and_centre(self.nside, &self.regrid)?;
        let mut settings = vec![format!("centre={x},{y},{z}")];
        settings.extend(self.regrid.allow_folds.then(|| "allow-folds".to_owned()));
        Ok(Target::regridded(grid, settings))
    }

    fn memory(&self) -> Option<MemoryEstimate> {
        // Position and value of a vertex, its two triangles, and all as seen from the centre, with boxes about triangles.
        MemoryEstimate::of_points(self.nside, self.surface.vertices.len(), 512)
    }

    fn read(&mut self, _: usize) -> Result<Map, Error> {
        let mut map = self.surface.regrid(self.nside, &self.regrid)?;
        self.about().label(&mut map);
        Ok(map)
    }

    fn values(&mut self, _: usize) -> Result<Vec<f64>, Error> {
        Ok(self.surface.values.clone())
    }
}

/// The promises of a header.
struct Header {
    format: Format,
    elements: Vec<Element>,
    /// Number of the header's lines.
    lines: usize,
}

/// The way in which numbers are written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Text,
    LittleEndian,
    BigEndian,
}

/// Things of one kind, such as vertices.
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

/// A property that each thing of a kind has.
struct Property {
    name: String,
    kind: Kind,
    /// Of a list, how its length is written.
    list: Option<Kind>,
}

/// The storage of a number in a binary file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Kind::I8,
            "uchar" | "uint8" => Kind::U8,
            "short" | "int16" => Kind::I16,
            "ushort" | "uint16" => Kind::U16,
            "int" | "int32" => Kind::I32,
            "uint" | "uint32" => Kind::U32,
            "float" | "float32" => Kind::F32,
            "double" | "float64" => Kind::F64,
            _ => return None,
        })
    }

    /// Bytes of a number.
    fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::F64 => 8,
        }
    }

    /// A number from its bytes, the lowest first; more than there are do not matter.
    fn value(self, [a, b, c, d, e, f, g, h]: [u8; 8]) -> f64 {
        match self {
            Kind::I8 => f64::from(a as i8),
            Kind::U8 => f64::from(a),
            Kind::I16 => f64::from(i16::from_le_bytes([a, b])),
            Kind::U16 => f64::from(u16::from_le_bytes([a, b])),
            Kind::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Kind::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Kind::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Kind::F64 => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        }
    }
}

impl Header {
    /// Reads a header, after which the body begins.
    fn parse(input: &mut impl BufRead) -> Result<Self, Error> {
        let (mut format, mut elements, mut lines) = (None, Vec::<Element>::new(), 0);
        loop {
            let mut line = Vec::new();
            input.take(LONGEST).read_until(b'\n', &mut line).map_err(Error::io("read it"))?;
            if line.pop() != Some(b'\n') {
                let action = "find the end of the header".to_owned();
                return Err(error::Problem::CutShort { action }.into());
            }
            lines += 1;
            let text = String::from_utf8_lossy(&line);
            let wrong = |expected| Problem::Header { line: lines, text: shortened(text.trim()), expected };
            match text.split_whitespace().collect::<Vec<_>>()[..] {
                [] | ["comment" | "obj_info", ..] => {}
                ["ply"] if lines == 1 => {}
                ["format", name, _] => {
                    format = Some(match name {
                        "ascii" => Format::Text,
                        "binary_little_endian" => Format::LittleEndian,
                        "binary_big_endian" => Format::BigEndian,
                        _ => {
                            let expected = "'ascii', 'binary_little_endian' or 'binary_big_endian' with a version";
                            return Err(wrong(expected).into());
                        }
                    });
                }
                ["element", name, count] => {
                    if elements.iter().any(|e| e.name == name) {
                        return Err(wrong("an element that the file has not yet").into());
                    }
                    let count = count.parse().map_err(|_| wrong("'element', a name and a number of entries"))?;
                    elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                ["property", ref kinds @ .., name] => {
                    let kinds = match kinds {
                        [kind] => Kind::parse(kind).map(|kind| (kind, None)),
                        ["list", count, kind] => Kind::parse(count).zip(Kind::parse(kind)).map(|(c, k)| (k, Some(c))),
                        _ => None,
                    };
                    let (kind, list) = kinds.ok_or_else(|| wrong("'property', a type such as 'float' and a name"))?;
                    let element = elements.last_mut().ok_or_else(|| wrong("after an element"))?;
                    if element.properties.iter().any(|p| p.name == name) {
                        return Err(wrong("a property that its element has not yet").into());
                    }
                    element.properties.push(Property { name: name.to_owned(), kind, list });
                }
                ["end_header"] => break,
                _ => return Err(wrong("a line of a PLY header").into()),
            }
        }
        let format = format.ok_or(Problem::Lacks { missing: "line that says its format" })?;
        Ok(Header { format, elements, lines })
    }

    /// The element of this name.
    fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|e| e.name == name)
    }

    /// The properties of vertices that are one number each, once it is clear that there is a surface.
    fn columns(&self) -> Result<Vec<Column>, Problem> {
        let vertex = self.element("vertex").ok_or(Problem::Lacks { missing: "vertices" })?;
        let column = |p: &Property| Column {
            heading: p.name.clone(),
            name: p.name.clone(),
            unit: None,
            values: !NO_VALUES.contains(&p.name.to_lowercase().as_str()),
        };
        let columns: Vec<Column> = vertex.properties.iter().filter(|p| p.list.is_none()).map(column).collect();
        if !["x", "y", "z"].iter().all(|name| columns.iter().any(|c| c.name == *name)) {
            return Err(Problem::Lacks { missing: "positions x, y and z of its vertices" });
        }
        let face = self.element("face").filter(|face| face.properties.iter().any(Property::is_corners));
        face.ok_or(Problem::Lacks { missing: "faces" })?;
        Ok(columns)
    }

    /// Reads the body of a surface with the values of one property of vertices.
    fn surface(&self, input: impl BufRead, values: &str) -> Result<Surface, Error> {
        let mut body = Body { input, format: self.format, line: self.lines + 1 };
        let mut surface = Surface::default();
        let vertices = self.element("vertex").map_or(0, |vertex| vertex.count);
        // What has no properties takes no room, so that there may be any number of it.
        for element in self.elements.iter().filter(|e| !e.properties.is_empty()) {
            for entry in 0..element.count {
                let read = match element.name.as_str() {
                    "vertex" => body.vertex(element, entry, values, &mut surface)?,
                    "face" => body.face(element, entry, vertices, &mut surface.triangles)?,
                    _ => body.skip(element, entry)?,
                };
                if read.is_none() {
                    let (element, count) = (shortened(&element.name), element.count);
                    return Err(Problem::Truncated { element, found: entry, count }.into());
                }
            }
        }
        if surface.triangles.is_empty() {
            return Err(Problem::Lacks { missing: "faces" }.into());
        }
        if surface.values.iter().all(|value| value.is_nan()) {
            return Err(columns::Problem::NoValues { column: shortened(values) }.into());
        }
        Ok(surface)
    }
}

impl Property {
    /// Whether it lists the corners of faces.
    fn is_corners(&self) -> bool {
        self.list.is_some() && matches!(self.name.as_str(), "vertex_indices" | "vertex_index")
    }
}

/// The numbers that follow a header. Each reading of them gives `None` where the file ends.
struct Body<R> {
    input: R,
    format: Format,
    /// The line of a text, from 1.
    line: usize,
}

impl<R: BufRead> Body<R> {
    /// Reads a vertex.
    fn vertex(&mut self, element: &Element, entry: u64, values: &str, to: &mut Surface) -> Result<Option<()>, Error> {
        let (mut position, mut value) = ([f64::NAN; 3], f64::NAN);
        for property in &element.properties {
            if property.list.is_some() {
                let Some(()) = self.list(property, entry, |_| Ok(()))? else { return Ok(None) };
                continue;
            }
            let Some(number) = self.number(property.kind, &property.name)? else { return Ok(None) };
            if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == property.name) {
                if number.is_nan() || number.abs() > FARTHEST {
                    return Err(columns::Problem::BadNumber {
                        place: format!("vertex {entry} (from 0)"),
                        column: property.name.clone(),
                        text: number.to_string(),
                        expected: "a number from -1e100 to 1e100",
                    }
                    .into());
                }
                position[axis] = number;
            }
            if property.name == values {
                value = number;
            }
        }
        to.vertices.push(position);
        to.values.push(if is_bad(value, UNSEEN) { f64::NAN } else { value });
        Ok(Some(()))
    }

    /// Reads a face and cuts it into triangles that share its first corner.
    fn face(
        &mut self,
        element: &Element,
        entry: u64,
        vertices: u64,
        to: &mut Vec<[usize; 3]>,
    ) -> Result<Option<()>, Error> {
        for property in &element.properties {
            let (mut first, mut last) = (None, None);
            let read = match property.list {
                None => self.number(property.kind, &property.name)?.map(drop),
                Some(_) if !property.is_corners() => self.list(property, entry, |_| Ok(()))?,
                Some(_) => self.list(property, entry, |number| {
                    if !(number >= 0.0 && number < vertices as f64 && number.fract() == 0.0) {
                        return Err(Problem::FaceVertex { face: entry, vertex: number, vertices }.into());
                    }
                    let corner = number as usize;
                    if let (Some(first), Some(last)) = (first, last) {
                        to.push([first, last, corner]);
                    }
                    if first.is_none() {
                        first = Some(corner);
                    } else {
                        last = Some(corner);
                    }
                    Ok(())
                })?,
            };
            if read.is_none() {
                return Ok(None);
            }
        }
        Ok(Some(()))
    }

    /// Reads over an entry.
    fn skip(&mut self, element: &Element, entry: u64) -> Result<Option<()>, Error> {
        for property in &element.properties {
            let read = match property.list {
                None => self.number(property.kind, &property.name)?.map(drop),
                Some(_) => self.list(property, entry, |_| Ok(()))?,
            };
            if read.is_none() {
                return Ok(None);
            }
        }
        Ok(Some(()))
    }

    /// Reads a list.
    fn list(
        &mut self,
        property: &Property,
        entry: u64,
        mut each: impl FnMut(f64) -> Result<(), Error>,
    ) -> Result<Option<()>, Error> {
        let Some(length) = self.number(property.list.unwrap_or(property.kind), &property.name)? else {
            return Ok(None);
        };
        if !(length >= 0.0 && length.fract() == 0.0) {
            return Err(columns::Problem::BadNumber {
                place: format!("entry {entry} (from 0)"),
                column: shortened(&property.name),
                text: length.to_string(),
                expected: "the length of a list",
            }
            .into());
        }
        for _ in 0..length as u64 {
            let Some(number) = self.number(property.kind, &property.name)? else { return Ok(None) };
            each(number)?;
        }
        Ok(Some(()))
    }

    /// Reads a number.
    fn number(&mut self, kind: Kind, name: &str) -> Result<Option<f64>, Error> {
        if self.format == Format::Text {
            let word = self.word()?;
            let number = word.as_deref().map(|word| std::str::from_utf8(word).ok().and_then(|word| word.parse().ok()));
            return match number {
                Some(None) => Err(columns::Problem::BadNumber {
                    place: format!("line {}", self.line),
                    column: shortened(name),
                    text: shortened(&String::from_utf8_lossy(&word.unwrap_or_default())),
                    expected: "a number",
                }
                .into()),
                number => Ok(number.flatten()),
            };
        }
        let mut bytes = [0; 8];
        let stored = &mut bytes[..kind.size()];
        match self.input.read_exact(stored) {
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
            read => read.map_err(Error::io("read it"))?,
        }
        if self.format == Format::BigEndian {
            stored.reverse();
        }
        Ok(Some(kind.value(bytes)))
    }

    /// Reads a word of a text.
    fn word(&mut self) -> Result<Option<Vec<u8>>, Error> {
        let mut word = Vec::new();
        loop {
            let byte = self.input.fill_buf().map_err(Error::io("read it"))?.first().copied();
            match byte {
                Some(b) if !b.is_ascii_whitespace() && word.len() < LONGEST as usize => word.push(b),
                // The space after a word is left, so that the line is still the word's.
                _ if !word.is_empty() => return Ok(Some(word)),
                None => return Ok(None),
                Some(b) => self.line += usize::from(b == b'\n'),
            }
            self.input.consume(1);
        }
    }
}
