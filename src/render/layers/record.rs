//! What is recorded of a picture while its tiles are shaded.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use glam::Vec3;

use super::cryptomatte::{IdKind, Names, RANKS, ranked};
use super::first_hits::{FirstHits, IdSamples};
use super::layer_image::{LayerChannel, LayerImage};
use super::parts::LightParts;
use super::{Layer, LayerChoice};
use crate::image::exr::DataWindow;
use crate::lights::{PackedGroups, PackedLights};
use crate::render::paths::TilePaths;
use crate::render::tiles::Tile;
use crate::scene::Scene;

/// The layers of a picture, as far as its tiles are shaded.
pub(in crate::render) struct LayerRecord<'a> {
    choice: &'a LayerChoice,
    groups: Option<PackedGroups>,
    ids: Vec<Names>,
    tiles: Mutex<Vec<TileLayers>>,
}

/// A tile in all layers.
struct TileLayers {
    tile: Tile,
    /// Values of the pixels, channel by channel in the order of [`LayerRecord::channels`].
    channels: Vec<Vec<f32>>,
    /// The things that it shows, by [`LayerRecord::ids`].
    shown: Vec<BTreeSet<u32>>,
}

/// Light of a pixel, the mean over its samples.
struct PixelLight {
    direct: Vec3,
    indirect: Vec3,
    emission: Vec3,
    reflection: Vec3,
    /// Estimated error of direct light.
    error: Vec3,
}

impl<'a> LayerRecord<'a> {
    pub(super) fn new(choice: &'a LayerChoice, scene: &Scene, lights: &PackedLights) -> Self {
        let kinds = [(Layer::Object, IdKind::Object), (Layer::Material, IdKind::Material)];
        let kinds = kinds.into_iter().filter(|(layer, _)| choice.has(*layer));
        Self {
            choice,
            groups: choice.light_groups.then(|| PackedGroups::new(&scene.light_groups, lights)),
            ids: kinds.map(|(_, kind)| Names::new(kind, scene)).collect(),
            tiles: Mutex::default(),
        }
    }

    /// The parts that an integrator has to tell apart in the light of so many vertices.
    pub fn parts(&self, vertices: usize) -> LightParts<'_> {
        let (count_points, estimate_error) =
            (self.choice.has(Layer::MeshPoints), self.choice.has(Layer::Error));
        LightParts::new(vertices, self.groups.as_ref(), count_points, estimate_error)
    }

    /// Takes up a tile whose vertices are shaded: `light` is their direct light. Replaces the radiance of its pixels, summed over their
    /// samples, by what the picture shows: the sum of the layers.
    pub fn add(&self, tile: &Tile, paths: &mut TilePaths, light: &[Vec3], parts: &LightParts, samples: u32) {
        let TilePaths { vertices, radiance, first, .. } = paths;
        let Some(first) = first else { return };
        let (count, scale) = (tile.pixels(), 1.0 / samples as f32);
        let mut pixels: Vec<PixelLight> = (first.emission.iter().zip(&first.reflected))
            .map(|(&emission, &reflection)| PixelLight {
                direct: Vec3::ZERO,
                indirect: Vec3::ZERO,
                emission,
                reflection,
                error: Vec3::ZERO,
            })
            .collect();
        let group_count = parts.groups.as_ref().map_or(0, |groups| groups.count());
        let mut groups = vec![vec![Vec3::ZERO; count]; group_count];
        let mut mesh_points = vec![0; count];
        for (number, (vertex, &light)) in vertices.iter().zip(light).enumerate() {
            let pixel = &mut pixels[vertex.pixel as usize];
            let indirect = vertex.reflectance * parts.indirect[number];
            if let Some(error) = parts.error.as_ref().and_then(|error| error.get(number)) {
                pixel.error += vertex.reflectance * *error;
            }
            if number >= first.vertices {
                pixel.reflection += vertex.reflectance * light + indirect;
                continue;
            }
            pixel.direct += vertex.reflectance * light;
            pixel.indirect += indirect;
            if let Some(parts) = &parts.groups {
                let mut add = |group: usize, light: Vec3| {
                    groups[group][vertex.pixel as usize] += vertex.reflectance * light;
                };
                parts.share(number, light, &mut add);
            }
            if let Some(points) = parts.mesh_points.as_ref().and_then(|points| points.get(number)) {
                let most = &mut mesh_points[vertex.pixel as usize];
                *most = (*most).max(*points);
            }
        }
        for (number, pixel) in pixels.iter_mut().enumerate() {
            let PixelLight { direct, indirect, emission, reflection, error } = pixel;
            for part in [direct, indirect, emission, reflection, error] {
                *part *= scale;
            }
            if group_count > 0 {
                pixel.direct = round_together(&mut groups, number, scale);
            }
        }
        for (radiance, pixel) in radiance.iter_mut().zip(&pixels) {
            *radiance = pixel.sum();
        }
        let channels = self.channels_of(&pixels, &groups, first, &mesh_points);
        let shown = self.ids.iter().map(|names| shown(names, &first.ids)).collect();
        let finished = TileLayers { tile: *tile, channels, shown };
        self.tiles.lock().unwrap_or_else(PoisonError::into_inner).push(finished);
    }

    /// Names of all channels, and whether they need full precision.
    fn channels(&self) -> Vec<(String, bool)> {
        let mut channels = Vec::new();
        let mut add = |layer: &str, names: &[&str], needs_float: bool| {
            channels.extend(names.iter().map(|name| (format!("{layer}.{name}"), needs_float)));
        };
        let (colours, axes) = (["R", "G", "B"], ["X", "Y", "Z"]);
        for &layer in &self.choice.layers {
            match layer {
                Layer::Direct | Layer::Indirect | Layer::Emission | Layer::Reflection => {
                    add(&layer.to_string(), &colours, false);
                }
                Layer::Albedo => add("Albedo", &colours, false),
                Layer::Normal => add("N", &axes, false),
                Layer::Position => add("P", &axes, true),
                Layer::Depth | Layer::MeshPoints | Layer::Error | Layer::Object | Layer::Material => {}
            }
        }
        for group in self.groups.iter().flat_map(PackedGroups::names) {
            add(&format!("light_{group}"), &colours, false);
        }
        for names in &self.ids {
            channels.extend(names.kind().channels().map(|name| (name, true)));
        }
        if self.choice.has(Layer::Depth) {
            channels.push(("Z".to_owned(), true));
        }
        if self.choice.has(Layer::MeshPoints) {
            channels.push(("mesh_points".to_owned(), true));
        }
        if self.choice.has(Layer::Error) {
            channels.push(("error".to_owned(), true));
        }
        channels
    }

    /// The values of a tile's pixels, in the order of [`Self::channels`].
    fn channels_of(
        &self,
        pixels: &[PixelLight],
        groups: &[Vec<Vec3>],
        first: &FirstHits,
        mesh_points: &[u32],
    ) -> Vec<Vec<f32>> {
        let mut channels: Vec<Vec<f32>> = Vec::new();
        let mut add = |values: &mut dyn Iterator<Item = Vec3>| {
            let values: Vec<Vec3> = values.collect();
            channels.extend((0..3).map(|axis| values.iter().map(|value| value[axis]).collect()));
        };
        let hits = &first.pixels;
        let mean = |sum: Vec3, samples: u32| sum / samples.max(1) as f32;
        for &layer in &self.choice.layers {
            match layer {
                Layer::Direct => add(&mut pixels.iter().map(|pixel| pixel.direct)),
                Layer::Indirect => add(&mut pixels.iter().map(|pixel| pixel.indirect)),
                Layer::Emission => add(&mut pixels.iter().map(|pixel| pixel.emission)),
                Layer::Reflection => add(&mut pixels.iter().map(|pixel| pixel.reflection)),
                Layer::Albedo => add(&mut hits.iter().map(|hit| mean(hit.albedo, hit.samples))),
                Layer::Normal => add(&mut hits.iter().map(|hit| mean(hit.normal, hit.samples))),
                Layer::Position => add(&mut hits.iter().map(|hit| hit.position)),
                Layer::Depth | Layer::MeshPoints | Layer::Error | Layer::Object | Layer::Material => {}
            }
        }
        for group in groups {
            add(&mut group.iter().copied());
        }
        for names in &self.ids {
            channels.extend(ids_of(names, first));
        }
        if self.choice.has(Layer::Depth) {
            channels.push(hits.iter().map(|hit| hit.depth).collect());
        }
        if self.choice.has(Layer::MeshPoints) {
            channels.push(mesh_points.iter().map(|&count| count as f32).collect());
        }
        if self.choice.has(Layer::Error) {
            channels.push(pixels.iter().map(|pixel| pixel.error.abs().element_sum() / 3.0).collect());
        }
        channels
    }

    /// All tiles together.
    pub(super) fn finish(self) -> LayerImage {
        let channels = self.channels();
        let tiles = self.tiles.into_inner().unwrap_or_else(PoisonError::into_inner);
        let range = |start: fn(&Tile) -> u32, length: fn(&Tile) -> u32| {
            let first = tiles.iter().map(|part| start(&part.tile)).min().unwrap_or(0);
            let end = tiles.iter().map(|part| start(&part.tile) + length(&part.tile)).max().unwrap_or(0);
            (first, end - first)
        };
        let (left, width) = range(|tile| tile.x, |tile| tile.width);
        let (top, height) = range(|tile| tile.y, |tile| tile.height);
        let row = width as usize;
        let mut values = vec![vec![0.0; row * height as usize]; channels.len()];
        for TileLayers { tile, channels, .. } in &tiles {
            let start = (tile.y - top) as usize * row + (tile.x - left) as usize;
            for (values, part) in values.iter_mut().zip(channels) {
                let lines = values[start..].chunks_mut(row).zip(part.chunks(tile.width as usize));
                lines.for_each(|(line, part)| line[..part.len()].copy_from_slice(part));
            }
        }
        let attributes = self.ids.iter().enumerate().flat_map(|(number, names)| {
            let shown = tiles.iter().filter_map(|part| part.shown.get(number)).flatten().copied().collect();
            names.attributes(&shown)
        });
        let attributes = attributes.collect();
        let named = channels.into_iter().zip(values);
        LayerImage {
            window: DataWindow { x: left as i32, y: top as i32, width, height },
            channels: named
                .map(|((name, needs_float), values)| LayerChannel { name, needs_float, values })
                .collect(),
            attributes,
        }
    }
}

impl PixelLight {
    /// What the picture shows: the sum in double precision, in this order, so that only its rounding lies between it and the layers.
    fn sum(&self) -> Vec3 {
        let Self { direct, indirect, emission, reflection, error: _ } = self;
        let sum = direct.as_dvec3() + indirect.as_dvec3() + emission.as_dvec3() + reflection.as_dvec3();
        sum.as_vec3()
    }
}

/// Scales a pixel's light of all groups, and rounds it so that its sum is a float: that is returned.
///
/// All are rounded to multiples of twice the last place of the sum, which is a power of two: then no bit of it lies below.
fn round_together(groups: &mut [Vec<Vec3>], pixel: usize, scale: f32) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for axis in 0..3 {
        let values = groups.iter_mut().map(|group| &mut group[pixel][axis]);
        let total = values.fold(0.0f64, |total, value| {
            *value *= scale;
            total + f64::from(*value)
        }) as f32;
        let step = 2.0 * (total.next_up() - total);
        for group in &mut *groups {
            let value = &mut group[pixel][axis];
            if step.is_finite() && step > 0.0 {
                *value = (*value / step).round_ties_even() * step;
            }
            sum[axis] += *value;
        }
    }
    sum
}

/// The things that samples hit.
fn shown(names: &Names, ids: &[IdSamples]) -> BTreeSet<u32> {
    ids.iter().map(|id| number_of(names, id)).collect()
}

/// What a sample hit, of the things that have these names.
fn number_of(names: &Names, id: &IdSamples) -> u32 {
    match names.kind() {
        IdKind::Object => id.instance,
        IdKind::Material => id.material,
    }
}

/// Ids and coverages of a tile's pixels, channel by channel.
fn ids_of(names: &Names, first: &FirstHits) -> Vec<Vec<f32>> {
    let mut by_pixel: Vec<Vec<(u32, u32)>> = vec![Vec::new(); first.pixels.len()];
    for id in &first.ids {
        by_pixel[id.pixel as usize].push((number_of(names, id), id.samples));
    }
    let mut channels = vec![Vec::new(); 2 * RANKS];
    for (found, hit) in by_pixel.into_iter().zip(&first.pixels) {
        let ranks = ranked(names, found.into_iter(), hit.samples);
        channels.iter_mut().zip(ranks).for_each(|(channel, value)| channel.push(value));
    }
    channels
}
