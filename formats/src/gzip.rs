//! Gzip streams, known by their first bytes.

use std::io::{self, Read};

use flate2::read::MultiGzDecoder;

/// Whether a file that begins with `head` is a gzip stream.
pub(crate) fn is_gzip(head: &[u8]) -> bool {
    head.starts_with(&[0x1f, 0x8b])
}

/// The beginning of the content of a gzip stream, if `head` begins one.
pub(crate) fn gunzipped_head(head: &[u8]) -> Option<Vec<u8>> {
    if !is_gzip(head) {
        return None;
    }
    let mut inner = Vec::new();
    // The stream is cut after `head`, so an error at its end is expected.
    let _: io::Result<usize> = MultiGzDecoder::new(head).take(512).read_to_end(&mut inner);
    Some(inner)
}
