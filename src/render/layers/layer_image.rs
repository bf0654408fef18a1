//! Layers as they are handed out.

use crate::image::exr::DataWindow;

/// The layers of a picture, beside the picture itself.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerImage {
    /// The pixels that were rendered, counted from the top left of the whole picture.
    pub window: DataWindow,
    /// The channels of all layers.
    pub channels: Vec<LayerChannel>,
    /// Names and values that go with the channels, such as the names of ids.
    pub attributes: Vec<(String, String)>,
}

/// One channel of a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerChannel {
    /// Its name, with the layer's before a dot.
    pub name: String,
    /// Whether half precision is too little for it.
    pub needs_float: bool,
    /// Values, row by row from the top left of the window.
    pub values: Vec<f32>,
}
