//! `lightmesh gallery`: renders a list of scenes and writes a page about them.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Deserialize;

use super::gallery_page::{Entry, html, markdown};
use super::progress::Reporter;
use super::render::{RenderArgs, RenderError, run as render};
use crate::accel::BackendChoice;
use crate::image::{ImageError, OutputFile};

/// Render the scenes of a list and write a page about them
///
/// Each picture gets NAME.png and NAME.json (what was counted and measured) in the output folder; page.md and index.html show
/// all pictures of the list that are there.
#[derive(Args, Clone, Debug)]
pub struct GalleryArgs {
    /// The list: a TOML file of `[[picture]]` tables with name, title, scene and caption, and perhaps models that it needs
    #[arg(long, value_name = "FILE", default_value = "scenes/gallery.toml")]
    pub list: PathBuf,
    /// Folder to write into, created if need be
    #[arg(short, long, value_name = "DIR", default_value = "docs/gallery")]
    pub out: PathBuf,
    /// Render only this picture; may be repeated
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Library that traces the rays
    #[arg(long, value_enum, default_value_t)]
    pub backend: BackendChoice,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// The list of pictures.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gallery {
    /// The pictures in the order of the page.
    pub picture: Vec<Picture>,
}

/// One picture of the list.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Picture {
    /// Name of the files.
    pub name: String,
    /// Heading on the page.
    pub title: String,
    /// Scene file, relative to the list.
    pub scene: PathBuf,
    /// What there is to see.
    pub caption: String,
    /// Models that are not part of the project, relative to the list; where one is missing, the picture is not rendered.
    #[serde(default)]
    pub needs: Vec<PathBuf>,
}

impl Picture {
    /// The first of the models that it needs and that is not in the list's folder.
    pub fn missing(&self, folder: &Path) -> Option<PathBuf> {
        self.needs.iter().map(|model| folder.join(model)).find(|model| !model.exists())
    }
}

/// Why there is no gallery.
#[derive(Debug, thiserror::Error)]
pub enum GalleryError {
    /// A file cannot be read.
    #[error("{}: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The list is malformed.
    #[error("{}: {problem}", file.display())]
    List {
        /// The list.
        file: PathBuf,
        /// What is wrong with it, and where.
        problem: String,
    },
    /// `--only` names no picture of the list.
    #[error("{}: no picture is named `{name}`; there are: {names}", file.display())]
    NoSuchPicture {
        /// The list.
        file: PathBuf,
        /// The name.
        name: String,
        /// Those that exist.
        names: String,
    },
    /// The output folder cannot be made.
    #[error("{}: cannot be created: {source}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A scene cannot be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A page cannot be written.
    #[error(transparent)]
    Write(#[from] ImageError),
}

impl Gallery {
    /// Reads a list. Names are such that they can be names of files, and no two are the same.
    ///
    /// # Errors
    /// [`GalleryError::Read`] and [`GalleryError::List`].
    pub fn read(file: &Path) -> Result<Self, GalleryError> {
        let list_error = |problem: String| GalleryError::List { file: file.to_owned(), problem };
        let gallery: Self = toml::from_str(&read(file)?).map_err(|error| list_error(error.to_string()))?;
        for (index, Picture { name, .. }) in gallery.picture.iter().enumerate() {
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            if name.is_empty() || !name.chars().all(plain) {
                let problem =
                    format!("picture[{index}].name: letters, digits, - and _ make a name, found `{name}`");
                return Err(list_error(problem));
            }
            if gallery.picture[..index].iter().any(|other| other.name == *name) {
                return Err(list_error(format!("picture[{index}].name: there are two pictures `{name}`")));
            }
        }
        Ok(gallery)
    }
}

fn read(file: &Path) -> Result<String, GalleryError> {
    fs::read_to_string(file).map_err(|source| GalleryError::Read { file: file.to_owned(), source })
}

/// Renders the pictures and writes the pages.
///
/// # Errors
/// See [`GalleryError`]; the pictures that were rendered before the error stay.
pub fn run(args: &GalleryArgs) -> Result<(), GalleryError> {
    let gallery = Gallery::read(&args.list)?;
    if let Some(name) = args.only.iter().find(|name| gallery.picture.iter().all(|p| p.name != **name)) {
        let names: Vec<&str> = gallery.picture.iter().map(|picture| picture.name.as_str()).collect();
        return Err(GalleryError::NoSuchPicture {
            file: args.list.clone(),
            name: name.clone(),
            names: names.join(", "),
        });
    }
    fs::create_dir_all(&args.out)
        .map_err(|source| GalleryError::Folder { folder: args.out.clone(), source })?;
    let folder = args.list.parent().unwrap_or(Path::new(""));
    let reporter = Reporter::new(args.quiet);

    for picture in &gallery.picture {
        if !args.only.is_empty() && !args.only.contains(&picture.name) {
            continue;
        }
        if let Some(model) = picture.missing(folder) {
            reporter.line(&format!("{}: skipped, there is no {}", picture.name, model.display()));
            continue;
        }
        reporter.line(&format!("{}:", picture.name));
        render(&RenderArgs {
            scene: folder.join(&picture.scene),
            output: vec![args.out.join(format!("{}.png", picture.name))],
            stats: Some(args.out.join(format!("{}.json", picture.name))),
            quiet: args.quiet,
            backend: args.backend,
            ..RenderArgs::default()
        })?;
    }

    let mut entries = Vec::new();
    for picture in gallery.picture {
        let image = args.out.join(format!("{}.png", picture.name));
        let stats = args.out.join(format!("{}.json", picture.name));
        if !(image.exists() && stats.exists()) {
            continue;
        }
        let scene = folder.join(&picture.scene);
        let stats_problem = |error: serde_json::Error| GalleryError::List {
            file: stats.clone(),
            problem: format!("not what was written there: {error}"),
        };
        entries.push(Entry {
            scene_path: scene.to_string_lossy().into_owned(),
            scene_text: read(&scene)?,
            stats: serde_json::from_str(&read(&stats)?).map_err(stats_problem)?,
            png: fs::read(&image).map_err(|source| GalleryError::Read { file: image, source })?,
            picture,
        });
    }
    OutputFile::new(&args.out.join("page.md"))?.write(markdown(&entries).as_bytes())?;
    OutputFile::new(&args.out.join("index.html"))?.write(html(&entries).as_bytes())?;
    Ok(())
}
