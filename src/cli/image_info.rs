//! `lightmesh info` of an EXR file: size, windows, channels and attributes.

use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;

use super::error::CommandError;
use crate::image::ImageError;
use crate::image::exr::decode_channels;

/// What an image file holds.
#[derive(Serialize)]
pub struct ImageInfo {
    /// Width and height of the picture.
    size: [u32; 2],
    /// Left column, top row, width and height of the pixels that there are.
    window: [i64; 4],
    channels: Vec<ChannelInfo>,
    attributes: Vec<(String, String)>,
}

#[derive(Serialize)]
struct ChannelInfo {
    name: String,
    /// `half`, `float` or `uint`.
    samples: &'static str,
}

impl ImageInfo {
    /// Whether a file is one of those that this is for, by its name.
    pub fn is_for(path: &Path) -> bool {
        path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
    }

    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, CommandError> {
        let path_of = || path.to_owned();
        let bytes = std::fs::read(path).map_err(|source| ImageError::Read { path: path_of(), source })?;
        let image =
            decode_channels(&bytes).map_err(|source| ImageError::Contents { path: path_of(), source })?;
        let window = image.window;
        Ok(Self {
            size: [image.display.0, image.display.1],
            window: [window.x.into(), window.y.into(), window.width.into(), window.height.into()],
            channels: (image.channels.iter())
                .map(|channel| ChannelInfo {
                    name: channel.name.clone(),
                    samples: channel.samples.type_name(),
                })
                .collect(),
            attributes: image.metadata,
        })
    }

    /// Prints it for people.
    pub fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        let ([width, height], [x, y, columns, rows]) = (self.size, self.window);
        writeln!(out, "size       {width} by {height} pixels")?;
        writeln!(out, "window     {columns} by {rows} pixels at ({x}, {y})")?;
        // The channels of a layer in one line: they mostly have the same samples.
        let mut channels = self.channels.iter().peekable();
        while let Some(first) = channels.next() {
            let layer =
                |channel: &ChannelInfo| channel.name.rsplit_once('.').map(|(layer, _)| layer.to_owned());
            let mut names = first.name.clone();
            while let Some(next) =
                channels.next_if(|next| (layer(next), next.samples) == (layer(first), first.samples))
            {
                names += &format!(", {}", next.name);
            }
            writeln!(out, "channels   {names} ({})", first.samples)?;
        }
        for (name, value) in &self.attributes {
            writeln!(out, "attribute  {name}: {value}")?;
        }
        Ok(())
    }
}
