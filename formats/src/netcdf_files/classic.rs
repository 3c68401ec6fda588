//! Whether a NetCDF 3 file is whole.
//!
//! libnetcdf reads zeros beyond the end of such a file, and may crash on a damaged header. So the header is looked at
//! here first, as the NetCDF file format specification has it (appendix B of the NetCDF User's Guide): for whether it
//! makes sense and where the data end. The content of the header is left to libnetcdf.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use crate::error::{self, Error, ErrorKind, Reason};

/// A NetCDF 3 file that is not whole.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error("the NetCDF header is damaged or cut short; fetch the file again")]
    Header,
    #[error("the header promises {needed} bytes but the file ends after {found}; it is cut short, so fetch it again")]
    Truncated { needed: u128, found: u64 },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::Header => ErrorKind::Corrupt,
            Problem::Truncated { .. } => ErrorKind::Truncated,
        }
    }
}

/// Tags of the lists in the header.
const DIMENSIONS: u32 = 10;
const VARIABLES: u32 = 11;
const ATTRIBUTES: u32 = 12;

/// The longest name, and the most dimensions of a variable, that libnetcdf has room for.
const NAME_MAX: u64 = 256;
const DIMENSIONS_MAX: u64 = 1024;

/// The number of records of a file that was written as a stream: unknown.
const STREAMING: u64 = u32::MAX as u64;

/// Whether a file that begins with `head` is NetCDF 3.
pub(super) fn recognises(head: &[u8]) -> bool {
    [b"CDF\x01", b"CDF\x02", b"CDF\x05"].iter().any(|magic| head.starts_with(*magic))
}

/// Fails where a NetCDF 3 file has a damaged header or ends before its data. Other files pass.
pub(super) fn check(path: &Path) -> Result<(), Error> {
    let mut file = BufReader::new(File::open(path).map_err(Error::io("open it"))?);
    let found = file.get_ref().metadata().map_err(Error::io("open it"))?.len();
    let mut magic = Vec::new();
    file.by_ref().take(4).read_to_end(&mut magic).map_err(Error::io("read it"))?;
    if !recognises(&magic) {
        return Ok(());
    }
    let needed = Header { from: file, version: magic[3] }.end_of_data().map_err(|cause| -> Error {
        match cause.kind() {
            io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => Problem::Header.into(),
            _ => error::Problem::Io { action: "read it", cause }.into(),
        }
    })?;
    if needed > u128::from(found) { Err(Problem::Truncated { needed, found }.into()) } else { Ok(()) }
}

/// A header that is being read.
struct Header<R> {
    from: R,
    /// 1, 2 or 5, which sets the width of numbers.
    version: u8,
}

fn damaged() -> io::Error {
    io::ErrorKind::InvalidData.into()
}

impl<R: Read> Header<R> {
    fn u32(&mut self) -> io::Result<u32> {
        let mut bytes = [0; 4];
        self.from.read_exact(&mut bytes)?;
        Ok(u32::from_be_bytes(bytes))
    }

    /// A number of four or eight bytes.
    fn number(&mut self, long: bool) -> io::Result<u64> {
        let high = if long { self.u32()? } else { 0 };
        Ok(u64::from(high) << 32 | u64::from(self.u32()?))
    }

    /// A count or a length.
    fn count(&mut self) -> io::Result<u64> {
        self.number(self.version == 5)
    }

    /// Passes over bytes and the padding to a multiple of four.
    fn skip(&mut self, bytes: u64) -> io::Result<()> {
        let padded = bytes.checked_next_multiple_of(4).ok_or_else(damaged)?;
        let skipped = io::copy(&mut (&mut self.from).take(padded), &mut io::sink())?;
        if skipped == padded { Ok(()) } else { Err(damaged()) }
    }

    fn skip_name(&mut self) -> io::Result<()> {
        let len = self.count()?;
        if len <= NAME_MAX { self.skip(len) } else { Err(damaged()) }
    }

    /// The number of entries of a list.
    fn list(&mut self, tag: u32) -> io::Result<u64> {
        let (found, count) = (self.u32()?, self.count()?);
        if found == tag || (found, count) == (0, 0) { Ok(count) } else { Err(damaged()) }
    }

    /// Bytes of a number of the type that comes next.
    fn size(&mut self) -> io::Result<u64> {
        match self.u32()? {
            1 | 2 | 7 => Ok(1),
            3 | 8 => Ok(2),
            4 | 5 | 9 => Ok(4),
            6 | 10 | 11 => Ok(8),
            _ => Err(damaged()),
        }
    }

    fn skip_attributes(&mut self) -> io::Result<()> {
        for _ in 0..self.list(ATTRIBUTES)? {
            self.skip_name()?;
            let (size, count) = (self.size()?, self.count()?);
            self.skip(size.checked_mul(count).ok_or_else(damaged)?)?;
        }
        Ok(())
    }

    /// Where the data of the last variable end, in bytes from the beginning of the file.
    fn end_of_data(&mut self) -> io::Result<u128> {
        let records = self.count()?;
        let mut lengths = Vec::new();
        for _ in 0..self.list(DIMENSIONS)? {
            self.skip_name()?;
            lengths.push(self.count()?);
        }
        self.skip_attributes()?;
        let mut end = 0;
        // Begin and size of the variables that have a part in each record.
        let mut in_records = Vec::new();
        for _ in 0..self.list(VARIABLES)? {
            self.skip_name()?;
            let (mut values, mut recorded) = (1u128, false);
            let dimensions = self.count()?;
            if dimensions > DIMENSIONS_MAX {
                return Err(damaged());
            }
            for i in 0..dimensions {
                let dimension = usize::try_from(self.count()?).map_err(|_| damaged())?;
                match *lengths.get(dimension).ok_or_else(damaged)? {
                    // The dimension of records is said to have length 0.
                    0 if i == 0 => recorded = true,
                    length => values = values.saturating_mul(length.into()),
                }
            }
            self.skip_attributes()?;
            let size = values.saturating_mul(self.size()?.into());
            // The size that the header has for the variable tells nothing new, and overflows for large ones.
            self.count()?;
            let begin = u128::from(self.number(self.version != 1)?);
            if recorded {
                in_records.push((begin, size));
            } else if size > 0 {
                end = end.max(begin.saturating_add(size));
            }
        }
        let unknown = records == STREAMING || records == u64::MAX;
        if records > 0 && !unknown {
            // The one variable that is alone in its records is not padded.
            let padded = |size: u128| size.div_ceil(4).saturating_mul(4);
            let step = match in_records[..] {
                [(_, size)] => size,
                _ => in_records.iter().fold(0, |sum: u128, &(_, size)| sum.saturating_add(padded(size))),
            };
            let before = step.saturating_mul(u128::from(records - 1));
            for (begin, size) in in_records {
                end = end.max(begin.saturating_add(before).saturating_add(size));
            }
        }
        Ok(end)
    }
}
