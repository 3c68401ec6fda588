//! The edge to cfitsio: files, HDUs, keywords and columns, safely.
//!
//! All `unsafe` calls of cfitsio are here. The meaning of keywords and columns is left to others.
//!
//! cfitsio gives file names a syntax of its own (`map.fits[1]`, `map.fits(copy)`, `!map.fits`, `~user`). Users' paths
//! must not be subject to it, hence the "diskfile" functions and the care of [`c_path`]. It is trusted with nothing
//! but plain FITS files on disk: it chooses decompressors by the path, and believes headers about the size of files
//! in memory.

use std::ffi::{CString, c_char, c_int, c_long};
use std::fmt::Display;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::ptr;
use std::sync::{Mutex, MutexGuard, PoisonError};

use fitsio::sys;
use tempfile::NamedTempFile;

use crate::error::{self, Error, ErrorKind, Reason, Use};
use crate::text::spaced;

/// A refusal of cfitsio, or a value that cfitsio cannot be trusted with.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Problem {
    #[error("cannot {action}: the FITS library says \"{message}\" (status {status}); {}", .use_of.remedy())]
    Refused { action: String, status: c_int, message: String, use_of: Use },
    #[error(
        "the path has {bytes} bytes but the FITS library takes at most {limit}; use a shorter one, such as a relative path"
    )]
    PathTooLong { bytes: usize, limit: usize },
    #[error("HDU {hdu} has {key} = {value}, which is not {expected}; correct the header")]
    Keyword { hdu: usize, key: String, value: String, expected: &'static str },
}

/// The use of a file that is read.
const READING: Use = Use::Reading("check the file with fitsverify");

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::Refused { use_of, .. } => use_of.kind(),
            Problem::PathTooLong { .. } => ErrorKind::Unsupported,
            Problem::Keyword { .. } => ErrorKind::Invalid,
        }
    }
}

/// cfitsio's side of an open file.
struct Handle(*mut sys::fitsfile);

/// A FITS file that is read.
pub(crate) struct FitsReader {
    handle: Handle,
    /// The same file, to be looked at without cfitsio.
    file: File,
    /// Size in bytes, without padding that was missing.
    size: u64,
    /// The first HDU that has not been visited, and where it begins.
    next: (usize, i64),
    /// The file, where it is a temporary one.
    _temporary: Option<NamedTempFile>,
}

/// A FITS file that is written.
pub(crate) struct FitsWriter {
    handle: Handle,
}

/// The kinds of HDU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HduKind {
    /// An image, perhaps an empty one.
    Image,
    /// A table of text.
    TextTable,
    /// A binary table.
    Table,
}

/// Where an HDU lies in its file, in bytes from the beginning.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Begin of the header.
    pub(crate) header: i64,
    /// Begin of the data.
    pub(crate) data: i64,
    /// End of the data, padding included.
    pub(crate) end: i64,
}

/// The longest path that fits into cfitsio's buffers with all that it appends there.
const PATH_MAX: usize = 1000;

/// The longest text over several lines that is read.
const LONG_TEXT_MAX: c_int = 1 << 16;

/// cfitsio's status for the end of the file where more was expected.
const END_OF_FILE: c_int = 107;

/// cfitsio's status for a keyword that is not there.
const KEY_NO_EXIST: c_int = 202;

/// Keeps other threads out of a cfitsio that was not compiled for them.
fn guard() -> Option<MutexGuard<'static, ()>> {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    // SAFETY: takes nothing and returns a constant.
    let reentrant = unsafe { sys::fits_is_reentrant() } != 0;
    (!reentrant).then(|| ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner))
}

/// The status of a call of cfitsio, 0 where all is well.
fn status_of(function: impl FnOnce(&mut c_int)) -> c_int {
    let _guard = guard();
    let mut status = 0;
    function(&mut status);
    status
}

/// A status as a `Result`.
fn checked(status: c_int, action: impl Display, use_of: Use) -> Result<(), Error> {
    let action = match status {
        0 => return Ok(()),
        END_OF_FILE => return Err(error::Problem::CutShort { action: action.to_string() }.into()),
        _ => action.to_string(),
    };
    let mut text = [0 as c_char; sys::FLEN_ERRMSG as usize];
    let _guard = guard();
    // SAFETY: the buffer has the length that cfitsio documents (FLEN_STATUS) and more.
    unsafe { sys::ffgerr(status, text.as_mut_ptr()) };
    Err(Problem::Refused { action, status, message: from_c(&text), use_of }.into())
}

/// Calls cfitsio to read.
fn call(action: impl Display, function: impl FnOnce(&mut c_int)) -> Result<(), Error> {
    checked(status_of(function), action, READING)
}

/// Calls cfitsio to write.
fn write(action: impl Display, function: impl FnOnce(&mut c_int)) -> Result<(), Error> {
    checked(status_of(function), action, Use::Writing)
}

/// The text in a buffer up to its NUL, without FITS's padding and control characters. Headers should be ASCII, but
/// units such as µK are met in UTF-8 and Latin-1.
fn from_c(buffer: &[c_char]) -> String {
    let bytes: Vec<u8> = buffer.iter().map(|&c| c as u8).take_while(|&b| b != 0).collect();
    let text = String::from_utf8(bytes).unwrap_or_else(|e| e.into_bytes().into_iter().map(char::from).collect());
    spaced(text.trim_end())
}

/// A path as cfitsio takes it literally.
///
/// Even the diskfile functions skip leading spaces and expand a leading `~` (crashing on an unknown user), so a relative
/// path gets a `./` in front.
fn c_path(path: &Path) -> Result<CString, Error> {
    let path = if path.is_absolute() { path.to_owned() } else { Path::new(".").join(path) };
    let bytes = path.into_os_string().into_encoded_bytes();
    if bytes.len() > PATH_MAX {
        return Err(Problem::PathTooLong { bytes: bytes.len(), limit: PATH_MAX }.into());
    }
    CString::new(bytes).map_err(|e| Error::io("open it")(e.into()))
}

/// Text for cfitsio; callers have made it printable ASCII.
fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

impl Drop for Handle {
    fn drop(&mut self) {
        if !self.0.is_null() {
            let _guard = guard();
            let mut status = 0;
            // SAFETY: the handle is open and this is its last use. A failure here loses nothing: whoever writes
            // calls `close`.
            unsafe { sys::ffclos(self.0, &mut status) };
        }
    }
}

impl FitsReader {
    /// Opens an existing, uncompressed file of whole blocks.
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        // cfitsio would go on to try `path.gz` and others if there were no such file.
        let file = File::open(path).map_err(Error::io("open it"))?;
        let size = file.metadata().map_err(Error::io("open it"))?.len();
        let name = c_path(path)?;
        let mut handle = ptr::null_mut();
        // SAFETY: `name` is a C string and `handle` a place for the result, both valid during the call.
        call("open it", |status| unsafe {
            sys::ffdkopn(&mut handle, name.as_ptr(), 0, status);
        })?;
        Ok(FitsReader { handle: Handle(handle), file, size, next: (0, 0), _temporary: None })
    }

    /// Opens a temporary copy, of which all beyond `size` bytes is padding.
    pub(crate) fn open_temporary(copy: NamedTempFile, size: u64) -> Result<Self, Error> {
        let mut reader = FitsReader::open(copy.path())?;
        reader.size = size;
        // Where an open file can be removed, nothing is left behind even by a killed process.
        reader._temporary = if cfg!(unix) { None } else { Some(copy) };
        Ok(reader)
    }

    /// Size in bytes, uncompressed and without padding that was missing.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// Makes an HDU (0 for the primary one) the current one. HDUs have to be visited in order before any is again.
    pub(crate) fn go(&mut self, hdu: usize) -> Result<HduKind, Error> {
        let (next, start) = self.next;
        debug_assert!(hdu <= next);
        if hdu == next {
            self.vet(hdu, start)?;
        }
        let mut kind = 0;
        let number = c_int::try_from(hdu + 1).unwrap_or(c_int::MAX);
        // SAFETY: the handle is open; `kind` outlives the call.
        call(format_args!("read the header of HDU {hdu}"), |status| unsafe {
            sys::ffmahd(self.handle.0, number, &mut kind, status);
        })?;
        if hdu == next {
            self.next = (hdu + 1, self.extent()?.end);
        }
        Ok(match kind {
            1 => HduKind::TextTable,
            2 => HduKind::Table,
            _ => HduKind::Image,
        })
    }

    /// Looks for sizes in the first lines of a header that cfitsio takes badly: where a table has not from 0 to 999
    /// columns, or a negative size, it goes on with that number of columns, or one that is not initialised.
    fn vet(&mut self, hdu: usize, start: i64) -> Result<(), Error> {
        let mut cards = Vec::new();
        self.file
            .seek(SeekFrom::Start(start as u64))
            .and_then(|_| self.file.by_ref().take(8 * 80).read_to_end(&mut cards))
            .map_err(Error::io("read it"))?;
        if !cards.starts_with(b"XTENSION") {
            return Ok(());
        }
        for card in cards.chunks_exact(80) {
            for (key, max) in [("NAXIS1", i64::MAX), ("NAXIS2", i64::MAX), ("TFIELDS", 999)] {
                if card.starts_with(format!("{key:<8}=").as_bytes()) {
                    let text = String::from_utf8_lossy(&card[9..]);
                    let value = text.split('/').next().unwrap_or_default().trim();
                    if !value.parse().is_ok_and(|value: i64| (0..=max).contains(&value)) {
                        let (key, value) = (key.to_owned(), spaced(value));
                        return Err(Problem::Keyword { hdu, key, value, expected: "a possible size" }.into());
                    }
                }
            }
        }
        Ok(())
    }

    /// Where the current HDU lies.
    pub(crate) fn extent(&mut self) -> Result<Extent, Error> {
        let (mut header, mut data, mut end) = (0, 0, 0);
        // SAFETY: the handle is open; the results outlive the call.
        call("find the data", |status| unsafe {
            sys::ffghadll(self.handle.0, &mut header, &mut data, &mut end, status);
        })?;
        Ok(Extent { header, data, end })
    }

    /// The value of a keyword of the current HDU as it is written there: text with its quotes, numbers as digits.
    pub(crate) fn key(&mut self, key: &str) -> Result<Option<String>, Error> {
        let name = c_text(key);
        let mut value = [0 as c_char; sys::FLEN_VALUE as usize];
        let mut comment = [0 as c_char; sys::FLEN_COMMENT as usize];
        // SAFETY: the handle is open; the buffers have the documented lengths.
        let status = status_of(|status| unsafe {
            sys::ffgkey(self.handle.0, name.as_ptr(), value.as_mut_ptr(), comment.as_mut_ptr(), status);
        });
        if status == KEY_NO_EXIST {
            return Ok(None);
        }
        checked(status, format_args!("read the keyword {key}"), READING)?;
        Ok(Some(from_c(&value)))
    }

    /// All keywords of the current HDU that have a value, with it as it is written there; texts over several lines are
    /// joined. Lines that make no sense are left out.
    pub(crate) fn keys(&mut self) -> Result<Vec<(String, String)>, Error> {
        let (mut lines, mut room) = (0, 0);
        // SAFETY: the handle is open; the results outlive the call.
        call("count the lines of the header", |status| unsafe {
            sys::ffghsp(self.handle.0, &mut lines, &mut room, status);
        })?;
        let mut keys = Vec::new();
        for line in 1..=lines {
            let mut key = [0 as c_char; sys::FLEN_KEYWORD as usize];
            let mut value = [0 as c_char; sys::FLEN_VALUE as usize];
            let mut comment = [0 as c_char; sys::FLEN_COMMENT as usize];
            // SAFETY: the handle is open; the buffers have the documented lengths.
            let read = call(format_args!("read line {line} of the header"), |status| unsafe {
                sys::ffgkyn(self.handle.0, line, key.as_mut_ptr(), value.as_mut_ptr(), comment.as_mut_ptr(), status);
            });
            match read {
                Err(e) if e.kind() == ErrorKind::Unreadable => continue,
                read => read?,
            }
            let (key, value) = (from_c(&key), from_c(&value));
            if key == "CONTINUE" || value.is_empty() {
                continue;
            }
            let long = if value.ends_with("&'") { self.long_text(&key)? } else { None };
            keys.push((key, long.unwrap_or(value)));
        }
        Ok(keys)
    }

    /// A keyword's text over several lines, in quotes.
    fn long_text(&mut self, key: &str) -> Result<Option<String>, Error> {
        let name = c_text(key);
        let mut value = vec![0 as c_char; LONG_TEXT_MAX as usize + 1];
        let mut comment = [0 as c_char; sys::FLEN_COMMENT as usize];
        let mut len = 0;
        // SAFETY: the handle is open; `value` has one place more than the characters asked for, and `comment` the
        // documented length.
        let read = call(format_args!("read the keyword {key}"), |status| unsafe {
            sys::ffgsky(
                self.handle.0,
                name.as_ptr(),
                1,
                LONG_TEXT_MAX,
                value.as_mut_ptr(),
                &mut len,
                comment.as_mut_ptr(),
                status,
            );
        });
        match read {
            Ok(()) => Ok(Some(format!("'{}'", from_c(&value).replace('\'', "''")))),
            Err(e) if e.kind() == ErrorKind::Unreadable => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// Number of columns of the current table.
    pub(crate) fn columns(&mut self) -> Result<c_int, Error> {
        let mut columns = 0;
        // SAFETY: the handle is open; `columns` outlives the call.
        call("count the columns", |status| unsafe {
            sys::ffgncl(self.handle.0, &mut columns, status);
        })?;
        Ok(columns)
    }

    /// Type code (negative for variable length), repeat count and width in bytes of a column, counted from 1.
    pub(crate) fn column_type(&mut self, column: c_int) -> Result<(c_int, i64, i64), Error> {
        let (mut code, mut repeat, mut width) = (0, 0, 0);
        // SAFETY: the handle is open; the results outlive the call.
        call(format_args!("read the type of column {column}"), |status| unsafe {
            sys::ffgtclll(self.handle.0, column, &mut code, &mut repeat, &mut width, status);
        })?;
        Ok((code, repeat, width))
    }

    /// Sets the scaling of a column, in place of TSCAL and TZERO.
    pub(crate) fn set_scaling(&mut self, column: c_int, scale: f64, zero: f64) -> Result<(), Error> {
        // SAFETY: the handle is open.
        call(format_args!("scale column {column}"), |status| unsafe {
            sys::fftscl(self.handle.0, column, scale, zero, status);
        })
    }

    /// Reads numbers of a column from row `row` and element `element` in it, both counted from 0, running on into
    /// the next rows. TSCAL and TZERO are applied; with `nulls`, values equal to TNULL become NaN.
    pub(crate) fn read_f64(
        &mut self,
        column: c_int,
        (row, element): (usize, usize),
        nulls: bool,
        out: &mut [f64],
    ) -> Result<(), Error> {
        // To cfitsio, 0 means not to look for nulls.
        let null = if nulls { f64::NAN } else { 0.0 };
        let mut any = 0;
        // SAFETY: the handle is open; cfitsio writes `out.len()` elements or fails, and sets `any`.
        call(format_args!("read column {column}"), |status| unsafe {
            sys::ffgcvd(
                self.handle.0,
                column,
                row as i64 + 1,
                element as i64 + 1,
                out.len() as i64,
                null,
                out.as_mut_ptr(),
                &mut any,
                status,
            );
        })
    }

    /// Reads integers likewise, without looking for nulls.
    pub(crate) fn read_i64(
        &mut self,
        column: c_int,
        (row, element): (usize, usize),
        out: &mut [i64],
    ) -> Result<(), Error> {
        let mut any = 0;
        // SAFETY: the handle is open; cfitsio writes `out.len()` elements or fails, and sets `any`.
        call(format_args!("read column {column} of integers"), |status| unsafe {
            sys::ffgcvjj(
                self.handle.0,
                column,
                row as i64 + 1,
                element as i64 + 1,
                out.len() as i64,
                0,
                out.as_mut_ptr(),
                &mut any,
                status,
            );
        })
    }

    /// Reads truth values likewise: 1 true, 0 false, anything else neither.
    pub(crate) fn read_logical(
        &mut self,
        column: c_int,
        (row, element): (usize, usize),
        out: &mut [u8],
    ) -> Result<(), Error> {
        let mut nulls = vec![0 as c_char; out.len()];
        let mut any = 0;
        // SAFETY: the handle is open; cfitsio writes `out.len()` elements to each of the two arrays or fails.
        call(format_args!("read column {column} of truth values"), |status| unsafe {
            sys::ffgcfl(
                self.handle.0,
                column,
                row as i64 + 1,
                element as i64 + 1,
                out.len() as i64,
                out.as_mut_ptr().cast(),
                nulls.as_mut_ptr(),
                &mut any,
                status,
            );
        })?;
        for (value, null) in out.iter_mut().zip(nulls) {
            if null != 0 {
                *value = u8::MAX;
            }
        }
        Ok(())
    }
}

impl FitsWriter {
    /// Creates a file, which must not exist.
    pub(crate) fn create(path: &Path) -> Result<Self, Error> {
        let name = c_path(path)?;
        let mut handle = ptr::null_mut();
        // SAFETY: `name` is a C string and `handle` a place for the result, both valid during the call.
        write("create it", |status| unsafe {
            sys::ffdkinit(&mut handle, name.as_ptr(), status);
        })?;
        Ok(FitsWriter { handle: Handle(handle) })
    }

    /// Writes what is left and closes the file.
    pub(crate) fn close(mut self) -> Result<(), Error> {
        let handle = std::mem::replace(&mut self.handle.0, ptr::null_mut());
        // SAFETY: `handle` is open, and no longer in `self`, so it is closed once.
        write("finish it", |status| unsafe {
            sys::ffclos(handle, status);
        })
    }

    /// Writes an empty primary HDU.
    pub(crate) fn write_primary(&mut self) -> Result<(), Error> {
        let mut axes: [c_long; 1] = [0];
        // SAFETY: the handle is open for writing; no axis is read where their number is 0.
        write("write the primary header", |status| unsafe {
            sys::ffcrim(self.handle.0, 8, 0, axes.as_mut_ptr(), status);
        })
    }

    /// Appends a binary table; each column is its name, type (TFORM) and unit.
    pub(crate) fn write_table(&mut self, name: &str, rows: usize, columns: &[[&str; 3]]) -> Result<(), Error> {
        let texts: Vec<[CString; 3]> = columns.iter().map(|column| column.map(c_text)).collect();
        let mut pointers = [0, 1, 2].map(|i| texts.iter().map(|t| t[i].as_ptr().cast_mut()).collect::<Vec<_>>());
        let [names, types, units] = &mut pointers;
        let name = c_text(name);
        // SAFETY: the handle is open for writing; each array has as many C strings as there are columns, which
        // cfitsio reads during the call only.
        write("write the header of a table", |status| unsafe {
            sys::ffcrtb(
                self.handle.0,
                2,
                rows as i64,
                columns.len() as c_int,
                names.as_mut_ptr(),
                types.as_mut_ptr(),
                units.as_mut_ptr(),
                name.as_ptr(),
                status,
            );
        })
    }

    /// Appends a header entry whose value is written as given: digits, T or F.
    pub(crate) fn write_key(&mut self, key: &str, value: &str, comment: &str) -> Result<(), Error> {
        let (key, comment) = (c_text(key), c_text(comment));
        let mut value = c_text(value).into_bytes_with_nul();
        let mut card = [0 as c_char; sys::FLEN_CARD as usize];
        // SAFETY: the handle is open for writing; all texts are C strings and `card` has the documented length.
        write("write a header entry", |status| unsafe {
            sys::ffmkky(key.as_ptr(), value.as_mut_ptr().cast(), comment.as_ptr(), card.as_mut_ptr(), status);
            sys::ffprec(self.handle.0, card.as_ptr(), status);
        })
    }

    /// Appends a header entry of text of any length. The lines are made here, since cfitsio's own function for long
    /// texts never ends for some of them.
    pub(crate) fn write_text(&mut self, key: &str, value: &str, comment: &str) -> Result<(), Error> {
        text_cards(key, value, comment).iter().try_for_each(|card| {
            let card = c_text(card);
            // SAFETY: the handle is open for writing; the card is a C string.
            write("write a header entry", |status| unsafe {
                sys::ffprec(self.handle.0, card.as_ptr(), status);
            })
        })
    }

    /// Appends the entry that announces texts over several lines.
    pub(crate) fn write_long_text_notice(&mut self) -> Result<(), Error> {
        // SAFETY: the handle is open for writing.
        write("write a header entry", |status| unsafe {
            sys::ffplsw(self.handle.0, status);
        })
    }

    /// Appends HISTORY lines.
    pub(crate) fn write_history(&mut self, text: &str) -> Result<(), Error> {
        let text = c_text(text);
        // SAFETY: the handle is open for writing; the text is a C string.
        write("write a header entry", |status| unsafe {
            sys::ffphis(self.handle.0, text.as_ptr(), status);
        })
    }

    /// Writes numbers to a column, counted from 1, from row `row` and element `element` in it
    /// on (counted from 0).
    pub(crate) fn write_f64(
        &mut self,
        column: c_int,
        (row, element): (usize, usize),
        values: &mut [f64],
    ) -> Result<(), Error> {
        // SAFETY: the handle is open for writing; cfitsio reads `values.len()` elements.
        write(format_args!("write column {column}"), |status| unsafe {
            sys::ffpcld(
                self.handle.0,
                column,
                row as i64 + 1,
                element as i64 + 1,
                values.len() as i64,
                values.as_mut_ptr(),
                status,
            );
        })
    }

    /// Writes single-precision numbers likewise.
    pub(crate) fn write_f32(
        &mut self,
        column: c_int,
        (row, element): (usize, usize),
        values: &mut [f32],
    ) -> Result<(), Error> {
        // SAFETY: the handle is open for writing; cfitsio reads `values.len()` elements.
        write(format_args!("write column {column}"), |status| unsafe {
            sys::ffpcle(
                self.handle.0,
                column,
                row as i64 + 1,
                element as i64 + 1,
                values.len() as i64,
                values.as_mut_ptr(),
                status,
            );
        })
    }
}
/// Bytes of a header's line.
const CARD: usize = 80;

/// Bytes of text on a line that another follows.
const PART: usize = 67;

/// The lines of an entry of text (FITS standard 4.0, section 4.2.1.2): quotes are doubled, and each line ends in `&` where
/// another follows.
fn text_cards(key: &str, value: &str, comment: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    for letter in value.chars().map(|c| if c == '\'' { "''".to_owned() } else { c.to_string() }) {
        match parts.last_mut() {
            Some(part) if part.len() + letter.len() <= PART => *part += &letter,
            _ => parts.push(letter),
        }
    }
    let last = parts.len() - 1;
    let card = |(i, part): (usize, &String)| {
        let start = if i == 0 { format!("{key:<8}= ") } else { "CONTINUE  ".to_owned() };
        match i == last {
            false => format!("{start}'{part}&'"),
            true => {
                // A text takes eight letters at least, and comments stand in a column.
                let text = format!("'{part:<8}'");
                let mut card = format!("{start}{text:<20}");
                let room = CARD.saturating_sub(card.len() + 3);
                if room > 0 && !comment.is_empty() {
                    card += " / ";
                    card.extend(comment.chars().take(room));
                }
                card
            }
        }
    };
    parts.iter().enumerate().map(card).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_any_length_are_put_on_lines() {
        for length in 0..300 {
            for quote in [2, 3, 7, 1000] {
                let value: String = (0..length).map(|i| if i % quote == quote - 1 { '\'' } else { 'x' }).collect();
                let cards = text_cards("COMMAND", &value, "what was done");
                let mut read = String::new();
                for (i, card) in cards.iter().enumerate() {
                    assert!(card.len() <= CARD, "{card}");
                    assert!(card.starts_with(if i == 0 { "COMMAND = '" } else { "CONTINUE  '" }), "{card}");
                    let end = if i + 1 == cards.len() { card.rfind('\'').unwrap() } else { card.len() - 2 };
                    assert!(i + 1 == cards.len() || card.ends_with("&'"), "{card}");
                    read += card[11..end].trim_end();
                }
                assert_eq!(read.replace("''", "'"), value);
            }
        }
        assert_eq!(text_cards("BODY", "above", "side"), ["BODY    = 'above   '           / side"]);
        assert_eq!(text_cards("INUNIT", "", "unit"), ["INUNIT  = '        '           / unit"]);
    }
}
