//! The stages of a frame, one after the other for each block of tiles: trace → need → evaluate → shade → film (method §9).

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use super::error::RenderError;
use super::film::{TileSink, put_tile, resolve, resolve_block};
use super::layers::{LayerCollector, LayerRecord, LightParts};
use super::paths::TilePaths;
use super::spared::SparedRays;
use super::stats::{RenderStats, ShadeCounters, timed};
use super::tiles::{TILES_PER_TASK, Tile, blocks};
use super::trace::{WIDTH, trace_paths};
use crate::accel::Accel;
use crate::image::Image;
use crate::scene::{Camera, CameraRays};
use crate::settings::{Settings, ViewSettings};
use crate::world::World;

/// What differs between the integrators.
pub trait BlockIntegrator: Sync {
    /// Evaluates what the surface points of a block need.
    fn evaluate(&mut self, paths: &[TilePaths], stats: &mut RenderStats);

    /// Shades the vertices of a tile: fills `light`, which is 0, with one E for each, such that k_d·E is the light sent back. Where `parts`
    /// are asked for, that is their direct light alone, and the rest of it goes there.
    fn shade(
        &self,
        tile: &Tile,
        paths: &TilePaths,
        light: &mut [Vec3],
        parts: Option<&mut LightParts>,
    ) -> ShadeCounters;
}

/// Stops a render between two tiles. Clones stop the same renders.
#[derive(Clone, Debug, Default)]
pub struct StopToken {
    stopped: Arc<AtomicBool>,
    /// When a render stops by itself.
    deadline: Option<Instant>,
}

impl StopToken {
    /// Stops the renders that were given this token or a clone of it.
    pub fn stop(&self) {
        self.stopped.store(true, Ordering::Relaxed);
    }

    /// What stops the renders when it is set, for signal handlers.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.stopped.clone()
    }

    /// Whether [`StopToken::stop`] was called, or a deadline has passed.
    pub fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed) || self.is_late()
    }

    /// The same token, which stops by itself at a time as well.
    pub(super) fn with_deadline(&self, deadline: Option<Instant>) -> Self {
        Self { stopped: self.stopped.clone(), deadline }
    }

    /// Whether the deadline has passed.
    pub(super) fn is_late(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// # Errors
    /// [`RenderError::Stopped`].
    pub(super) fn check(&self) -> Result<(), RenderError> {
        if self.is_stopped() { Err(RenderError::Stopped) } else { Ok(()) }
    }
}

/// Samples per block: enough to keep all threads busy and packets full, at 70 bytes of path each if pixels have one, and 12 each, with some 70 per
/// surface point, if they have several: then blocks may be larger, at whose ends threads wait for the last tile.
const BLOCK_SAMPLES: u64 = 1 << 18;
const BLOCK_MERGED_SAMPLES: u64 = 1 << 20;

/// Camera paths are kept until they are shaded up to this many samples per image, from half a gigabyte where pixels have many samples to two where
/// they have one; beyond, they are traced a second time, and counted twice.
const KEPT_SAMPLES: u64 = 1 << 25;

/// What a view is rendered for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Its image.
    Image,
    /// The light meshes that its image needs: where no image has to be judged, none is made.
    Meshes,
}

/// What is rendered: a view of a world, and who receives it.
pub struct Frame<'a, A> {
    /// The world.
    pub world: World<'a, A>,
    /// Its view.
    pub view: &'a ViewSettings,
    camera: CameraRays,
    /// What of its camera rays can be spared.
    spared: &'a OnceLock<Option<SparedRays>>,
    blocks: Vec<Vec<Tile>>,
    sink: &'a dyn TileSink,
    stop: &'a StopToken,
    purpose: Purpose,
    /// Who collects layers, if anyone does.
    layers: Option<&'a LayerCollector>,
    /// Camera paths that were traced already, by block.
    kept: Vec<Vec<TilePaths>>,
}

impl<'a, A: Accel> Frame<'a, A> {
    /// Cuts the view up.
    pub fn new(
        world: World<'a, A>,
        camera: &Camera,
        view: &'a ViewSettings,
        sink: &'a dyn TileSink,
        stop: &'a StopToken,
        purpose: Purpose,
        spared: &'a OnceLock<Option<SparedRays>>,
    ) -> Self {
        let camera = CameraRays::new(camera, view.resolution, 1).with_samples(view.samples());
        let samples = u64::from(view.samples_per_pixel);
        let most = if samples == 1 { BLOCK_SAMPLES } else { BLOCK_MERGED_SAMPLES };
        let block_pixels = view.block_samples.unwrap_or(most) / samples;
        let blocks = blocks(view.resolution, block_pixels);
        Self { world, view, camera, spared, blocks, sink, stop, purpose, layers: None, kept: Vec::new() }
    }

    /// Tells the sink that a picture begins, by settings that leave nothing open.
    pub(super) fn begin(&self, settings: &Settings) {
        self.sink.begin(settings);
    }

    /// The same, with layers for a collector beside the picture.
    pub fn with_layers(self, layers: Option<&'a LayerCollector>) -> Self {
        Self { layers, ..self }
    }

    /// Traces the camera paths of a block; what `paths` held before is gone, but its memory is used again.
    pub(super) fn trace(
        &self,
        block: &[Tile],
        paths: &mut Vec<TilePaths>,
        stats: &mut RenderStats,
    ) -> Result<(), RenderError> {
        self.stop.check()?;
        paths.resize_with(block.len(), || TilePaths::new(self.layers.is_some()));
        timed(&mut stats.seconds.paths, || {
            let tiles = block.par_iter().zip(&mut *paths).with_max_len(TILES_PER_TASK);
            let spared = self.spared.get_or_init(|| self.spared()).as_ref();
            tiles.for_each(|(tile, paths)| {
                trace_paths(self.world, &self.camera, self.view, spared, tile, paths);
            });
        });
        for tile in &*paths {
            stats.rays.camera += tile.camera_rays;
            stats.rays.reflection += tile.reflection_rays;
        }
        Ok(())
    }

    /// What of the view's camera rays can be spared, if pixels have so many that it pays to look.
    fn spared(&self) -> Option<SparedRays> {
        let samples = self.view.samples_per_pixel;
        let pattern = self.view.samples();
        let pattern = pattern.get(..samples as usize)?;
        let is_dense = samples.is_multiple_of(WIDTH as u32);
        is_dense.then(|| SparedRays::of_view(self.world.scene, &self.camera, self.view.resolution, pattern))
    }

    /// Calls `each` with the camera paths of every block before any of them is shaded, for what has to be known of the whole
    /// image at once.
    ///
    /// # Errors
    /// [`RenderError::Stopped`].
    pub fn trace_image(
        &mut self,
        stats: &mut RenderStats,
        mut each: impl FnMut(&[TilePaths], &mut RenderStats),
    ) -> Result<(), RenderError> {
        let (width, height) = self.view.resolution;
        let samples = u64::from(width) * u64::from(height) * u64::from(self.view.samples_per_pixel);
        let keep = samples <= KEPT_SAMPLES;
        let mut paths = Vec::new();
        for (index, block) in self.blocks.iter().enumerate() {
            if let Some(traced) = self.kept.get(index) {
                each(traced, stats);
                continue;
            }
            self.trace(block, &mut paths, stats)?;
            each(&paths, stats);
            if keep {
                self.kept.push(std::mem::take(&mut paths));
            }
        }
        Ok(())
    }

    /// Renders block by block.
    ///
    /// # Errors
    /// [`RenderError::Stopped`].
    pub fn run(
        mut self,
        integrator: &mut impl BlockIntegrator,
        stats: &mut RenderStats,
    ) -> Result<Image, RenderError> {
        let (width, height) = self.view.resolution;
        let mut image = Image::new(width, height)?;
        self.leave_out(&mut image);
        let kept = std::mem::take(&mut self.kept);
        let record = self.layers.map(|layers| layers.begin(self.world.scene, self.world.lights));
        let finished = self.run_blocks(integrator, kept, record.as_ref(), &mut image, stats);
        finished.inspect_err(|_| self.sink.interrupted(&image))?;
        if let Some((layers, record)) = self.layers.zip(record) {
            layers.end(&image, record);
        }
        Ok(image)
    }

    fn run_blocks(
        &self,
        integrator: &mut impl BlockIntegrator,
        kept: Vec<Vec<TilePaths>>,
        record: Option<&LayerRecord>,
        image: &mut Image,
        stats: &mut RenderStats,
    ) -> Result<(), RenderError> {
        let mut kept = kept.into_iter();
        // Kept from block to block: the first use of memory costs a sixth of the camera paths.
        let mut paths: Vec<TilePaths> = Vec::new();
        for block in &self.blocks {
            match kept.next() {
                Some(traced) => paths = traced,
                None => self.trace(block, &mut paths, stats)?,
            }
            integrator.evaluate(&paths, stats);
            if self.purpose == Purpose::Meshes {
                self.stop.check()?;
                continue;
            }
            let mut shade = stats.seconds.shade;
            let counters = timed(&mut shade, || {
                let counters = self.shade(integrator, block, &mut paths, record);
                resolve_block(block, &paths, self.summed_samples(), image);
                counters
            });
            stats.seconds.shade = shade;
            counters.into_iter().for_each(|counters| stats.add_shading(counters));
            self.stop.check()?;
        }
        Ok(())
    }

    /// Leaves out the tiles that nobody asked for, and those whose pixels are known, which are put into the image.
    fn leave_out(&mut self, image: &mut Image) {
        let Self { view, sink, layers, .. } = *self;
        let mut is_left = |tile: &Tile| {
            if view.crop.is_some_and(|crop| !crop.meets(&tile.window())) {
                return false;
            }
            // Of their layers nothing is known.
            let known = if layers.is_some() { None } else { sink.known(tile) };
            let known = known.filter(|pixels| pixels.len() == tile.pixels());
            known.iter().for_each(|pixels| {
                put_tile(tile, pixels, image);
                sink.tile(tile, pixels);
            });
            known.is_none()
        };
        let mut kept = std::mem::take(&mut self.kept).into_iter();
        for block in std::mem::take(&mut self.blocks) {
            let is_left: Vec<bool> = block.iter().map(&mut is_left).collect();
            if let Some(mut paths) = kept.next() {
                let mut stays = is_left.iter();
                paths.retain(|_| stays.next() == Some(&true));
                self.kept.push(paths);
            }
            let left = block.into_iter().zip(is_left).filter(|(_, is_left)| *is_left);
            self.blocks.push(left.map(|(tile, _)| tile).collect());
        }
    }

    /// Samples that the radiance of shaded pixels is the sum of: with layers it is their mean.
    fn summed_samples(&self) -> u32 {
        if self.layers.is_some() { 1 } else { self.view.samples_per_pixel }
    }

    /// Shades a block; tiles that are left when the render is stopped stay as they are.
    fn shade(
        &self,
        integrator: &impl BlockIntegrator,
        block: &[Tile],
        paths: &mut [TilePaths],
        record: Option<&LayerRecord>,
    ) -> Vec<ShadeCounters> {
        let shade = |(tile, paths): (&Tile, &mut TilePaths)| {
            if self.stop.is_stopped() {
                return ShadeCounters::default();
            }
            let counters = match record {
                Some(record) => self.shade_layers(integrator, tile, paths, record),
                None => shade_tile(integrator, tile, paths),
            };
            self.sink.tile(tile, &resolve(&paths.radiance, self.summed_samples()));
            counters
        };
        block.par_iter().zip(paths).with_max_len(TILES_PER_TASK).map(shade).collect()
    }

    /// [`shade_tile`] with layers.
    fn shade_layers(
        &self,
        integrator: &impl BlockIntegrator,
        tile: &Tile,
        paths: &mut TilePaths,
        record: &LayerRecord,
    ) -> ShadeCounters {
        let mut light = vec![Vec3::ZERO; paths.vertices.len()];
        let mut parts = record.parts(paths.vertices.len());
        let counters = integrator.shade(tile, paths, &mut light, Some(&mut parts));
        record.add(tile, paths, &light, &parts, self.view.samples_per_pixel);
        counters
    }
}

/// Adds the light that the vertices of a tile send towards the camera: eqs. (6) and (8), the sum over each path of
/// weight · (Emiss + k_d · I), whose first part is there already.
pub fn shade_tile(integrator: &impl BlockIntegrator, tile: &Tile, paths: &mut TilePaths) -> ShadeCounters {
    let mut light = vec![Vec3::ZERO; paths.vertices.len()];
    let counters = integrator.shade(tile, paths, &mut light, None);
    for (vertex, light) in paths.vertices.iter().zip(light) {
        paths.radiance[vertex.pixel as usize] += vertex.reflectance * light;
    }
    counters
}
