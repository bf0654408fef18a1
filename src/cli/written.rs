//! What an image says of how it was made, by which it is known again.

use std::path::Path;

use super::render_args::RenderArgs;
use crate::accel::Backend;
use crate::image::metadata;
use crate::render::{RenderStats, Session};
use crate::scene::{Camera, Fingerprint, SceneFingerprint};
use crate::settings::{OutputSettings, Settings};

/// Names of attributes.
const RENDER: &str = "lightmesh:render";
const PART: &str = "lightmesh:part";
const FORM: &str = "lightmesh:form";

/// How an image is made.
#[derive(Clone, Debug)]
pub struct Written {
    backend: String,
    /// Name of the scene's file.
    scene_name: String,
    scene: SceneFingerprint,
    settings: String,
    /// Of scene, camera, settings and backend: equal ones give equal pixels.
    pub render: Fingerprint,
    /// Which part of it is rendered.
    part: String,
    /// Its layers, and how precise they are.
    form: String,
}

impl Written {
    /// By a session, of a view.
    pub fn of(args: &RenderArgs, session: &Session, camera: &Camera, settings: &Settings) -> Self {
        let backend: &Backend = session.backend();
        let scene = SceneFingerprint::of(session.scene());
        // The same for all parts of an image, and however it is written.
        let mut of_whole = settings.clone();
        (of_whole.view.crop, of_whole.view.block_samples) = (None, None);
        of_whole.output = OutputSettings::default();
        let render = Fingerprint::of(&(scene, camera, &of_whole, backend.name()));
        let part = match settings.view.crop {
            None => "whole".to_owned(),
            Some(window) => {
                let (right, bottom) = window.end();
                format!("{},{},{right},{bottom}", window.x, window.y)
            }
        };
        // The name alone: where the scene lies is a matter of the machine.
        let scene_name = args.scene.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Self {
            backend: backend.to_string(),
            scene_name,
            scene,
            settings: format!("{of_whole:?}"),
            render,
            part,
            form: format!("{}{}", if args.float { "float" } else { "half" }, args.layers),
        }
    }

    /// What is stored in the image: nothing that differs from run to run, nor with what was known before.
    pub fn metadata(&self, exposure: f32, stats: &RenderStats) -> Vec<(String, String)> {
        let entry = |key: &str, value: String| (key.to_owned(), value);
        let mut entries = vec![
            entry("Software", format!("lightmesh {}", env!("CARGO_PKG_VERSION"))),
            entry("lightmesh:backend", self.backend.clone()),
            entry("lightmesh:scene", self.scene_name.clone()),
            entry("lightmesh:scene_hash", self.scene.to_string()),
            entry("lightmesh:settings", self.settings.clone()),
            entry(RENDER, self.render.to_string()),
            entry(PART, self.part.clone()),
            entry(FORM, self.form.clone()),
            entry("lightmesh:exposure", exposure.to_string()),
        ];
        if let Some(found) = stats.accuracy.and_then(|accuracy| accuracy.found) {
            entries.push(entry("lightmesh:error", found.error.to_string()));
        }
        entries
    }
}

/// Whether a file is an image that was made that way. Images appear whole or not at all.
pub fn is_written(path: &Path, written: &Written) -> bool {
    let found = metadata(path);
    let has = |key: &str, value: &str| found.iter().any(|(name, own)| name == key && own == value);
    has(RENDER, &written.render.to_string()) && has(PART, &written.part) && has(FORM, &written.form)
}
