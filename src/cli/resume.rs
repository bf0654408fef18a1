//! Tiles of renders that were interrupted: kept in a file beside the image, and taken by the next render of the same.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::image::{ImageError, OutputFile};
use crate::light_mesh::file::{MeshFile, MeshFileError, SectionsWriter};
use crate::render::{Tile, TileSink};
use crate::scene::Fingerprint;
use crate::settings::Settings;

/// Names of the sections of the file.
const RENDER: &str = "render";
const TILES: &str = "tiles";

/// A tile of a picture that settings made which leave nothing open: where it lies, and its pixels.
#[derive(Serialize, Deserialize)]
struct SavedTile {
    picture: Fingerprint,
    x: u32,
    y: u32,
    pixels: Vec<[f32; 3]>,
}

type Place = (Fingerprint, u32, u32);

/// The tiles of a render, whatever picture they are of.
pub struct ResumableTiles {
    /// What is rendered: scene, camera, settings.
    render: Fingerprint,
    known: HashMap<Place, Vec<[f32; 3]>>,
    done: Mutex<Done>,
}

#[derive(Default)]
struct Done {
    /// The picture that is made.
    picture: Option<Fingerprint>,
    tiles: HashMap<Place, Vec<[f32; 3]>>,
}

/// What came of a file of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resumed {
    /// There is none.
    Nothing,
    /// It belongs to another render.
    Other,
    /// So many tiles are known.
    Tiles(usize),
}

impl ResumableTiles {
    /// With no tile known.
    pub fn new(render: Fingerprint) -> Self {
        Self { render, known: HashMap::new(), done: Mutex::default() }
    }

    /// Where the tiles of an image are kept.
    pub fn path(image: &Path) -> PathBuf {
        let name = image.file_name().unwrap_or_default().to_string_lossy();
        image.with_file_name(format!("{name}.partial"))
    }

    /// Takes the tiles of a file, if they are of this render.
    ///
    /// # Errors
    /// See [`MeshFileError`].
    pub fn read(&mut self, path: &Path) -> Result<Resumed, MeshFileError> {
        let file = match MeshFile::open(path) {
            Err(MeshFileError::Read(error)) if error.kind() == io::ErrorKind::NotFound => {
                return Ok(Resumed::Nothing);
            }
            file => file?,
        };
        if file.value::<Fingerprint>(RENDER)? != self.render {
            return Ok(Resumed::Other);
        }
        let tiles: Vec<SavedTile> = file.value(TILES)?;
        self.known = tiles.into_iter().map(|tile| ((tile.picture, tile.x, tile.y), tile.pixels)).collect();
        Ok(Resumed::Tiles(self.known.len()))
    }

    /// Writes the tiles that are done, and those that were known before; returns their number.
    ///
    /// # Errors
    /// If the file can't be written; then it is as it was.
    pub fn write(&self, path: &Path) -> Result<usize, ImageError> {
        let done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        let all = self.known.iter().filter(|(place, _)| !done.tiles.contains_key(place)).chain(&done.tiles);
        let saved = |(&(picture, x, y), pixels): (&Place, &Vec<[f32; 3]>)| SavedTile {
            picture,
            x,
            y,
            pixels: pixels.clone(),
        };
        let tiles: Vec<SavedTile> = all.map(saved).collect();
        let mut writer = SectionsWriter::default();
        let refuse =
            |error: MeshFileError| ImageError::Write { path: path.to_path_buf(), cause: error.to_string() };
        writer.value(RENDER, &self.render).map_err(refuse)?;
        writer.value(TILES, &tiles).map_err(refuse)?;
        OutputFile::new(path)?.write(&writer.finish())?;
        Ok(tiles.len())
    }
}

impl TileSink for ResumableTiles {
    fn begin(&self, settings: &Settings) {
        let mut settings = settings.clone();
        // Whichever part is rendered, and however it is cut up, the pixels are the same.
        (settings.view.crop, settings.view.block_samples) = (None, None);
        let picture = Some(Fingerprint::of(&settings));
        self.done.lock().unwrap_or_else(PoisonError::into_inner).picture = picture;
    }

    fn tile(&self, tile: &Tile, pixels: &[[f32; 3]]) {
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(picture) = done.picture {
            done.tiles.insert((picture, tile.x, tile.y), pixels.to_vec());
        }
    }

    fn known(&self, tile: &Tile) -> Option<Vec<[f32; 3]>> {
        let picture = self.done.lock().unwrap_or_else(PoisonError::into_inner).picture?;
        self.known.get(&(picture, tile.x, tile.y)).cloned()
    }
}
