//! Tiles of renders that were interrupted: kept in a file beside the image, and taken by the next render of the same.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use crate::image::{Image, ImageError, OutputFile};
use crate::light_mesh::file::{MeshFile, MeshFileError, SectionsWriter};
use crate::render::{Tile, TileSink};
use crate::scene::Fingerprint;
use crate::settings::Settings;

/// Names of the sections of the file.
const RENDER: &str = "render";
const TILES: &str = "tiles";

/// A tile: where it lies, and its pixels.
#[derive(Clone, Serialize, Deserialize)]
struct SavedTile {
    place: (u32, u32),
    pixels: Vec<[f32; 3]>,
}

/// The tiles of the picture that a render was interrupted at. A render makes several, if the first one is not good enough.
pub struct ResumableTiles {
    /// What is rendered: scene, camera, settings.
    render: Fingerprint,
    known: Known,
    done: Mutex<Done>,
}

/// Tiles of a picture that settings made which leave nothing open.
#[derive(Default)]
struct Known {
    picture: Option<Fingerprint>,
    tiles: HashMap<(u32, u32), Vec<[f32; 3]>>,
}

#[derive(Default)]
struct Done {
    /// The picture that is made.
    picture: Option<Fingerprint>,
    /// Those that are finished, without their pixels: to copy these would cost a tenth of shading.
    finished: Vec<Tile>,
    /// With their pixels, once the render is stopped.
    tiles: Vec<SavedTile>,
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
        Self { render, known: Known::default(), done: Mutex::default() }
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
        let (picture, tiles): (Option<Fingerprint>, Vec<SavedTile>) = file.value(TILES)?;
        let tiles = tiles.into_iter().map(|tile| (tile.place, tile.pixels)).collect();
        self.known = Known { picture, tiles };
        Ok(Resumed::Tiles(self.known.tiles.len()))
    }

    /// Writes the tiles that are done, or those that were known if there are none yet; returns their number.
    ///
    /// # Errors
    /// If the file can't be written; then it is as it was.
    pub fn write(&self, path: &Path) -> Result<usize, ImageError> {
        let done = self.done();
        let (picture, tiles) = if done.tiles.is_empty() {
            let known = self.known.tiles.iter();
            let tiles = known.map(|(&place, pixels)| SavedTile { place, pixels: pixels.clone() });
            (self.known.picture, tiles.collect())
        } else {
            (done.picture, done.tiles.clone())
        };
        let mut writer = SectionsWriter::default();
        let refuse =
            |error: MeshFileError| ImageError::Write { path: path.to_path_buf(), cause: error.to_string() };
        writer.value(RENDER, &self.render).map_err(refuse)?;
        writer.value(TILES, &(picture, &tiles)).map_err(refuse)?;
        OutputFile::new(path)?.write(&writer.finish())?;
        Ok(tiles.len())
    }

    fn done(&self) -> MutexGuard<'_, Done> {
        self.done.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl TileSink for ResumableTiles {
    fn begin(&self, settings: &Settings) {
        let mut settings = settings.clone();
        // Whichever part is rendered, and however it is cut up, the pixels are the same.
        (settings.view.crop, settings.view.block_samples) = (None, None);
        *self.done() = Done { picture: Some(Fingerprint::of(&settings)), ..Done::default() };
    }

    fn tile(&self, tile: &Tile, _: &[[f32; 3]]) {
        self.done().finished.push(*tile);
    }

    fn known(&self, tile: &Tile) -> Option<Vec<[f32; 3]>> {
        let is_known = self.known.picture.is_some() && self.done().picture == self.known.picture;
        self.known.tiles.get(&(tile.x, tile.y)).filter(|_| is_known).cloned()
    }

    fn interrupted(&self, image: &Image) {
        let mut done = self.done();
        let pixels = |tile: &Tile| image.crop(tile.window()).map(|crop| crop.pixels().to_vec());
        let saved = |tile: &Tile| Some(SavedTile { place: (tile.x, tile.y), pixels: pixels(tile)? });
        done.tiles = done.finished.iter().filter_map(saved).collect();
    }
}
