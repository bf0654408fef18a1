//! Scenes that are named on the command line.

use std::path::Path;

use super::setup::Setup;
use super::timing::timed;
use super::{BenchError, BenchOptions};
use crate::accel::Backend;
use crate::framing::choose_view;
use crate::render::SessionError;
use crate::scene::load::{LoadedScene, OpenedScene, open_scene};
use crate::settings::{Limits, ViewSettings};

/// The longer side of images of a quick run, pixels.
const QUICK_SIDE: u32 = 32;

/// A scene as `lightmesh render` would render it, with its acceleration structure.
pub struct Opened {
    /// The scene.
    pub setup: Setup,
    /// Its acceleration structure.
    pub backend: Backend,
    /// Seconds to build it.
    pub build_seconds: f64,
    /// Whether nobody stated an exposure.
    pub bare: bool,
}

impl Opened {
    /// Reads a scene file or model, and builds the acceleration structure. Pixels have `samples` each where the options don't say how many, the scene's own if
    /// `None`.
    pub fn new(file: &Path, options: &BenchOptions, samples: Option<u32>) -> Result<Self, BenchError> {
        let (load_seconds, opened) = timed(|| open_scene(file));
        let mut opened = opened?;
        let ViewSettings { resolution, samples_per_pixel, .. } = &mut opened.loaded.settings.view;
        *samples_per_pixel = options.samples_per_pixel.or(samples).unwrap_or(*samples_per_pixel);
        *resolution = size(*resolution, options);
        opened.loaded.scene.validate().map_err(SessionError::from)?;
        let (build_seconds, built) = timed(|| Backend::build(options.backend, &opened.loaded.scene));
        let backend = built?.backend;
        let OpenedScene { loaded, bare, .. } = choose_view(&opened, &backend).complete(opened);
        let LoadedScene { scene, cameras, mut settings, .. } = loaded;
        // What is compared is one way with another, each as it is.
        settings.limits = Limits::default();
        let camera = cameras.into_iter().next().ok_or(BenchError::NoCamera)?;
        let setup = Setup { scene, camera, settings, load_seconds };
        Ok(Self { setup, backend, build_seconds, bare })
    }

    /// A scene that the benchmark made.
    pub fn made(mut setup: Setup, options: &BenchOptions) -> Result<Self, BenchError> {
        let resolution = &mut setup.settings.view.resolution;
        *resolution = size(*resolution, options);
        let (build_seconds, built) = timed(|| Backend::build(options.backend, &setup.scene));
        Ok(Self { setup, backend: built?.backend, build_seconds, bare: false })
    }
}

/// The size of images of a scene that has one of its own.
fn size(own: (u32, u32), options: &BenchOptions) -> (u32, u32) {
    let size = options.resolution.unwrap_or(own);
    if options.quick { within(size, QUICK_SIDE) } else { size }
}

/// A size of the same shape whose longer side is at most `most`.
fn within((width, height): (u32, u32), most: u32) -> (u32, u32) {
    let longer = width.max(height).max(most);
    let scaled = |side: u32| (u64::from(side) * u64::from(most) / u64::from(longer)).max(1) as u32;
    (scaled(width), scaled(height))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quick images keep their shape, are never empty and never enlarged.
    #[test]
    fn quick_images_are_small() {
        assert_eq!(within((800, 600), 32), (32, 24));
        assert_eq!(within((4000, 1), 32), (32, 1));
        assert_eq!(within((8, 20), 32), (8, 20));
    }
}
