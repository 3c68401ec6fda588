//! What can be wrong with a map or a file of one, each said in one sentence with its remedy.

use std::io;
use std::path::{Path, PathBuf};

/// What can be wrong with a map or a file of one.
///
/// HDUs are counted from 0, the primary one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A problem with the grid, or with settings of regridding.
    #[error(transparent)]
    Grid(#[from] longan_grid::Error),
    /// A problem with a particular file. The problem is part of the message and therefore not a `source`.
    #[error("{}: {problem}", shown(path))]
    File {
        /// The file, as it was named.
        path: PathBuf,
        /// What is wrong with it.
        problem: Box<Error>,
    },
    /// The operating system refused.
    #[error("cannot {action}: {cause}")]
    Io {
        /// What was attempted, such as "open it".
        action: &'static str,
        /// The operating system's reason.
        cause: io::Error,
    },
    /// There is no such file.
    #[error("there is no such file; check the name and the folder")]
    Missing,
    /// A folder was named where a file is needed.
    #[error("this is a folder, but neither a file nor a Zarr store; name a file in it")]
    Folder,
    /// A pipe, device or socket was named where a file is needed.
    #[error("this is not a regular file but a pipe or a device; save the data to a file first")]
    NotRegular,
    /// A name that the FITS library cannot take.
    #[error(
        "the path has {bytes} bytes but the FITS library takes at most {limit}; use a shorter one, such as a relative path"
    )]
    PathTooLong {
        /// Length of the path.
        bytes: usize,
        /// The longest path that can be used.
        limit: usize,
    },

    /// Not a file that any adapter reads.
    #[error(
        "this is {found}, but longan reads HEALPix maps in FITS files, plain or gzip-compressed, fields in NetCDF files and Zarr stores, points in CSV files with columns such as lon, lat, and surfaces in PLY files; convert it first"
    )]
    NotRecognised {
        /// What the content looks like.
        found: &'static str,
    },
    /// The FITS library refused.
    #[error("cannot {action}: the FITS library says \"{message}\" (status {status}); check the file with fitsverify")]
    Cfitsio {
        /// What was attempted.
        action: String,
        /// cfitsio's status.
        status: i32,
        /// cfitsio's words for it.
        message: String,
    },
    /// The FITS library could not write.
    #[error(
        "cannot {action}: the FITS library says \"{message}\" (status {status}); check the space and the permissions there"
    )]
    CfitsioWrite {
        /// What was attempted.
        action: String,
        /// cfitsio's status.
        status: i32,
        /// cfitsio's words for it.
        message: String,
    },
    /// A file that ends within a header.
    #[error("cannot {action}: the file ends before it; fetch it again")]
    CutShort {
        /// What was attempted.
        action: String,
    },
    /// A damaged gzip stream.
    #[error("the gzip stream is damaged or cut short ({cause}); fetch the file again")]
    Gzip {
        /// The decompressor's reason.
        cause: io::Error,
    },
    /// Less data than the header promises.
    #[error(
        "HDU {hdu} promises {needed} bytes but the file ends after {found}; it is cut short or its header is wrong, so fetch it again"
    )]
    Truncated {
        /// The HDU.
        hdu: usize,
        /// The size that the header implies, in bytes from the beginning of the file.
        needed: u128,
        /// The file's size in bytes.
        found: u64,
    },

    /// A FITS file without a HEALPix table.
    #[error("there is no HEALPix table in this FITS file ({found}); choose a file that has one")]
    NoHealpix {
        /// What each HDU is.
        found: String,
    },
    /// An HDU that is not there.
    #[error("there is no HDU {hdu}; the tables are {tables}")]
    NoSuchHdu {
        /// The HDU asked for.
        hdu: usize,
        /// The tables in the file.
        tables: String,
    },
    /// An HDU that is not a binary table.
    #[error("HDU {hdu} is {found}, not a binary table; the tables are {tables}")]
    NotATable {
        /// The HDU asked for.
        hdu: usize,
        /// What it is.
        found: String,
        /// The tables in the file.
        tables: String,
    },
    /// A keyword with an impossible value.
    #[error("HDU {hdu} has {key} = {value}, which is not {expected}; correct the header")]
    Keyword {
        /// The HDU.
        hdu: usize,
        /// The keyword.
        key: String,
        /// Its value as the file has it.
        value: String,
        /// What would do.
        expected: &'static str,
    },
    /// Nside and the amount of data contradict each other.
    #[error(
        "HDU {hdu} has Nside {nside}, so {expected} pixels, but column '{column}' holds {found} values; correct NSIDE, FIRSTPIX and LASTPIX"
    )]
    NsideClash {
        /// The HDU.
        hdu: usize,
        /// Its Nside.
        nside: usize,
        /// The number of pixels of that Nside.
        expected: usize,
        /// The column.
        column: String,
        /// The number of values in the column.
        found: usize,
    },
    /// No Nside, and none to be had from the amount of data.
    #[error("HDU {hdu} has no NSIDE, and its {pixels} values are not 12 Nside² for any Nside; add NSIDE to the header")]
    NsideUnknown {
        /// The HDU.
        hdu: usize,
        /// The number of values.
        pixels: usize,
    },
    /// Indexed pixels of an unknown grid.
    #[error(
        "HDU {hdu} numbers its pixels in column '{column}' but has no NSIDE to say of which grid; add NSIDE to the header"
    )]
    NsideOfIndices {
        /// The HDU.
        hdu: usize,
        /// The column of pixel numbers.
        column: String,
    },
    /// Explicit indexing without an index column.
    #[error(
        "HDU {hdu} has INDXSCHM = EXPLICIT but no column of integers that could be pixel numbers; correct the header"
    )]
    NoIndexColumn {
        /// The HDU.
        hdu: usize,
    },
    /// A table without rows or without columns to read.
    #[error("HDU {hdu} holds no data: {rows} rows and {columns} data columns; choose another HDU")]
    Empty {
        /// The HDU.
        hdu: usize,
        /// Rows of the table.
        rows: usize,
        /// Columns other than the index column.
        columns: usize,
    },
    /// A field that is not there.
    #[error("HDU {hdu} has no field {field}; its fields are {fields}")]
    UnknownField {
        /// The HDU.
        hdu: usize,
        /// The name or number asked for.
        field: String,
        /// The fields of the table.
        fields: String,
    },
    /// A name that several fields have.
    #[error("'{field}' could be any of the fields {fields} of HDU {hdu}; choose one by its number")]
    SeveralFields {
        /// The HDU.
        hdu: usize,
        /// The name asked for.
        field: String,
        /// The fields that have it.
        fields: String,
    },
    /// A column that does not hold real numbers.
    #[error("column '{column}' of HDU {hdu} is {found}, which is not a map of numbers; choose another field")]
    ColumnKind {
        /// The HDU.
        hdu: usize,
        /// The column.
        column: String,
        /// What it holds.
        found: &'static str,
    },
    /// Rows in which pixel numbers and values do not go together.
    #[error(
        "a row of HDU {hdu} has {values} values in column '{column}' for {indices} pixel numbers (GRAIN {grain}); correct TFORM or GRAIN"
    )]
    Run {
        /// The HDU.
        hdu: usize,
        /// The column of values.
        column: String,
        /// Values per row.
        values: usize,
        /// Pixel numbers per row.
        indices: usize,
        /// The keyword GRAIN.
        grain: usize,
    },
    /// A pixel number outside of the grid.
    #[error(
        "HDU {hdu} gives a value to pixel {pixel}, but Nside {nside} has pixels 0 to {last}; correct NSIDE or the pixel numbers"
    )]
    PixelRange {
        /// The HDU.
        hdu: usize,
        /// The pixel number.
        pixel: i128,
        /// Nside of the grid.
        nside: usize,
        /// The last pixel of the grid.
        last: usize,
    },
    /// A pixel that occurs twice.
    #[error("HDU {hdu} gives pixel {pixel} more than one value; remove the duplicates")]
    Duplicate {
        /// The HDU.
        hdu: usize,
        /// The pixel number, in the file's ordering.
        pixel: usize,
    },
    /// A number that no multi-order cell has.
    #[error(
        "HDU {hdu} has UNIQ = {uniq} in row {row} (from 1), which is not 4^(order+1) + pixel for any order up to 29; correct the table"
    )]
    Uniq {
        /// The HDU.
        hdu: usize,
        /// The number.
        uniq: i128,
        /// The row, from 1.
        row: usize,
    },
    /// Two multi-order cells that share an area.
    #[error("the cells UNIQ = {first} and {second} of HDU {hdu} overlap; remove one of them")]
    Overlap {
        /// The HDU.
        hdu: usize,
        /// One cell.
        first: u64,
        /// The other.
        second: u64,
    },
    /// A multi-order map too fine to be expanded unasked.
    #[error(
        "the multi-order map of HDU {hdu} reaches Nside {finest}, beyond {limit}; choose the resolution to bring it to with --nside"
    )]
    TooFine {
        /// The HDU.
        hdu: usize,
        /// Nside of the finest cells.
        finest: usize,
        /// The finest Nside that is used without being asked for.
        limit: usize,
    },
    /// A resolution asked of a map that has but one.
    #[error(
        "HDU {hdu} is not a multi-order map, so it cannot be read at Nside {nside}; leave --nside out, or degrade the map first (for example with healpy.ud_grade)"
    )]
    NotMultiOrder {
        /// The HDU.
        hdu: usize,
        /// The Nside asked for.
        nside: usize,
    },
    /// A resolution that a multi-order map cannot be brought to.
    #[error("a multi-order map can be brought to an Nside that is a power of two, from 1 to 2^29, not to {nside}")]
    Resolution {
        /// The Nside asked for.
        nside: usize,
    },
    /// The NetCDF library refused.
    #[error("cannot {action}: the NetCDF library says \"{message}\"; check the file with ncdump -h")]
    Netcdf {
        /// What was attempted.
        action: String,
        /// libnetcdf's words for what is wrong.
        message: String,
    },
    /// The NetCDF library could not write.
    #[error("cannot {action}: the NetCDF library says \"{message}\"; check the space and the permissions there")]
    NetcdfWrite {
        /// What was attempted.
        action: String,
        /// libnetcdf's words for what is wrong.
        message: String,
    },
    /// A grid that CF has no refinement level for.
    #[error(
        "Nside {nside} is not a power of two, which HEALPix in NetCDF needs (its refinement level is log2 Nside); write FITS"
    )]
    RefinementLevel {
        /// The Nside.
        nside: usize,
    },
    /// Steps that a NetCDF file has no room for.
    #[error(
        "step {step} does not go with the file's columns and axis of time; give each step all columns and its time, or a file without such an axis one step"
    )]
    StepTime {
        /// The step, from 1.
        step: usize,
    },
    /// A NetCDF 3 header that makes no sense.
    #[error("the NetCDF header is damaged or cut short; fetch the file again")]
    NetcdfHeader,
    /// A NetCDF file with less data than its header promises.
    #[error("the header promises {needed} bytes but the file ends after {found}; it is cut short, so fetch it again")]
    NetcdfTruncated {
        /// The size that the header implies, in bytes.
        needed: u128,
        /// The file's size in bytes.
        found: u64,
    },
    /// A variable too large for the memory.
    #[error("'{variable}' needs {gibibytes:.1} GiB, more memory than there is; choose a part of it with --select")]
    VariableMemory {
        /// The variable, or the attribute.
        variable: String,
        /// The memory needed.
        gibibytes: f64,
    },
    /// A variable that holds no numbers.
    #[error("variable '{variable}' holds {found}, which is not a field of numbers; choose another variable")]
    VariableKind {
        /// The variable.
        variable: String,
        /// What it holds.
        found: &'static str,
    },
    /// An attribute with an impossible value.
    #[error(
        "variable '{variable}' has {attribute} = {found}, which is not {expected}; correct it, such as with ncatted"
    )]
    AttributeValue {
        /// The variable.
        variable: String,
        /// The attribute.
        attribute: &'static str,
        /// Its value.
        found: String,
        /// What would do.
        expected: &'static str,
    },
    /// No variable that could be a map.
    #[error(
        "no variable is on a HEALPix grid, or has dimensions of latitude and longitude in degrees; the variables are {variables}"
    )]
    NoLatLon {
        /// The variables and their dimensions.
        variables: String,
    },
    /// Several variables that could be meant.
    #[error("there are several variables, so name one with --variable: {variables}")]
    SeveralVariables {
        /// The variables, their dimensions and units.
        variables: String,
    },
    /// A variable that is not there, or is no map.
    #[error("there is no variable {variable} with latitude and longitude; those that have them are {variables}")]
    UnknownVariable {
        /// The name or number asked for.
        variable: String,
        /// The variables that have them.
        variables: String,
    },
    /// A variable that is not there, among those on a HEALPix grid.
    #[error("there is no variable {variable}; those on a HEALPix grid are {variables}")]
    UnknownHealpix {
        /// The name or number asked for.
        variable: String,
        /// The variables on a HEALPix grid.
        variables: String,
    },
    /// A dimension without places.
    #[error(
        "dimension '{dimension}' of variable '{variable}' has length 0, so there is nothing to read; check how the file was made"
    )]
    EmptyDimension {
        /// The variable.
        variable: String,
        /// The dimension.
        dimension: String,
    },
    /// Coordinates over two dimensions.
    #[error(
        "variable '{variable}' is on a curvilinear grid, whose coordinate '{coordinate}' has two dimensions, but only rectilinear ones are read; regrid it first, such as with cdo remapbil,global_1"
    )]
    Curvilinear {
        /// The variable.
        variable: String,
        /// The coordinate.
        coordinate: String,
    },
    /// A latitude and a longitude for each place of one dimension.
    #[error(
        "variable '{variable}' is on an unstructured grid, whose latitudes and longitudes both run along '{dimension}', but only rectilinear ones are read; regrid it first, such as with cdo remapnn,global_1"
    )]
    Unstructured {
        /// The variable.
        variable: String,
        /// The dimension.
        dimension: String,
    },
    /// Coordinates of a rotated or projected grid.
    #[error(
        "coordinate '{coordinate}' is a {found}, not a latitude or longitude; regrid the field first, such as with cdo remapbil,global_1"
    )]
    OtherAxis {
        /// The coordinate.
        coordinate: String,
        /// Its standard name.
        found: String,
    },
    /// Coordinates in radians.
    #[error(
        "coordinate '{coordinate}' is in '{units}', but degrees are needed; multiply it by 180/pi and set its units to degrees, such as with ncap2"
    )]
    CoordinateRadians {
        /// The coordinate.
        coordinate: String,
        /// Its unit.
        units: String,
    },
    /// Coordinates in metres or other units.
    #[error(
        "coordinate '{coordinate}' is in '{units}', not degrees; bring the field to a grid of latitude and longitude first, such as with gdalwarp -t_srs EPSG:4326"
    )]
    CoordinateUnits {
        /// The coordinate.
        coordinate: String,
        /// Its unit.
        units: String,
    },
    /// A dimension to choose along that is not there.
    #[error("variable '{variable}' has no dimension '{dimension}' to choose along; its dimensions are {dimensions}")]
    NoSuchDimension {
        /// The variable.
        variable: String,
        /// The name asked for.
        dimension: String,
        /// The dimensions and their lengths.
        dimensions: String,
    },
    /// A place chosen along latitude or longitude.
    #[error("dimension '{dimension}' runs over the sphere, all of which is read; leave it out of --select")]
    SphereDimension {
        /// The dimension.
        dimension: String,
    },
    /// Two choices along one dimension.
    #[error("dimension '{dimension}' is chosen along twice; leave one --select out")]
    SelectedTwice {
        /// The dimension.
        dimension: String,
    },
    /// A value that a coordinate does not have.
    #[error("there is no {dimension} = {place}; the values are {values}")]
    NoSuchPlace {
        /// The dimension.
        dimension: String,
        /// The value asked for.
        place: String,
        /// The values.
        values: String,
    },
    /// A value that a coordinate has more than once.
    #[error(
        "{dimension} = {place} is met {count} times; choose one by its number, such as --select {dimension}=#{first}"
    )]
    SeveralPlaces {
        /// The dimension.
        dimension: String,
        /// The value asked for.
        place: String,
        /// How often.
        count: usize,
        /// The number of the first.
        first: usize,
    },
    /// A place beyond a dimension.
    #[error("there is no {dimension} = #{index}; they are numbered from #0 to #{last}")]
    IndexRange {
        /// The dimension.
        dimension: String,
        /// The number asked for.
        index: usize,
        /// The last number.
        last: usize,
    },
    /// A dimension along which nothing is chosen.
    #[error(
        "variable '{variable}' has several values along '{dimension}': {values}; choose one with --select {dimension}=VALUE"
    )]
    DimensionLeft {
        /// The variable.
        variable: String,
        /// The dimension.
        dimension: String,
        /// The values.
        values: String,
    },
    /// An HDU asked of a file that has none.
    #[error("there is no HDU {hdu} in a file of this format; leave --hdu out")]
    NoHdus {
        /// The HDU asked for.
        hdu: usize,
    },
    /// A number beyond those of 64 bits with a sign.
    #[error("variable '{variable}' holds {value}, beyond 2^63 - 1; store it as a signed or a real number")]
    LargeNumber {
        /// The variable.
        variable: String,
        /// The number.
        value: u64,
    },

    /// Text without the columns that say where points are.
    #[error(
        "no line of this text names columns of longitude and latitude, or of x, y and z; add a line such as 'lon,lat,value' before the numbers"
    )]
    NoPointColumns,
    /// Two columns of which either could be the one that is needed.
    #[error("columns '{first}' and '{second}' could both be the {coordinate}; rename one of them")]
    TwoCoordinates {
        /// What is needed, such as "longitude".
        coordinate: &'static str,
        /// One column.
        first: String,
        /// The other.
        second: String,
    },
    /// Angles that are not in degrees.
    #[error("the angles in column '{column}' are in radians; convert them to degrees")]
    RadianColumn {
        /// The column.
        column: String,
    },
    /// A column that is not there.
    #[error("there is no column {field}; the columns of values are {columns}")]
    UnknownColumn {
        /// The name or number asked for.
        field: String,
        /// The columns that could be a map.
        columns: String,
    },
    /// Several columns where one is needed.
    #[error("several columns could be the map: {columns}; choose one by its name or number with --variable")]
    SeveralColumns {
        /// The columns.
        columns: String,
    },
    /// Points that carry nothing.
    #[error("there is no column of numbers besides {coordinates}; name the column of values with --variable")]
    NoValueColumn {
        /// The columns that are no values.
        coordinates: String,
    },
    /// A field that is not given at points.
    #[error("the points have no dimension '{dimension}' to choose from; leave --select out, or pick the rows first")]
    NoDimension {
        /// The dimension asked for.
        dimension: String,
    },
    /// A row with too few or too many cells.
    #[error("{place} has {found} values but there are {expected} columns; correct it")]
    RowLength {
        /// The row.
        place: String,
        /// Its values.
        found: usize,
        /// The columns that the header names.
        expected: usize,
    },
    /// Something else where a number is needed.
    #[error("{place} has '{text}' as '{column}', which is not {expected}; correct it")]
    BadNumber {
        /// The row or vertex.
        place: String,
        /// The column.
        column: String,
        /// What is there.
        text: String,
        /// What is needed.
        expected: &'static str,
    },
    /// No point with a value.
    #[error("column '{column}' has no value at any point; choose another with --variable")]
    NoValues {
        /// The column.
        column: String,
    },
    /// A PLY header that is wrong.
    #[error("line {line} of the header is '{text}', which is not {expected}; correct it")]
    PlyHeader {
        /// The line, from 1.
        line: usize,
        /// The line's text.
        text: String,
        /// What would do.
        expected: &'static str,
    },
    /// A PLY file that is no surface with values.
    #[error("this PLY file has no {missing}; save it as a surface of triangles with a value at each vertex")]
    PlyLacks {
        /// What is missing.
        missing: &'static str,
    },
    /// A PLY file that ends too early.
    #[error(
        "the file ends after {found} of {count} entries of '{element}'; it is cut short or its header is wrong, so fetch it again"
    )]
    PlyTruncated {
        /// The element.
        element: String,
        /// Complete entries.
        found: u64,
        /// The entries that the header promises.
        count: u64,
    },
    /// A face with a corner that is not there.
    #[error(
        "face {face} (from 0) has vertex {vertex}, but the file has {vertices} vertices, numbered from 0; correct the faces"
    )]
    FaceVertex {
        /// The face.
        face: u64,
        /// The number of the vertex, as the file has it.
        vertex: f64,
        /// The number of vertices.
        vertices: u64,
    },
    /// One map for each of several times where one map is needed.
    #[error("there is a map for each of {steps} times; choose one with --select")]
    Steps {
        /// The number of times.
        steps: usize,
    },

    /// A HEALPix field of which something is not known.
    #[error("variable '{variable}' is on a HEALPix grid, but nothing says {unknown}; add it to its grid mapping")]
    GridUnknown {
        /// The variable.
        variable: String,
        /// What is not known, and the attribute that would say it.
        unknown: &'static str,
    },
    /// More or fewer values than the grid has pixels.
    #[error(
        "variable '{variable}' has {found} values along '{dimension}', but Nside {nside} has {expected} pixels; add the coordinate healpix_index, which says which ones they are, or correct the grid mapping"
    )]
    CellCount {
        /// The variable.
        variable: String,
        /// The dimension of cells.
        dimension: String,
        /// Its length.
        found: usize,
        /// Nside of the grid mapping.
        nside: usize,
        /// The number of pixels of that Nside.
        expected: usize,
    },
    /// A number that no pixel or cell has.
    #[error("'{index}' has {number} at place {place} (from 0), which is not {expected}; correct it")]
    CellNumber {
        /// The variable of numbers.
        index: String,
        /// The number.
        number: i64,
        /// Where it is.
        place: usize,
        /// What would do.
        expected: String,
    },
    /// Numbers of pixels that are no whole numbers.
    #[error("'{index}' should number pixels but holds {found}; store whole numbers")]
    CellKind {
        /// The variable of numbers.
        index: String,
        /// What it holds.
        found: &'static str,
    },
    /// Two cells that are the same or share an area.
    #[error("'{index}' has the cells {first} and {second} (UNIQ numbers), which overlap; remove one of them")]
    CellOverlap {
        /// The variable of numbers.
        index: String,
        /// One cell.
        first: u64,
        /// The other.
        second: u64,
    },
    /// A pixel that occurs twice.
    #[error("'{index}' names pixel {number} more than once; remove the duplicates")]
    CellTwice {
        /// The variable of numbers.
        index: String,
        /// The number.
        number: i64,
    },
    /// Cells too fine to be expanded unasked.
    #[error(
        "the cells of '{index}' reach Nside {finest}, beyond {limit}; choose the resolution to bring them to with --nside"
    )]
    CellsFine {
        /// The variable of numbers.
        index: String,
        /// Nside of the finest cells.
        finest: usize,
        /// The finest Nside that is used without being asked for.
        limit: usize,
    },
    /// A resolution asked of a field that has but one.
    #[error(
        "variable '{variable}' has Nside {nside}, so it cannot be read at Nside {asked}; leave --nside out, or degrade the field first (for example with healpy.ud_grade)"
    )]
    OneResolution {
        /// The variable.
        variable: String,
        /// Its Nside.
        nside: usize,
        /// The Nside asked for.
        asked: usize,
    },

    /// Metadata of a Zarr store that cannot be.
    #[error("the metadata of {node} in this Zarr store is wrong ({problem}); fetch or write the store again")]
    ZarrMetadata {
        /// The array, group or file.
        node: String,
        /// What is wrong.
        problem: String,
    },
    /// The Zarr library refused.
    #[error("cannot read the array '{array}': the Zarr library says \"{message}\"; check the store with zarr-python")]
    Zarr {
        /// Path of the array.
        array: String,
        /// The library's words.
        message: String,
    },
    /// An array, or a chunk of it, larger than memory.
    #[error(
        "the part of array '{array}' that is needed, or a chunk of it, has {gibibytes:.1} GiB, more memory than there is; select less of it, or rechunk the store"
    )]
    ZarrMemory {
        /// Path of the array.
        array: String,
        /// The memory needed.
        gibibytes: f64,
    },

    /// Values that could not be made, for a reason of the one who makes them.
    #[error("{reason}")]
    NoResult {
        /// The reason.
        reason: String,
    },
    /// A file that is not to be replaced.
    #[error("the file exists; choose another name, or overwrite it with --overwrite")]
    Exists,
    /// A folder that is not there.
    #[error("the folder {} does not exist; create it first", shown(folder))]
    NoFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// A column of the wrong length.
    #[error("column '{column}' has {found} values but Nside {nside} has {expected} pixels")]
    ColumnLength {
        /// The column.
        column: String,
        /// Its length.
        found: usize,
        /// Nside of the file.
        nside: usize,
        /// The number of pixels of that Nside.
        expected: usize,
    },
    /// A header entry that FITS does not have.
    #[error("{key:?} is not a FITS keyword, which has one to eight of A-Z, 0-9, '-' and '_'")]
    CardKey {
        /// The keyword.
        key: String,
    },
    /// A name too long for a header entry.
    #[error("the name or unit '{text}' is longer than the 68 characters that FITS allows; shorten it")]
    LongName {
        /// The text.
        text: String,
    },
}

impl Error {
    /// Says which file the problem is with, unless that has been said.
    pub(crate) fn of(self, path: &Path) -> Self {
        match self {
            Error::File { .. } => self,
            problem => Error::File { path: path.to_owned(), problem: Box::new(problem) },
        }
    }

    /// For `map_err`: an operating system's refusal of the action.
    pub(crate) fn io(action: &'static str) -> impl Fn(io::Error) -> Self {
        move |cause| match cause.kind() {
            io::ErrorKind::NotFound => Error::Missing,
            _ => Error::Io { action, cause },
        }
    }
}

/// A path on one line.
fn shown(path: &Path) -> String {
    path.display().to_string().replace(char::is_control, "\u{fffd}")
}
