//! `--aov` and `--light-groups` of `lightmesh render`: layers of the image, in its EXR files.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

use super::error::CommandError;
use crate::image::exr::SampleType;
use crate::image::exr::{Channel, ChannelImage, Samples, encode_channels};
use crate::image::{Image, ImageError, ImageFormat, ImageOptions, OutputTarget, Window};
use crate::render::{Layer, LayerChoice, LayerCollector, LayerImage};
use crate::settings::{Named, UnknownName};

/// The word for all layers.
const ALL: &str = "all";

/// Which layers an image has.
#[derive(Args, Clone, Debug, Default)]
pub struct LayerArgs {
    /// Layers to add to EXR files, separated by commas: direct, indirect, emission, reflection, albedo, normal, depth, position, object,
    /// material, mesh-points, error; or all
    #[arg(long, value_name = "LIST", default_value = "", hide_default_value = true)]
    pub aov: LayerList,
    /// Add a layer of direct light for each group of lights to EXR files
    #[arg(long)]
    pub light_groups: bool,
}

/// A list of layers, each once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerList(Vec<Layer>);

impl FromStr for LayerList {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut layers = Vec::new();
        for name in text.split(',').map(str::trim).filter(|name| !name.is_empty()) {
            if name == ALL {
                layers.extend(Layer::NAMES.iter().map(|(_, layer, _)| *layer));
                continue;
            }
            let known =
                |error: UnknownName| UnknownName { expected: format!("{}, {ALL}", error.expected), ..error };
            layers.push(Layer::named(name).map_err(known)?);
        }
        let mut seen = Vec::new();
        layers.retain(|layer| {
            !seen.contains(layer) && {
                seen.push(*layer);
                true
            }
        });
        Ok(Self(layers))
    }
}

/// The names of the layers, each after a comma.
impl fmt::Display for LayerArgs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.aov.0.iter().try_for_each(|layer| write!(f, ",{layer}"))?;
        f.write_str(if self.light_groups { ",light-groups" } else { "" })
    }
}

impl LayerArgs {
    /// Who collects the layers that are asked for, if any are.
    ///
    /// # Errors
    /// [`CommandError::Layers`] if none of the targets can hold them.
    pub fn collector(&self, targets: &[OutputTarget]) -> Result<Option<LayerCollector>, CommandError> {
        let choice = LayerChoice { layers: self.aov.0.clone(), light_groups: self.light_groups };
        if choice.is_empty() {
            return Ok(None);
        }
        if !targets.iter().any(|target| target.format() == ImageFormat::Exr) {
            let file = targets.first().map_or(PathBuf::new(), |target| target.path().to_owned());
            return Err(CommandError::Layers { file });
        }
        Ok(Some(LayerCollector::new(choice)))
    }
}

/// Writes an image, or the part of it that the options name, with its layers if the format has any.
///
/// # Errors
/// As [`OutputTarget::write`].
pub fn write(
    target: &OutputTarget,
    image: &Image,
    layers: Option<&LayerImage>,
    options: &ImageOptions,
) -> Result<(), ImageError> {
    match layers {
        Some(layers) if target.format() == ImageFormat::Exr => {
            let refuse = |cause: String| ImageError::Encode { path: target.path().to_owned(), cause };
            let file = with_layers(image, layers, options)
                .ok_or_else(|| refuse("the part lies beyond the image".to_owned()))?;
            let bytes = encode_channels(file).map_err(|error| refuse(error.to_string()))?;
            target.file().write(&bytes)
        }
        _ => target.write(image, options),
    }
}

/// All channels of a file, of the part that is written; `None` if that lies beyond the image.
fn with_layers(image: &Image, layers: &LayerImage, options: &ImageOptions) -> Option<ChannelImage> {
    let display = (image.width(), image.height());
    let window = options.window.unwrap_or(Window::whole(display));
    let cropped = image.crop(window)?;
    let mut file = ChannelImage::new(display, window.try_into().ok()?);
    // Layers have the tiles that the part lies in.
    let from = |start: i32, of_layers: i32| usize::try_from(start.checked_sub(of_layers)?).ok();
    let (left, top) = (from(file.window.x, layers.window.x)?, from(file.window.y, layers.window.y)?);
    for (index, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values = cropped.pixels().iter().map(|pixel| pixel[index]);
        file.channels.push(Channel::new(name, Samples::of(options.sample_type, values)));
    }
    for layer in &layers.channels {
        let sample_type = if layer.needs_float { SampleType::Float } else { options.sample_type };
        let rows = layer.values.chunks(layers.window.width as usize);
        let shown = rows.skip(top).take(window.height as usize);
        let columns = left..left + window.width as usize;
        let values = shown.flat_map(|row| row.get(columns.clone()).unwrap_or_default()).copied();
        file.channels.push(Channel::new(&layer.name, Samples::of(sample_type, values)));
    }
    file.metadata = options.metadata.iter().chain(&layers.attributes).cloned().collect();
    Some(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names in any order, each once; `all` is all; others are refused with those that there are.
    #[test]
    fn lists_of_layers_are_read() {
        let list = |text: &str| text.parse::<LayerList>().map(|list| list.0);
        assert_eq!(list("normal, albedo,normal"), Ok(vec![Layer::Normal, Layer::Albedo]));
        assert_eq!(list(""), Ok(Vec::new()));
        assert_eq!(list("depth,all").unwrap().len(), Layer::NAMES.len());
        assert_eq!(list("depth,all").unwrap()[0], Layer::Depth);
        let error = list("normals").unwrap_err().to_string();
        assert!(error.contains("`normals`") && error.ends_with(", all"), "{error}");
    }
}
