//! The Zstandard codec of Zarr stores, which never makes more than a chunk holds.
//!
//! That of `zarrs` makes room for as many bytes as the compressed data say that they hold, which, where they are
//! damaged, may be any number. All other codecs are left to `zarrs`.

use std::borrow::Cow;
use std::io::Read;
use std::sync::{Arc, Once};

use zarrs::array::codec::api::{
    BytesToBytesCodecTraits, Codec, CodecError, CodecMetadataOptions, CodecOptions, CodecRuntimePluginV2,
    CodecRuntimePluginV3, CodecTraits, PartialDecoderCapability, PartialEncoderCapability, RecommendedConcurrency,
    register_codec_v2, register_codec_v3,
};
use zarrs::array::{ArrayBytesRaw, BytesRepresentation};
use zarrs::metadata::Configuration;
use zarrs::plugin::{ExtensionName, ZarrVersion};

/// The codec's name in Zarr v2 and v3.
const NAME: &str = "zstd";

/// The most that is made of a chunk whose size nothing tells (of texts): 1 GiB.
const UNKNOWN_MAX: u64 = 1 << 30;

/// Makes the codec known to `zarrs`.
pub(crate) fn register() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let codec = || Ok(Codec::BytesToBytes(Arc::new(Zstd)));
        register_codec_v2(CodecRuntimePluginV2::new(|name| name == NAME, move |_| codec()));
        register_codec_v3(CodecRuntimePluginV3::new(|name| name == NAME, move |_| codec()));
    });
}

/// The codec.
#[derive(Debug)]
struct Zstd;

impl ExtensionName for Zstd {
    fn name(&self, _: ZarrVersion) -> Option<Cow<'static, str>> {
        Some(NAME.into())
    }
}

impl CodecTraits for Zstd {
    fn as_any(&self) -> &dyn std::any::Any {
        self
    }

    fn configuration(&self, _: ZarrVersion, _: &CodecMetadataOptions) -> Option<Configuration> {
        None
    }

    fn partial_decoder_capability(&self) -> PartialDecoderCapability {
        PartialDecoderCapability { partial_read: false, partial_decode: false }
    }

    fn partial_encoder_capability(&self) -> PartialEncoderCapability {
        PartialEncoderCapability { partial_encode: false }
    }
}

impl BytesToBytesCodecTraits for Zstd {
    fn into_dyn(self: Arc<Self>) -> Arc<dyn BytesToBytesCodecTraits> {
        self
    }

    fn recommended_concurrency(&self, _: &BytesRepresentation) -> Result<RecommendedConcurrency, CodecError> {
        Ok(RecommendedConcurrency::new_maximum(1))
    }

    fn encoded_representation(&self, _: &BytesRepresentation) -> BytesRepresentation {
        BytesRepresentation::UnboundedSize
    }

    fn encode<'a>(&self, _: ArrayBytesRaw<'a>, _: &CodecOptions) -> Result<ArrayBytesRaw<'a>, CodecError> {
        Err("Zarr stores are only read".into())
    }

    fn decode<'a>(
        &self,
        encoded: ArrayBytesRaw<'a>,
        decoded: &BytesRepresentation,
        _: &CodecOptions,
    ) -> Result<ArrayBytesRaw<'a>, CodecError> {
        let limit = decoded.size().unwrap_or(UNKNOWN_MAX);
        let mut bytes = Vec::new();
        zstd::Decoder::with_buffer(&*encoded)?.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > limit {
            return Err("a zstd chunk holds more than its array allows".into());
        }
        Ok(Cow::Owned(bytes))
    }
}
