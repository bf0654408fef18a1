//! OpenEXR: an image in linear light, or any set of named channels, in half or float.

mod blocks;
mod channels;
mod merge;
mod read;
mod read_channels;
mod write;

use ::exr::math::Vec2;
use ::exr::meta::attribute::Chromaticities;

pub use ::exr::prelude::f16;
pub use channels::{Channel, ChannelImage, DataWindow, Samples};
pub use merge::{MergeError, merge};
pub use read::decode;
pub use read_channels::{decode_channels, metadata};
pub use write::{encode, encode_channels, encode_part};

/// First bytes of every EXR file.
pub(crate) const SIGNATURE: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// The primaries and white point of BT.709, which is also what a file without the attribute means.
const BT_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Precision of a written file's channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SampleType {
    /// 16 bits: 11 significant bits, up to 65,504. Finite values beyond are clamped to that.
    #[default]
    Half,
    /// 32 bits: exactly what was rendered.
    Float,
}
