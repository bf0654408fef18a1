//! `lightmesh gallery`: renders a list of scenes and writes a page about them.

mod list;
mod page;

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use self::list::read;
use self::page::{Entry, Picture, html, markdown};
use super::error::{CommandError, Outcome};
use super::overrides::Overrides;
use super::render::run as render;
use super::render_args::RenderArgs;
use super::shared::{BackendArgs, QuietArgs, SceneArgs};
use crate::image::OutputFile;

pub use self::list::{Gallery, ListedImage};

/// What `gallery` takes.
///
/// Each image gets NAME.png and NAME.json (what was counted and measured) in the output folder, and NAME-conventional.png and .json where the list asks
/// for the conventional tracer's beside it; page.md and index.html show all images of the list that are there.
#[derive(Args, Clone, Debug)]
pub struct GalleryArgs {
    /// The list: a TOML file of `[[picture]]` tables with name, title, scene and caption, perhaps models that it needs, and whether it is rendered conventionally too
    #[arg(long, value_name = "FILE", default_value = "scenes/gallery.toml")]
    list: PathBuf,
    /// Folder to write into, created if need be
    #[arg(short, long, value_name = "DIR", default_value = "docs/gallery")]
    out: PathBuf,
    /// Render only this image; may be repeated
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    #[command(flatten)]
    backend: BackendArgs,
    #[command(flatten)]
    quiet: QuietArgs,
}

impl GalleryArgs {
    /// The file of an image with this extension.
    fn file(&self, name: &str, extension: &str) -> PathBuf {
        self.out.join(format!("{name}.{extension}"))
    }

    /// What a file of an image is rendered with.
    fn render_args(&self, image: &ListedImage, name: &str, conventional: bool, folder: &Path) -> RenderArgs {
        RenderArgs {
            scene: SceneArgs { path: folder.join(&image.scene) },
            output: vec![self.file(name, "png")],
            stats: Some(self.file(name, "json")),
            quiet: self.quiet,
            backend: self.backend,
            overrides: if conventional { Overrides::conventional() } else { Overrides::default() },
            ..RenderArgs::default()
        }
    }

    /// What the page shows of an image; `None` where the image isn't there.
    fn entry(&self, image: ListedImage, folder: &Path) -> Result<Option<Entry>, CommandError> {
        let mut pictures = Vec::new();
        for (name, _) in image.files() {
            let (png, stats) = (self.file(&name, "png"), self.file(&name, "json"));
            if !(png.exists() && stats.exists()) {
                continue;
            }
            let malformed = |error: serde_json::Error| CommandError::Malformed {
                file: stats.clone(),
                problem: format!("not what was written there: {error}"),
            };
            pictures.push(Picture { name, stats: serde_json::from_str(&read(&stats)?).map_err(malformed)? });
        }
        let mut pictures = pictures.into_iter();
        let Some(picture) = pictures.next().filter(|picture| picture.name == image.name) else {
            return Ok(None);
        };
        let scene = folder.join(&image.scene);
        Ok(Some(Entry {
            scene_path: scene.to_string_lossy().into_owned(),
            scene_text: read(&scene)?,
            picture,
            beside: pictures.next(),
            image,
        }))
    }
}

/// Renders the images and writes the pages.
///
/// # Errors
/// See [`CommandError`]; the images that were rendered before the error stay.
pub fn run(args: &GalleryArgs) -> Result<Outcome, CommandError> {
    let gallery = Gallery::read(&args.list)?;
    if let Some(name) = args.only.iter().find(|name| gallery.images.iter().all(|image| image.name != **name))
    {
        let names: Vec<&str> = gallery.images.iter().map(|image| image.name.as_str()).collect();
        return Err(CommandError::NoSuchImage {
            file: args.list.clone(),
            name: name.clone(),
            names: names.join(", "),
        });
    }
    fs::create_dir_all(&args.out)
        .map_err(|source| CommandError::Folder { folder: args.out.clone(), source })?;
    let folder = args.list.parent().unwrap_or(Path::new(""));
    let reporter = args.quiet.reporter();

    for image in &gallery.images {
        if !args.only.is_empty() && !args.only.contains(&image.name) {
            continue;
        }
        if let Some(model) = image.missing(folder) {
            reporter.line(&format!("{}: skipped, there is no {}", image.name, model.display()));
            continue;
        }
        reporter.line(&format!("{}:", image.name));
        for (name, conventional) in image.files() {
            render(&args.render_args(image, &name, conventional, folder))?;
        }
    }

    let mut entries = Vec::new();
    for image in gallery.images {
        entries.extend(args.entry(image, folder)?);
    }
    OutputFile::new(&args.out.join("page.md"))?.write(markdown(&entries).as_bytes())?;
    OutputFile::new(&args.out.join("index.html"))?.write(html(&entries).as_bytes())?;
    Ok(Outcome::Passed)
}
