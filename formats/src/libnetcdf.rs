//! The edge to libnetcdf: files, groups, variables, attributes and values, safely.
//!
//! All `unsafe` for NetCDF is here. The meaning of names and attributes is left to others.
//!
//! libnetcdf takes some names for addresses on the net (`http://...`, `file#mode=zarr`), so it is given nothing but
//! absolute paths; and backslashes for slashes, so a path with one is reached by a link. The library is not thread-safe:
//! each call takes the lock that it shares with HDF5.

use std::cell::Cell;
use std::ffi::{CStr, CString, c_char, c_int};
use std::fmt::Display;
use std::path::Path;
use std::ptr;

use hdf5_sys::h5e::{H5E_DEFAULT, H5Eset_auto2};
use netcdf_sys as sys;

use crate::dataset::{self, Attribute, Dimension};
use crate::error::{Error, ErrorKind, Reason, Use};
use crate::text::on_one_line;

/// A refusal of libnetcdf.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Problem {
    #[error("cannot {action}: the NetCDF library says \"{message}\"; {}", .use_of.remedy())]
    Refused { action: String, message: String, use_of: Use },
}

/// The use of a file that is read.
const READING: Use = Use::Reading("check the file with ncdump -h");

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::Refused { use_of, .. } => use_of.kind(),
        }
    }
}

/// Buffers for names; libnetcdf's limit and the NUL.
const NAME_LEN: usize = sys::NC_MAX_NAME as usize + 1;

/// A NetCDF file that is read.
pub(crate) struct NetcdfReader {
    id: c_int,
}

/// A group of a file, by its number.
#[derive(Clone, Copy)]
pub(crate) struct GroupId(c_int);

/// A variable of a file, by its group's number and its own.
#[derive(Clone, Copy)]
pub(crate) struct VariableId(c_int, c_int);

/// A variable without its attributes.
pub(crate) struct VariableHead {
    pub(crate) id: VariableId,
    pub(crate) name: String,
    /// libnetcdf's number of the type.
    pub(crate) kind: sys::nc_type,
    pub(crate) dimensions: Vec<Dimension>,
    /// The shape of the chunks in which values are compressed; nothing where there are none.
    pub(crate) chunks: Option<Vec<usize>>,
}

/// The start and the length of what is read along each dimension.
pub(crate) struct Part {
    pub(crate) start: Vec<usize>,
    pub(crate) count: Vec<usize>,
}

impl Part {
    /// Number of values, unless there are too many to count.
    fn values(&self) -> Option<usize> {
        self.count.iter().try_fold(1usize, |product, &n| product.checked_mul(n))
    }
}

thread_local! {
    /// Whether HDF5 keeps quiet in this thread.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Keeps HDF5 from printing its errors in this thread; for those who call libnetcdf by other ways.
pub(crate) fn quiet() {
    let _guard = sys::libnetcdf_lock.lock();
    quieten();
}

/// Keeps HDF5 from printing its errors, of which libnetcdf tells. It has a printer for each thread.
fn quieten() {
    if !QUIET.replace(true) {
        // SAFETY: the caller holds the lock of HDF5; no function to call is what takes the place of the printer, which
        // needs no data. A failure leaves the printer where it is.
        unsafe { H5Eset_auto2(H5E_DEFAULT, None, ptr::null_mut()) };
    }
}

/// Calls libnetcdf, alone in the process.
fn call(action: impl Display, function: impl FnOnce() -> c_int) -> Result<(), Error> {
    let _guard = sys::libnetcdf_lock.lock();
    quieten();
    match function() {
        sys::NC_NOERR => Ok(()),
        status => {
            // SAFETY: for any number libnetcdf gives a C string, which lives at least until the next call.
            let message = unsafe { CStr::from_ptr(sys::nc_strerror(status)) };
            let message = text(message.to_bytes().to_vec());
            Err(Problem::Refused { action: action.to_string(), message, use_of: READING }.into())
        }
    }
}

/// Text as it should be, in UTF-8, or as it often is, in Latin-1.
fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap_or_else(|e| e.into_bytes().into_iter().map(char::from).collect())
}

/// The name in a buffer that libnetcdf has filled, on one line.
fn name(buffer: &[u8; NAME_LEN]) -> String {
    on_one_line(text(buffer.iter().copied().take_while(|&b| b != 0).collect()))
}

/// A vector of `len` zeros, unless there is not the memory for it.
fn zeros<T: Copy>(zero: T, len: usize) -> Option<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(len).ok()?;
    values.resize(len, zero);
    Some(values)
}

impl Drop for NetcdfReader {
    fn drop(&mut self) {
        let _guard = sys::libnetcdf_lock.lock();
        // SAFETY: the file is open and this is its last use. A failure here loses nothing, since nothing is written.
        unsafe { sys::nc_close(self.id) };
    }
}

impl NetcdfReader {
    /// Opens a file.
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let mut path = path.canonicalize().map_err(Error::io("open it"))?;
        // Once the file is open, the link is not needed.
        let _folder;
        #[cfg(unix)]
        if path.as_os_str().as_encoded_bytes().contains(&b'\\') {
            let folder = tempfile::tempdir().map_err(Error::io("make a link to it"))?;
            let link = folder.path().join("link.nc");
            std::os::unix::fs::symlink(&path, &link).map_err(Error::io("make a link to it"))?;
            path = link;
            _folder = folder;
        }
        let path = CString::new(path.into_os_string().into_encoded_bytes());
        let path = path.map_err(|e| Error::io("open it")(e.into()))?;
        let mut id = 0;
        // SAFETY: `path` is a C string and `id` a place for the result, both valid during the call.
        call("open it", || unsafe { sys::nc_open(path.as_ptr(), sys::NC_NOWRITE, &mut id) })?;
        Ok(NetcdfReader { id })
    }

    /// All groups and their paths, each after the one that it is in.
    pub(crate) fn groups(&self) -> Result<Vec<(GroupId, String)>, Error> {
        let mut groups = vec![(GroupId(self.id), "/".to_owned())];
        let mut next = 0;
        while let Some((parent, path)) = groups.get(next).cloned() {
            let ids = ids("list its groups", |count, ids| {
                // SAFETY: the file is open; `ids` is null or has room for the number that the first call gave.
                unsafe { sys::nc_inq_grps(parent.0, count, ids) }
            })?;
            for id in ids {
                let mut buffer = [0; NAME_LEN];
                // SAFETY: the group is one of the open file's; the buffer has room for the longest name.
                call("name its groups", || unsafe { sys::nc_inq_grpname(id, buffer.as_mut_ptr().cast()) })?;
                groups.push((GroupId(id), format!("{}/{}", path.trim_end_matches('/'), name(&buffer))));
            }
            next += 1;
        }
        Ok(groups)
    }

    /// The variables of a group.
    pub(crate) fn variables(&self, group: GroupId) -> Result<Vec<VariableHead>, Error> {
        let ids = ids("list its variables", |count, ids| {
            // SAFETY: the group is one of the open file's; `ids` is null or has room for the number of variables.
            unsafe { sys::nc_inq_varids(group.0, count, ids) }
        })?;
        ids.into_iter().map(|id| self.variable(VariableId(group.0, id))).collect()
    }

    fn variable(&self, id: VariableId) -> Result<VariableHead, Error> {
        const ACTION: &str = "describe its variables";
        let (mut buffer, mut kind, mut dimensions) = ([0; NAME_LEN], 0, 0);
        // SAFETY: the variable is one of the open file's, and the buffer has room for the longest name. Null is for
        // what is not asked.
        call(ACTION, || unsafe {
            let (name, null) = (buffer.as_mut_ptr().cast(), ptr::null_mut());
            sys::nc_inq_var(id.0, id.1, name, &mut kind, &mut dimensions, null, null)
        })?;
        let mut ids = vec![0; usize::try_from(dimensions).unwrap_or(0)];
        // SAFETY: `ids` has room for the number of dimensions.
        call(ACTION, || unsafe { sys::nc_inq_vardimid(id.0, id.1, ids.as_mut_ptr()) })?;
        let dimension = |dimension: c_int| {
            let (mut buffer, mut len) = ([0; NAME_LEN], 0);
            // SAFETY: the dimension is one that the variable of the open file has; the buffer is as above.
            call("describe its dimensions", || unsafe {
                sys::nc_inq_dim(id.0, dimension, buffer.as_mut_ptr().cast(), &mut len)
            })?;
            Ok(Dimension { name: name(&buffer), len })
        };
        let dimensions = ids.into_iter().map(dimension).collect::<Result<Vec<_>, Error>>()?;
        let chunks = self.chunks(id, dimensions.len());
        Ok(VariableHead { id, name: name(&buffer), kind, dimensions, chunks })
    }

    /// The shape of a variable's chunks, where it has any.
    fn chunks(&self, id: VariableId, dimensions: usize) -> Option<Vec<usize>> {
        let (mut storage, mut chunks) = (sys::NC_CONTIGUOUS, vec![0; dimensions]);
        // SAFETY: the variable is one of the open file's, and there is room for a length along each of its dimensions.
        let inquired = call("describe its chunks", || unsafe {
            sys::nc_inq_var_chunking(id.0, id.1, &mut storage, chunks.as_mut_ptr())
        });
        let chunked = inquired.is_ok() && storage == sys::NC_CHUNKED && !chunks.contains(&0);
        chunked.then_some(chunks)
    }

    /// The attributes of a group.
    pub(crate) fn group_attributes(&self, group: GroupId) -> Result<Vec<(String, Attribute)>, Error> {
        self.attributes(group.0, sys::NC_GLOBAL)
    }

    /// The attributes of a variable.
    pub(crate) fn variable_attributes(&self, id: VariableId) -> Result<Vec<(String, Attribute)>, Error> {
        self.attributes(id.0, id.1)
    }

    /// Attributes of kinds that hold neither text nor numbers are left out.
    fn attributes(&self, group: c_int, variable: c_int) -> Result<Vec<(String, Attribute)>, Error> {
        const ACTION: &str = "list its attributes";
        let mut count = 0;
        // SAFETY: group and variable are the open file's.
        call(ACTION, || unsafe {
            match variable {
                sys::NC_GLOBAL => sys::nc_inq_natts(group, &mut count),
                _ => sys::nc_inq_varnatts(group, variable, &mut count),
            }
        })?;
        let mut attributes = Vec::new();
        for number in 0..count {
            let (mut buffer, mut kind, mut len) = ([0u8; NAME_LEN], 0, 0);
            let c_name = buffer.as_mut_ptr().cast();
            // SAFETY: the attribute's number is below their count; the buffer has room for the longest name, which
            // the second call reads.
            call(ACTION, || unsafe {
                match sys::nc_inq_attname(group, variable, number, c_name) {
                    sys::NC_NOERR => sys::nc_inq_att(group, variable, c_name, &mut kind, &mut len),
                    status => status,
                }
            })?;
            if let Some(value) = attribute((group, variable), &buffer, kind, len)? {
                attributes.push((name(&buffer), value));
            }
        }
        Ok(attributes)
    }

    /// Numbers as real ones, which single precision and whole numbers up to 32 bits become exactly.
    pub(crate) fn read_real(&self, variable: &VariableHead, part: &Part) -> Result<Vec<f64>, Error> {
        read(variable, part, 0.0, |id, start, count, values| {
            // SAFETY: see `read`.
            unsafe { sys::nc_get_vara_double(id.0, id.1, start, count, values) }
        })
    }

    /// Whole numbers, of any type but the unsigned one of 64 bits.
    pub(crate) fn read_whole(&self, variable: &VariableHead, part: &Part) -> Result<Vec<i64>, Error> {
        read(variable, part, 0, |id, start, count, values| {
            // SAFETY: see `read`.
            unsafe { sys::nc_get_vara_longlong(id.0, id.1, start, count, values) }
        })
    }

    /// Unsigned whole numbers.
    pub(crate) fn read_unsigned(&self, variable: &VariableHead, part: &Part) -> Result<Vec<u64>, Error> {
        read(variable, part, 0, |id, start, count, values| {
            // SAFETY: see `read`.
            unsafe { sys::nc_get_vara_ulonglong(id.0, id.1, start, count, values) }
        })
    }

    /// Texts of `width` characters, which are the variable's last dimension.
    pub(crate) fn read_characters(
        &self,
        variable: &VariableHead,
        part: &Part,
        width: usize,
    ) -> Result<Vec<String>, Error> {
        let bytes = read(variable, part, 0u8, |id, start, count, values| {
            // SAFETY: see `read`.
            unsafe { sys::nc_get_vara_text(id.0, id.1, start, count, values.cast()) }
        })?;
        let unpadded = |bytes: &[u8]| text(bytes.iter().copied().take_while(|&b| b != 0).collect());
        Ok(bytes.chunks_exact(width.max(1)).map(|bytes| unpadded(bytes).trim_end().to_owned()).collect())
    }

    /// Texts of any length.
    pub(crate) fn read_strings(&self, variable: &VariableHead, part: &Part) -> Result<Vec<String>, Error> {
        let strings = read(variable, part, ptr::null_mut(), |id, start, count, values| {
            // SAFETY: see `read`.
            unsafe { sys::nc_get_vara_string(id.0, id.1, start, count, values) }
        })?;
        Ok(owned(strings))
    }
}

/// The numbers that a function of libnetcdf lists, when it is called once for their count and once for them.
fn ids(action: &str, list: impl Fn(*mut c_int, *mut c_int) -> c_int) -> Result<Vec<c_int>, Error> {
    let mut count = 0;
    call(action, || list(&mut count, ptr::null_mut()))?;
    let mut ids = vec![0; usize::try_from(count).unwrap_or(0)];
    call(action, || list(&mut count, ids.as_mut_ptr()))?;
    Ok(ids)
}

/// Reads a part of a variable with one of libnetcdf's functions.
///
/// `get` is given the variable, arrays of as many starts and counts as it has dimensions, and a place for as many
/// values as the counts make.
fn read<T: Copy>(
    variable: &VariableHead,
    part: &Part,
    zero: T,
    get: impl FnOnce(VariableId, *const usize, *const usize, *mut T) -> c_int,
) -> Result<Vec<T>, Error> {
    debug_assert!([part.start.len(), part.count.len()] == [variable.dimensions.len(); 2]);
    let values = part.values().and_then(|values| zeros(zero, values));
    let mut values = values.ok_or_else(|| {
        let values: f64 = part.count.iter().map(|&n| n as f64).product();
        dataset::Problem::memory(variable.name.clone(), values * size_of::<T>() as f64)
    })?;
    let (start, count) = (part.start.as_ptr(), part.count.as_ptr());
    call(format_args!("read variable '{}'", variable.name), || get(variable.id, start, count, values.as_mut_ptr()))?;
    Ok(values)
}

/// Texts in Rust's memory, for those in libnetcdf's, which is freed. A missing one is empty.
fn owned(mut strings: Vec<*mut c_char>) -> Vec<String> {
    let of = |&string: &*mut c_char| match string.is_null() {
        true => String::new(),
        // SAFETY: what is not null is a C string that libnetcdf has made.
        false => text(unsafe { CStr::from_ptr(string) }.to_bytes().to_vec()),
    };
    let texts = strings.iter().map(of).collect();
    let _guard = sys::libnetcdf_lock.lock();
    // SAFETY: the strings are libnetcdf's and this is their last use. A failure would leak them, no more.
    unsafe { sys::nc_free_string(strings.len(), strings.as_mut_ptr()) };
    texts
}

/// The value of an attribute, if it is of a kind that holds text or numbers.
fn attribute(
    (group, variable): (c_int, c_int),
    c_name: &[u8; NAME_LEN],
    kind: sys::nc_type,
    len: usize,
) -> Result<Option<Attribute>, Error> {
    let action = format!("read attribute '{}'", name(c_name));
    let memory = || dataset::Problem::memory(name(c_name), len as f64 * 8.0);
    let c_name = c_name.as_ptr().cast();
    // In all calls below group, variable and name are those of an attribute of an open file with `len` values.
    Ok(Some(match kind {
        sys::NC_CHAR => {
            let mut bytes = zeros(0u8, len).ok_or_else(memory)?;
            // SAFETY: as said; there is room for `len` characters.
            call(action, || unsafe { sys::nc_get_att_text(group, variable, c_name, bytes.as_mut_ptr().cast()) })?;
            // The padding of texts is no part of them.
            bytes.truncate(bytes.iter().rposition(|&b| b != 0).map_or(0, |last| last + 1));
            Attribute::Text(text(bytes))
        }
        sys::NC_STRING => {
            let mut strings = zeros(ptr::null_mut(), len).ok_or_else(memory)?;
            // SAFETY: as said; there is room for `len` pointers.
            call(action, || unsafe { sys::nc_get_att_string(group, variable, c_name, strings.as_mut_ptr()) })?;
            let mut texts = owned(strings);
            match texts.len() {
                1 => Attribute::Text(texts.remove(0)),
                _ => Attribute::Json(texts.into()),
            }
        }
        sys::NC_FLOAT | sys::NC_DOUBLE => {
            let mut values = zeros(0.0, len).ok_or_else(memory)?;
            // SAFETY: as said; there is room for `len` numbers.
            call(action, || unsafe { sys::nc_get_att_double(group, variable, c_name, values.as_mut_ptr()) })?;
            Attribute::Real(values)
        }
        sys::NC_UINT64 => {
            let mut values = zeros(0u64, len).ok_or_else(memory)?;
            // SAFETY: as said; there is room for `len` numbers.
            call(action, || unsafe { sys::nc_get_att_ulonglong(group, variable, c_name, values.as_mut_ptr()) })?;
            let whole: Result<Vec<_>, _> = values.iter().map(|&value| i64::try_from(value)).collect();
            whole.map_or_else(|_| Attribute::Real(values.iter().map(|&v| v as f64).collect()), Attribute::Whole)
        }
        sys::NC_BYTE | sys::NC_SHORT | sys::NC_INT | sys::NC_INT64 | sys::NC_UBYTE | sys::NC_USHORT | sys::NC_UINT => {
            let mut values = zeros(0i64, len).ok_or_else(memory)?;
            // SAFETY: as said; there is room for `len` numbers.
            call(action, || unsafe { sys::nc_get_att_longlong(group, variable, c_name, values.as_mut_ptr()) })?;
            Attribute::Whole(values)
        }
        _ => return Ok(None),
    }))
}
