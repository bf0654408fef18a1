//! Any set of named channels, as an EXR file holds them.

use std::collections::HashSet;

use ::exr::prelude::f16;

use super::SampleType;
use crate::image;

/// The channels of an EXR file of one part.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelImage {
    /// Width and height of the display window, the whole picture, whose top left pixel is (0, 0).
    pub display: (u32, u32),
    /// The data window: which of its pixels there are.
    pub window: DataWindow,
    /// The channels, each with one sample per pixel of the data window.
    pub channels: Vec<Channel>,
    /// String attributes: names and values.
    pub metadata: Vec<(String, String)>,
}

/// A rectangle of pixels, counted from the top left pixel of the display window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataWindow {
    /// Left column.
    pub x: i32,
    /// Top row.
    pub y: i32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// One named channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The whole name, with that of the layer before a dot: `direct.R`.
    pub name: String,
    /// Its samples, row by row from the top left of the data window.
    pub samples: Samples,
}

/// Samples of a channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// 16-bit floating point.
    Half(Vec<f16>),
    /// 32-bit floating point.
    Float(Vec<f32>),
    /// Unsigned whole numbers of 32 bits.
    Whole(Vec<u32>),
}

impl ChannelImage {
    /// A file without channels and attributes.
    pub fn new(display: (u32, u32), window: DataWindow) -> Self {
        Self { display, window, channels: Vec::new(), metadata: Vec::new() }
    }

    /// The channel of this name.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|channel| channel.name == name)
    }

    /// What is wrong with it, if anything is.
    pub(super) fn check(&self) -> Result<(), String> {
        let Self { display: (width, height), window, channels, .. } = self;
        let inside = |start: i32, length: u32, end: u32| {
            start >= 0 && length > 0 && i64::from(start) + i64::from(length) <= i64::from(end)
        };
        if !inside(window.x, window.width, *width) || !inside(window.y, window.height, *height) {
            return Err(format!("a data window of {window} in a picture of {width} by {height} pixels"));
        }
        if channels.is_empty() {
            return Err("no channels".to_owned());
        }
        let mut names = HashSet::new();
        for Channel { name, samples } in channels {
            if name.is_empty() || !names.insert(name) {
                return Err(format!("two channels named `{name}`, or one without a name"));
            }
            if samples.len() as u64 != window.pixels() {
                return Err(format!("channel `{name}`: {} samples for {window}", samples.len()));
            }
        }
        Ok(())
    }
}

impl DataWindow {
    /// All of a display window of this width and height.
    pub fn of_display((width, height): (u32, u32)) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// As far as the format's signed numbers reach.
impl TryFrom<image::Window> for DataWindow {
    type Error = std::num::TryFromIntError;

    fn try_from(window: image::Window) -> Result<Self, Self::Error> {
        let image::Window { x, y, width, height } = window;
        Ok(Self { x: x.try_into()?, y: y.try_into()?, width, height })
    }
}

impl std::fmt::Display for DataWindow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { x, y, width, height } = self;
        write!(f, "{width} by {height} pixels at ({x}, {y})")
    }
}

impl Channel {
    /// A channel of this name.
    pub fn new(name: impl Into<String>, samples: Samples) -> Self {
        Self { name: name.into(), samples }
    }
}

impl Samples {
    /// Values in the precision asked for.
    pub fn of(sample_type: SampleType, values: impl Iterator<Item = f32>) -> Self {
        match sample_type {
            SampleType::Half => Self::Half(values.map(nearest_half).collect()),
            SampleType::Float => Self::Float(values.collect()),
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Self::Half(values) => values.len(),
            Self::Float(values) => values.len(),
            Self::Whole(values) => values.len(),
        }
    }

    /// The sample of this number as a float, if there is one; whole numbers beyond 2²⁴ are rounded.
    pub fn get(&self, index: usize) -> Option<f32> {
        match self {
            Self::Half(values) => values.get(index).map(|value| value.to_f32()),
            Self::Float(values) => values.get(index).copied(),
            Self::Whole(values) => values.get(index).map(|&value| value as f32),
        }
    }

    /// What the samples are called in messages: `half`, `float` or `uint`, the words of OpenEXR.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Half(_) => "half",
            Self::Float(_) => "float",
            Self::Whole(_) => "uint",
        }
    }
}

/// Rounds to half; a light too bright for it stays finite.
fn nearest_half(value: f32) -> f16 {
    let limit = f16::MAX.to_f32();
    f16::from_f32(if value.is_finite() { value.clamp(-limit, limit) } else { value })
}
