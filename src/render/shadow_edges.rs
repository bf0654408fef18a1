//! Edges of shadows within pixels that have several samples (method §9).
//!
//! Which lights a surface in a pixel sees is found out for one of its samples. Where that changes from a pixel to the next, the samples are asked
//! for that light alone, the more of them the more of the pixel's light is at stake: so an edge that is smooth costs little more
//! than one that is not.

use glam::Vec3;

use super::tiles::Tile;
use super::trace::{PathVertex, TilePaths};
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::lights::{PackedLights, VisibilityBits};
use crate::simd::LANES;

/// Which lights the vertices of a tile see.
pub(super) struct TileVisibility {
    chunks: usize,
    /// By vertex and chunk: lights that are seen.
    seen: Vec<VisibilityBits>,
    /// Lights whose part in the light is no matter of seeing or not, and stays; empty if there are none.
    settled: Vec<VisibilityBits>,
}

impl TileVisibility {
    /// Of so many vertices: no light is seen.
    pub fn new(vertices: usize, lights: &PackedLights) -> Self {
        let chunks = lights.chunks().len();
        Self { chunks, seen: vec![0; vertices * chunks], settled: Vec::new() }
    }

    /// The lights that a vertex sees, by chunk.
    #[inline(always)]
    pub fn seen(&self, vertex: usize) -> &[VisibilityBits] {
        &self.seen[vertex * self.chunks..][..self.chunks]
    }

    /// The same, to be changed.
    #[inline(always)]
    pub fn seen_mut(&mut self, vertex: usize) -> &mut [VisibilityBits] {
        &mut self.seen[vertex * self.chunks..][..self.chunks]
    }

    /// The lights that some vertices see, a row of chunks for each.
    #[inline(always)]
    pub fn rows(&self, vertices: std::ops::Range<usize>) -> &[VisibilityBits] {
        &self.seen[vertices.start * self.chunks..vertices.end * self.chunks]
    }

    /// Settles some lights of a chunk for some vertices.
    pub fn settle(&mut self, vertices: std::ops::Range<usize>, index: usize, lights: VisibilityBits) {
        self.settled.resize(self.seen.len(), 0);
        for vertex in vertices {
            self.settled[vertex * self.chunks + index] |= lights;
        }
    }
}

/// Least cosine between the normals of vertices of one surface.
const SMOOTH_COSINE: f32 = 0.9;
/// Greatest distance of a vertex from the plane of another of the same surface, over the distance between the two.
const SMOOTH_HEIGHT: f32 = 0.2;
/// Share of a pixel's light that each of the samples decides about.
const SHARE_OF_SAMPLE: f32 = 1.0 / 48.0;
/// Share of a pixel's light below which a light's edge stays as it is.
const LEAST_SHARE: f32 = 1.0 / 96.0;

/// Finds out what part of the lights at edges of shadows the vertices of a tile see, and corrects their light, which is to be
/// multiplied by `scale`. Returns the number of rays.
#[inline(always)]
pub(super) fn smooth_shadow_edges<A: Accel>(
    accel: &A,
    lights: &PackedLights,
    tile: &Tile,
    paths: &TilePaths,
    visibility: &TileVisibility,
    scale: f32,
    light: &mut [Vec3],
) -> u64 {
    let TileVisibility { chunks, seen, settled } = visibility;
    if paths.origins.is_empty() || *chunks == 0 {
        return 0;
    }
    let vertices = &paths.vertices;
    let surfaces = Neighbours::new(tile, vertices);
    let mut at_edge: Vec<VisibilityBits> = vec![0; seen.len()];
    for &(a, b) in &surfaces.pairs {
        let (a, b) = (a as usize * chunks, b as usize * chunks);
        for index in 0..*chunks {
            let differ = seen[a + index] ^ seen[b + index];
            at_edge[a + index] |= differ;
            at_edge[b + index] |= differ;
        }
    }
    for (edge, settled) in at_edge.iter_mut().zip(settled) {
        *edge &= !settled;
    }
    let mut edges = Edges {
        accel,
        lights,
        paths,
        asked: Vec::new(),
        rays: 0,
        totals: totals(paths, light, scale),
        scale,
    };
    // What lies beyond the border of the tile is not known: there the outermost sample tells, for lights that have an edge in the tile.
    let mut anywhere: Vec<VisibilityBits> = vec![0; *chunks];
    for row in at_edge.chunks_exact(*chunks) {
        for (anywhere, edge) in anywhere.iter_mut().zip(row) {
            *anywhere |= edge;
        }
    }
    edges.find_at_border(&surfaces, &anywhere, visibility, &mut at_edge);
    for index in 0..*chunks {
        let mut left = anywhere[index];
        while left != 0 {
            let number = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            edges.smooth((index, number), visibility, &at_edge, light);
        }
    }
    edges.rays
}

/// Light of each pixel of a tile summed over its samples: the sum of the colours.
#[inline(always)]
fn totals(paths: &TilePaths, light: &[Vec3], scale: f32) -> Vec<f32> {
    let mut totals: Vec<f32> = paths.radiance.iter().map(|radiance| radiance.element_sum()).collect();
    for (vertex, light) in paths.vertices.iter().zip(light) {
        totals[vertex.pixel as usize] += vertex.reflectance.dot(*light) * scale;
    }
    totals
}

/// Which vertices of a tile are neighbours on one surface.
struct Neighbours {
    /// Each pair once.
    pairs: Vec<(u32, u32)>,
    /// Vertices at the border of the tile, each with a neighbour further inside.
    at_border: Vec<(u32, u32)>,
}

impl Neighbours {
    #[inline(always)]
    fn new(tile: &Tile, vertices: &[PathVertex]) -> Self {
        let (width, height) = (tile.width as usize, tile.height as usize);
        let mut first = vec![0u32; tile.pixels() + 1];
        for vertex in vertices {
            first[vertex.pixel as usize + 1] += 1;
        }
        for pixel in 0..tile.pixels() {
            first[pixel + 1] += first[pixel];
        }
        let mut next = first.clone();
        let mut of_pixels = vec![0u32; vertices.len()];
        for (number, vertex) in vertices.iter().enumerate() {
            let place = &mut next[vertex.pixel as usize];
            of_pixels[*place as usize] = number as u32;
            *place += 1;
        }
        let of_pixel = |x: usize, y: usize| {
            let pixel = y * width + x;
            &of_pixels[first[pixel] as usize..first[pixel + 1] as usize]
        };
        let mut pairs = Vec::with_capacity(4 * vertices.len());
        let mut at_border = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let inner = (x.clamp(1, width.max(3) - 2), y.clamp(1, height.max(3) - 2));
                for (dx, dy) in [(1, 0), (-1, 1), (0, 1), (1, 1)] {
                    let (other_x, other_y) = (x.wrapping_add_signed(dx), y + dy);
                    if other_x >= width || other_y >= height {
                        continue;
                    }
                    let others = of_pixel(other_x, other_y);
                    let other_inner =
                        (other_x.clamp(1, width.max(3) - 2), other_y.clamp(1, height.max(3) - 2));
                    for &a in of_pixel(x, y) {
                        for &b in others
                            .iter()
                            .filter(|&&b| is_smooth(&vertices[a as usize], &vertices[b as usize]))
                        {
                            pairs.push((a, b));
                            if inner != (x, y) && inner == (other_x, other_y) {
                                at_border.push((a, b));
                            }
                            if other_inner != (other_x, other_y) && other_inner == (x, y) {
                                at_border.push((b, a));
                            }
                        }
                    }
                }
            }
        }
        Self { pairs, at_border }
    }
}

/// Whether two vertices lie on one surface.
#[inline(always)]
fn is_smooth(a: &PathVertex, b: &PathVertex) -> bool {
    let (a, b) = (&a.surface, &b.surface);
    let way = b.position - a.position;
    let height = a.geometric_normal.dot(way);
    a.geometric_normal.dot(b.geometric_normal) >= SMOOTH_COSINE
        && height * height <= SMOOTH_HEIGHT * SMOOTH_HEIGHT * way.length_squared()
}

/// Rays of a vertex towards a light.
struct Asked {
    vertex: u32,
    /// What the light's intensity is multiplied by.
    factor: f32,
    /// Rays, and how many of them see the light.
    rays: u32,
    seeing: u32,
}

/// Asking samples about lights.
struct Edges<'a, A> {
    accel: &'a A,
    lights: &'a PackedLights,
    paths: &'a TilePaths,
    asked: Vec<Asked>,
    rays: u64,
    /// Light of each pixel, see [`totals`].
    totals: Vec<f32>,
    scale: f32,
}

impl<A: Accel> Edges<'_, A> {
    /// Smooths the edges of one light.
    #[inline(always)]
    fn smooth(
        &mut self,
        (index, number): (usize, usize),
        visibility: &TileVisibility,
        at_edge: &[VisibilityBits],
        light: &mut [Vec3],
    ) {
        let chunks = visibility.chunks;
        let intensity = Vec3::from(self.lights.intensity(index, number));
        self.asked.clear();
        for (vertex, edges) in at_edge.chunks_exact(chunks).enumerate() {
            if edges[index] >> number & 1 == 0 {
                continue;
            }
            let is_seen = visibility.seen(vertex)[index] >> number & 1 == 1;
            let (factor, share) = self.share(vertex, (index, number), intensity, is_seen);
            if share < LEAST_SHARE {
                continue;
            }
            let rays = ((share / SHARE_OF_SAMPLE).ceil() as u32).min(self.paths.vertices[vertex].samples);
            self.asked.push(Asked { vertex: vertex as u32, factor, rays, seeing: 0 });
        }
        self.trace((index, number));
        for asked in &self.asked {
            let vertex = asked.vertex as usize;
            let before = f32::from(visibility.seen(vertex)[index] >> number & 1);
            let part = asked.seeing as f32 / asked.rays as f32;
            light[vertex] = (light[vertex] + intensity * (asked.factor * (part - before))).max(Vec3::ZERO);
        }
    }

    /// What a light's intensity is multiplied by at a vertex, and its share of the pixel's light.
    #[inline(always)]
    fn share(
        &self,
        vertex: usize,
        (index, number): (usize, usize),
        intensity: Vec3,
        is_seen: bool,
    ) -> (f32, f32) {
        let vertex = &self.paths.vertices[vertex];
        let factor = self.lights.factor(index, number, &vertex.surface);
        let part = vertex.reflectance.dot(intensity) * (factor * self.scale);
        let total = self.totals[vertex.pixel as usize] + if is_seen { 0.0 } else { part };
        (factor, if total > 0.0 { part / total } else { 0.0 })
    }

    /// Traces the rays that are asked for towards a light.
    #[inline(always)]
    fn trace(&mut self, (index, number): (usize, usize)) {
        let chunk = &self.lights.chunks()[index];
        let mut packet = RayPacket::<LANES>::empty();
        let mut owners = [0usize; LANES];
        let mut filled = 0;
        for at in 0..self.asked.len() {
            let Asked { vertex, rays, .. } = self.asked[at];
            let origins = self.paths.origins_of(&self.paths.vertices[vertex as usize]);
            for ray in 0..rays as usize {
                // Evenly over the samples, and others for each light.
                let origin = origins[(ray * origins.len() / rays as usize + number) % origins.len()];
                set_ray(&mut packet, filled, origin, chunk.to_light(number, origin.to_array()));
                owners[filled] = at;
                filled += 1;
                if filled == LANES {
                    self.send(&mut packet, &owners);
                    filled = 0;
                }
            }
        }
        self.send(&mut packet, &owners[..filled]);
    }

    /// Traces the rays of a packet, which belong to the `owners`.
    #[inline(always)]
    fn send(&mut self, packet: &mut RayPacket<LANES>, owners: &[usize]) {
        if owners.is_empty() {
            return;
        }
        let active = ((1u32 << owners.len()) - 1) as LaneMask;
        let blocked = self.accel.occluded_packet(active, packet, Coherence::Coherent);
        self.rays += owners.len() as u64;
        for (lane, &owner) in owners.iter().enumerate() {
            self.asked[owner].seeing += u32::from(!blocked >> lane & 1);
        }
    }

    /// Asks the outermost samples of vertices at the border of the tile for lights that have an edge anywhere, and adds the edges that they find.
    #[inline(always)]
    fn find_at_border(
        &mut self,
        surfaces: &Neighbours,
        anywhere: &[VisibilityBits],
        visibility: &TileVisibility,
        at_edge: &mut [VisibilityBits],
    ) {
        let chunks = visibility.chunks;
        let vertices = &self.paths.vertices;
        for (index, anywhere) in anywhere.iter().enumerate() {
            let mut left = *anywhere;
            while left != 0 {
                let number = left.trailing_zeros() as usize % LANES;
                left &= left - 1;
                let intensity = Vec3::from(self.lights.intensity(index, number));
                let chunk = &self.lights.chunks()[index];
                let mut packet = RayPacket::<LANES>::empty();
                let mut owners = [0usize; LANES];
                let mut filled = 0;
                self.asked.clear();
                for &(vertex, inner) in &surfaces.at_border {
                    let vertex = vertex as usize;
                    let settled = visibility.settled.get(vertex * chunks + index).copied().unwrap_or(0);
                    let known = (at_edge[vertex * chunks + index] | settled) >> number & 1 == 1;
                    let is_seen = visibility.seen(vertex)[index] >> number & 1 == 1;
                    if known || self.share(vertex, (index, number), intensity, is_seen).1 < LEAST_SHARE {
                        continue;
                    }
                    let middle = vertices[vertex].surface.position;
                    let outwards = middle - vertices[inner as usize].surface.position;
                    let along = |origin: &&Vec3| (**origin - middle).dot(outwards);
                    let origins = self.paths.origins_of(&vertices[vertex]).iter();
                    let Some(origin) = origins.max_by(|a, b| along(a).total_cmp(&along(b))) else { continue };
                    set_ray(&mut packet, filled, *origin, chunk.to_light(number, origin.to_array()));
                    owners[filled] = self.asked.len();
                    self.asked.push(Asked { vertex: vertex as u32, factor: 0.0, rays: 1, seeing: 0 });
                    filled += 1;
                    if filled == LANES {
                        self.send(&mut packet, &owners);
                        filled = 0;
                    }
                }
                self.send(&mut packet, &owners[..filled]);
                for asked in &self.asked {
                    let at = asked.vertex as usize * chunks + index;
                    let differs = asked.seeing as VisibilityBits ^ (visibility.seen[at] >> number & 1);
                    at_edge[at] |= differs << number;
                }
            }
        }
    }
}

/// Puts a ray into a packet.
#[inline(always)]
fn set_ray(packet: &mut RayPacket<LANES>, lane: usize, origin: Vec3, direction: [f32; 3]) {
    (packet.org_x[lane], packet.org_y[lane], packet.org_z[lane]) = origin.into();
    [packet.dir_x[lane], packet.dir_y[lane], packet.dir_z[lane]] = direction;
    packet.tnear[lane] = 0.0;
    packet.tfar[lane] = 1.0;
}
