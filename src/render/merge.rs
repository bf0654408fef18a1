//! Samples of a pixel that see the same surface make one vertex: light is computed once for all of them (method §9).

use glam::Vec3;

use super::paths::{PathVertex, TilePaths};
use crate::scene::{PixelFootprint, SurfacePoint};

/// Number of no vertex.
const NONE: u32 = u32::MAX;
/// Cosine between normals of samples that are merged.
const SAME_WAY: f32 = 0.98;
/// Edges of a pixel between merged samples: along the normal, and in all.
const HEIGHT: f32 = 0.5;
const WAY: f32 = 16.0;
/// Difference in brightness, as a share of the brighter, from which on one surface counts for two.
const CONTRAST: f32 = 0.1;

/// Groups that a pixel has at most: foliage that no two samples see the same of would search them all for each sample, and cast light on each.
/// A sample beyond them joins the one whose normal is most like its own.
const CROWD: u32 = 8;

/// What one sample sees, or several that are known to see the same.
#[derive(Clone, Copy)]
pub struct Seen {
    /// The surface point: of several samples their middle.
    pub surface: SurfacePoint,
    /// k_d times the product of the k_s before it, summed over the samples.
    pub reflectance: Vec3,
    /// What reaches the pixel of the surface's own radiance, summed over the samples.
    pub emission: Vec3,
    /// Pixel within the tile.
    pub pixel: u32,
    /// Number of samples.
    pub samples: u32,
}

impl Seen {
    /// How bright a sample is, if light of 1 falls on it.
    fn brightness(&self) -> Vec3 {
        (self.reflectance + self.emission) / self.samples as f32
    }
}

/// Samples of some pixels, to be merged.
pub struct SampleMerger {
    footprint: PixelFootprint,
    /// Whether pixels have no more than one sample each.
    single: bool,
    seen: Vec<Seen>,
    /// Where rays of the samples start, in the order of `seen`.
    origins: Vec<Vec3>,
    groups: Vec<Group>,
    /// Group of each sample.
    group_of: Vec<u32>,
    /// Groups in the order of their vertices.
    order: Vec<u32>,
    /// The last group of each pixel.
    last_of: Vec<u32>,
}

/// Samples of one pixel in about the same plane.
struct Group {
    first: SurfacePoint,
    brightness: Vec3,
    /// Whether it has parts of different brightness.
    is_mixed: bool,
    /// Edge of a pixel there.
    edge: f32,
    positions: Vec3,
    normals: Vec3,
    count: u32,
    /// Squared distance from the middle of the sample that is nearest to it.
    nearest: f32,
    vertex: PathVertex,
    /// Where the next of its samples' origins goes.
    next_origin: u32,
    /// The group of the pixel before it.
    before: u32,
    /// Number of groups of the pixel before it.
    rank: u32,
}

impl SampleMerger {
    /// Of a tile of so many pixels with so many samples each.
    pub fn new(footprint: PixelFootprint, pixels: usize, samples: u32) -> Self {
        let single = samples == 1;
        let last_of = if single { Vec::new() } else { vec![NONE; pixels] };
        Self {
            footprint,
            single,
            seen: Vec::new(),
            origins: Vec::new(),
            groups: Vec::new(),
            group_of: Vec::new(),
            order: Vec::new(),
            last_of,
        }
    }

    /// Whether samples that lie within `way` of their middle, which sees a surface point, may stand together.
    #[inline(always)]
    pub fn is_narrow(&self, surface: &SurfacePoint, way: f32) -> bool {
        way < 0.5 * WAY * self.footprint.edge_at(surface.position)
    }

    /// Adds what samples see, and where their rays start.
    #[inline(always)]
    pub fn add(&mut self, seen: Seen, origins: impl IntoIterator<Item = Vec3>, paths: &mut TilePaths) {
        if self.single {
            let Seen { surface, reflectance, pixel, .. } = seen;
            if reflectance != Vec3::ZERO {
                paths.vertices.push(PathVertex { surface, reflectance, pixel });
            }
        } else {
            self.seen.push(seen);
            self.origins.extend(origins);
        }
    }

    /// Turns the samples that were added since the last time into vertices, in the order in which their first samples were added. A
    /// pixel's vertices don't depend on other pixels. What reflects nothing is no vertex: lamps, and surfaces that look the same in any light.
    ///
    /// The sample nearest to the middle of all stands for them: the middle itself may lie below a surface that isn't flat. First come the
    /// pixels' first vertices, then their second ones: those that follow each other should be neighbours.
    #[inline(always)]
    pub fn finish(&mut self, paths: &mut TilePaths) {
        if self.seen.is_empty() {
            return;
        }
        self.group_all();
        let Self { seen, origins, groups, group_of, order, .. } = self;
        let numbers = 0..groups.len() as u32;
        for rank in 0.. {
            order.extend(numbers.clone().filter(|&number| groups[number as usize].rank == rank));
            if order.len() == groups.len() {
                break;
            }
        }
        order.retain(|&number| groups[number as usize].vertex.reflectance != Vec3::ZERO);
        let mut end = paths.origins.len() as u32;
        for &number in &*order {
            let group = &mut groups[number as usize];
            group.positions /= group.count as f32;
            group.next_origin = end;
            end += group.count;
            paths.origin_ends.push(end);
        }
        paths.origins.resize(end as usize, Vec3::ZERO);
        let mut left = &origins[..];
        for (seen, &group) in seen.iter().zip(&*group_of) {
            let Group { positions: middle, nearest, vertex, next_origin, .. } = &mut groups[group as usize];
            let (own, others) = left.split_at(seen.samples as usize);
            left = others;
            self.last_of[seen.pixel as usize] = NONE;
            if vertex.reflectance == Vec3::ZERO {
                continue;
            }
            paths.origins[*next_origin as usize..][..own.len()].copy_from_slice(own);
            *next_origin += seen.samples;
            let distance = seen.surface.position.distance_squared(*middle);
            if distance < *nearest {
                *nearest = distance;
                vertex.surface = seen.surface;
            }
        }
        for &number in &*order {
            let group = &mut groups[number as usize];
            if group.count > 1 {
                group.vertex.surface.shading_normal =
                    group.normals.normalize_or(group.vertex.surface.shading_normal);
            }
            paths.vertices.push(group.vertex);
        }
        seen.clear();
        origins.clear();
        groups.clear();
        group_of.clear();
        order.clear();
    }

    /// Keeps those of some pixels, each with its index last, of which samples that were added since the last vertices see more than one surface, one of
    /// several colours, or the background beside one; each has so many samples.
    #[inline(always)]
    pub fn keep_mixed(&mut self, pixels: &mut Vec<(u32, u32, u32)>, samples: u32) {
        self.group_all();
        let mut kept = 0;
        for at in 0..pixels.len() {
            let last =
                self.last_of.get(pixels[at].2 as usize).and_then(|&last| self.groups.get(last as usize));
            if last.is_some_and(|last| last.rank > 0 || last.is_mixed || last.count < samples) {
                pixels[kept] = pixels[at];
                kept += 1;
            }
        }
        pixels.truncate(kept);
    }

    /// Finds the groups of samples that have none yet.
    #[inline(always)]
    fn group_all(&mut self) {
        for seen in &self.seen[self.group_of.len()..] {
            let group = Self::group(&mut self.groups, &mut self.last_of, &self.footprint, seen);
            self.group_of.push(group);
        }
    }

    /// Adds samples to the group that they belong to, and returns the group's number.
    #[inline(always)]
    fn group(groups: &mut Vec<Group>, last_of: &mut [u32], footprint: &PixelFootprint, seen: &Seen) -> u32 {
        let &Seen { surface, reflectance, pixel, samples, .. } = seen;
        let brightness = seen.brightness();
        let last = &mut last_of[pixel as usize];
        let (mut number, mut rank) = (*last, 0);
        let (mut alike, mut best) = (NONE, f32::NEG_INFINITY);
        while let Some(group) = groups.get(number as usize) {
            let way = surface.position - group.first.position;
            let cosine = group.first.shading_normal.dot(surface.shading_normal);
            if cosine > best {
                (alike, best) = (number, cosine);
            }
            if cosine > SAME_WAY
                && way.dot(group.first.geometric_normal).abs() < HEIGHT * group.edge
                && way.length_squared() < (WAY * group.edge) * (WAY * group.edge)
            {
                break;
            }
            number = group.before;
            rank += 1;
        }
        if number == NONE && rank >= CROWD {
            number = alike;
        }
        if number == NONE {
            number = groups.len() as u32;
            groups.push(Group {
                first: surface,
                brightness,
                is_mixed: false,
                edge: footprint.edge_at(surface.position),
                positions: Vec3::ZERO,
                normals: Vec3::ZERO,
                count: 0,
                nearest: f32::INFINITY,
                vertex: PathVertex { surface, reflectance: Vec3::ZERO, pixel },
                next_origin: 0,
                before: *last,
                rank,
            });
            *last = number;
        }
        let group = &mut groups[number as usize];
        let contrast = (group.brightness - brightness).abs() - CONTRAST * group.brightness.max(brightness);
        group.is_mixed |= contrast.max_element() > 0.0;
        group.positions += surface.position * samples as f32;
        group.normals += surface.shading_normal * samples as f32;
        group.vertex.reflectance += reflectance;
        group.count += samples;
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of a pixel in a plane are one vertex, whatever lies between them in the list, and the middle one stands for them; other planes,
    /// other sides and other pixels have their own.
    #[test]
    fn a_vertex_is_a_plane_in_a_pixel() {
        let footprint = PixelFootprint { eye: Vec3::Y * 10.0, edge: 0.01 };
        let mut merger = SampleMerger::new(footprint, 2, 16);
        let mut paths = TilePaths::default();
        let up = Vec3::Y;
        for (pixel, x, y, normal) in [
            (0, 0.0, 0.0, up),
            (1, 0.1, 0.0, up),
            (0, 0.0, 0.0, -up),
            (0, 0.03, 0.0, up),
            (0, 0.0, 1.0, up),
            (0, 0.02, 0.0, up),
            (0, 9.0, 0.0, up),
        ] {
            let surface = SurfacePoint::flat(Vec3::new(x, y, 0.0), normal);
            let seen =
                Seen { surface, reflectance: Vec3::splat(0.5), emission: Vec3::ZERO, pixel, samples: 1 };
            merger.add(seen, [surface.position], &mut paths);
        }
        merger.finish(&mut paths);
        let found: Vec<_> = paths.vertices.iter().map(|v| (v.pixel, v.reflectance.x)).collect();
        assert_eq!(found, [(0, 1.5), (1, 0.5), (0, 0.5), (0, 0.5), (0, 0.5)]);
        assert_eq!(paths.vertices[0].surface.position.x, 0.02);
        let origins: Vec<f32> = paths.origins_of(0).iter().map(|origin| origin.x).collect();
        assert_eq!(origins, [0.0, 0.03, 0.02]);
    }

    /// What reflects nothing has no vertex, with one sample as with several, and takes none from what is seen beside it.
    #[test]
    fn black_is_no_vertex() {
        for samples in [1, 16] {
            let mut merger = SampleMerger::new(PixelFootprint { eye: Vec3::Y, edge: 0.01 }, 3, samples);
            let mut paths = TilePaths::default();
            for (pixel, reflectance) in [(0, 0.0), (1, 0.5), (2, 0.0)] {
                let surface = SurfacePoint::flat(Vec3::X * pixel as f32, Vec3::Y);
                let reflectance = Vec3::splat(reflectance);
                let seen = Seen { surface, reflectance, emission: Vec3::ONE, pixel, samples: 1 };
                merger.add(seen, [surface.position], &mut paths);
            }
            merger.finish(&mut paths);
            assert_eq!(paths.vertices.iter().map(|vertex| vertex.pixel).collect::<Vec<_>>(), [1]);
            assert_eq!(paths.origins.len(), if samples == 1 { 0 } else { 1 });
        }
    }

    /// A pixel of foliage has a bounded number of vertices, and none of its samples is lost.
    #[test]
    fn a_pixel_has_no_more_than_a_crowd_of_vertices() {
        let mut merger = SampleMerger::new(PixelFootprint { eye: Vec3::Y, edge: 0.01 }, 1, 256);
        let mut paths = TilePaths::default();
        for leaf in 0..256 {
            let surface =
                SurfacePoint::flat(Vec3::splat(leaf as f32), if leaf % 2 == 0 { Vec3::Y } else { -Vec3::Y });
            let seen =
                Seen { surface, reflectance: Vec3::splat(0.5), emission: Vec3::ZERO, pixel: 0, samples: 1 };
            merger.add(seen, [surface.position], &mut paths);
        }
        merger.finish(&mut paths);
        assert_eq!(paths.vertices.len(), CROWD as usize);
        assert_eq!(paths.vertices.iter().map(|v| v.reflectance.x).sum::<f32>(), 128.0);
        assert_eq!(paths.origins.len(), 256);
    }
}
