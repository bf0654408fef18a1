//! Edges of shadows within pixels that have several samples (method §9).
//!
//! Which lights a surface in a pixel sees is found out for one of its samples. Where that changes from a pixel to the next, the samples are asked
//! for that light alone, the more of them the more of the pixel's light is at stake: so an edge that is smooth costs little more
//! than one that is not.

use glam::Vec3;

use super::layers::GroupLight;
use super::paths::{PathVertex, TilePaths};
use super::tiles::Tile;
use crate::accel::{Accel, Coherence, LaneMask, RayPacket};
use crate::lights::{HalfSeenLights, PackedLights, VisibilityBits};
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

    /// Whether a vertex sees a light.
    #[inline(always)]
    fn sees(&self, vertex: usize, (index, number): ChunkLight) -> bool {
        self.seen(vertex)[index] >> number & 1 == 1
    }

    /// The same as [`Self::seen`], to be changed.
    #[inline(always)]
    pub fn seen_mut(&mut self, vertex: usize) -> &mut [VisibilityBits] {
        &mut self.seen[vertex * self.chunks..][..self.chunks]
    }

    /// The lights that some vertices see, a row of chunks for each.
    #[inline(always)]
    pub fn rows(&self, vertices: std::ops::Range<usize>) -> &[VisibilityBits] {
        &self.seen[vertices.start * self.chunks..vertices.end * self.chunks]
    }

    /// Adds the light that each group of lights gives the vertices. Lights that are settled count half: how much of them is part of the light
    /// is not kept, and too little to matter.
    #[inline(always)]
    pub fn add_by_group(&self, lights: &PackedLights, vertices: &[PathVertex], groups: &mut GroupLight) {
        for (number, vertex) in vertices.iter().enumerate() {
            let settled = self.settled.get(number * self.chunks..).unwrap_or_default();
            groups.add(lights, number, vertex, HalfSeenLights { seen: self.seen(number), half: settled });
        }
    }

    /// Settles some lights of a chunk for some vertices.
    pub fn settle(&mut self, vertices: std::ops::Range<usize>, index: usize, lights: VisibilityBits) {
        self.settled.resize(self.seen.len(), 0);
        for vertex in vertices {
            self.settled[vertex * self.chunks + index] |= lights;
        }
    }

    /// Of a light that was settled for a vertex it is known now whether it is seen.
    pub fn unsettle(&mut self, vertex: usize, index: usize, light: usize, is_seen: bool) {
        let at = vertex * self.chunks + index;
        self.settled[at] &= !(1 << light);
        self.seen[at] |= VisibilityBits::from(is_seen) << light;
    }
}

/// Least cosine between the normals of vertices of one surface.
const SMOOTH_COSINE: f32 = 0.9;
/// Greatest distance of a vertex from the plane of another of the same surface, over the distance between the two.
const SMOOTH_HEIGHT: f32 = 0.2;
/// Share of a pixel's light that each of the samples decides about.
const SHARE_OF_SAMPLE: f32 = 1.0 / 48.0;
/// Below so many rays of a vertex towards a light the first one, which found the edge, counts too.
const FEW: u32 = 4;
/// Share of a pixel's light below which a light's edge stays as it is.
const LEAST_SHARE: f32 = 1.0 / 96.0;

/// Finds out what part of the lights at edges of shadows the vertices of a tile see, and corrects their light, which is to be
/// multiplied by `scale`, and with it that of `groups`, which is not. Returns the number of rays.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "what shading has to know is no thing of its own")]
pub(super) fn smooth_shadow_edges<A: Accel>(
    accel: &A,
    lights: &PackedLights,
    tile: &Tile,
    paths: &TilePaths,
    visibility: &TileVisibility,
    scale: f32,
    light: &mut [Vec3],
    mut groups: Option<&mut GroupLight>,
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
    let mut anywhere: Vec<VisibilityBits> = vec![0; *chunks];
    for row in at_edge.chunks_exact(*chunks) {
        for (anywhere, edge) in anywhere.iter_mut().zip(row) {
            *anywhere |= edge;
        }
    }
    let totals = totals(paths, light, scale);
    let mut edges = Edges { accel, lights, paths, visibility, asked: Vec::new(), rays: 0, totals, scale };
    for (index, mut left) in anywhere.into_iter().enumerate() {
        while left != 0 {
            let of = (index, left.trailing_zeros() as usize);
            left &= left - 1;
            // What lies beyond the border of the tile is not known.
            edges.find_at_border(of, &surfaces.at_border, &mut at_edge);
            edges.smooth(of, &at_edge, light, groups.as_deref_mut());
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
        let inwards = |x: usize, y: usize| (x.clamp(1, width.max(3) - 2), y.clamp(1, height.max(3) - 2));
        let mut pairs = Vec::with_capacity(4 * vertices.len());
        let mut at_border = Vec::new();
        for y in 0..height {
            for x in 0..width {
                for (dx, dy) in [(1, 0), (-1, 1), (0, 1), (1, 1)] {
                    let (other_x, other_y) = (x.wrapping_add_signed(dx), y + dy);
                    if other_x >= width || other_y >= height {
                        continue;
                    }
                    let others = of_pixel(other_x, other_y);
                    // A pixel inside the border leads to itself, and so to no other.
                    let leads_in = inwards(x, y) == (other_x, other_y);
                    let leads_out = inwards(other_x, other_y) == (x, y);
                    for &a in of_pixel(x, y) {
                        for &b in others
                            .iter()
                            .filter(|&&b| is_smooth(&vertices[a as usize], &vertices[b as usize]))
                        {
                            pairs.push((a, b));
                            if leads_in {
                                at_border.push((a, b));
                            }
                            if leads_out {
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
    /// The first of the samples that are asked; the others follow at equal steps.
    first: u32,
    /// Rays, and how many of them see the light.
    rays: u32,
    seeing: u32,
}

/// A light by the index of its chunk and its number there.
type ChunkLight = (usize, usize);

/// Asking samples about lights.
struct Edges<'a, A> {
    accel: &'a A,
    lights: &'a PackedLights,
    paths: &'a TilePaths,
    visibility: &'a TileVisibility,
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
        of: ChunkLight,
        at_edge: &[VisibilityBits],
        light: &mut [Vec3],
        mut groups: Option<&mut GroupLight>,
    ) {
        let (index, number) = of;
        let intensity = Vec3::from(self.lights.intensity(index, number));
        self.asked.clear();
        for (vertex, edges) in at_edge.chunks_exact(self.visibility.chunks).enumerate() {
            if edges[index] >> number & 1 == 0 {
                continue;
            }
            let (factor, share) = self.share(vertex, of);
            if share < LEAST_SHARE {
                continue;
            }
            let samples = self.paths.origins_of(vertex).len() as u32;
            // At least one, whatever numbers beyond all bounds come to.
            let rays = ((share / SHARE_OF_SAMPLE).ceil().max(1.0) as u32).min(samples);
            // Others for each light.
            let first = number as u32;
            self.asked.push(Asked { vertex: vertex as u32, factor, first, rays, seeing: 0 });
        }
        self.trace(of);
        for asked in &self.asked {
            let vertex = asked.vertex as usize;
            let before = if self.visibility.sees(vertex, of) { 1.0 } else { 0.0 };
            // What is known already is a sample more, which counts where there are few.
            let known = if asked.rays < FEW { 1.0 } else { 0.0 };
            let part = (asked.seeing as f32 + known * before) / (asked.rays as f32 + known);
            let change = intensity * (asked.factor * (part - before));
            light[vertex] = (light[vertex] + change).max(Vec3::ZERO);
            if let Some(groups) = &mut groups {
                groups.change(self.lights, vertex, of, change);
            }
        }
    }

    /// Asks the outermost samples of vertices at the border of the tile for a light that has an edge in the tile, and adds the edges that they
    /// find.
    #[inline(always)]
    fn find_at_border(&mut self, of: ChunkLight, at_border: &[(u32, u32)], at_edge: &mut [VisibilityBits]) {
        let (index, number) = of;
        let TileVisibility { chunks, settled, .. } = self.visibility;
        let vertices = &self.paths.vertices;
        self.asked.clear();
        for &(vertex, inner) in at_border {
            let at = vertex as usize * chunks + index;
            let known = at_edge[at] | settled.get(at).copied().unwrap_or(0);
            if known >> number & 1 == 1 || self.share(vertex as usize, of).1 < LEAST_SHARE {
                continue;
            }
            let outer = &vertices[vertex as usize];
            let middle = outer.surface.position;
            let outwards = middle - vertices[inner as usize].surface.position;
            let along = |origin: &Vec3| (*origin - middle).dot(outwards);
            let origins = self.paths.origins_of(vertex as usize).iter().map(along).enumerate();
            let outermost = origins.max_by(|(_, a), (_, b)| a.total_cmp(b));
            let first = outermost.map_or(0, |(first, _)| first as u32);
            self.asked.push(Asked { vertex, factor: 0.0, first, rays: 1, seeing: 0 });
        }
        self.trace(of);
        for asked in &self.asked {
            let differs = (asked.seeing == 1) != self.visibility.sees(asked.vertex as usize, of);
            at_edge[asked.vertex as usize * chunks + index] |= VisibilityBits::from(differs) << number;
        }
    }

    /// What a light's intensity is multiplied by at a vertex, and its share of the pixel's light.
    #[inline(always)]
    fn share(&self, vertex: usize, of: ChunkLight) -> (f32, f32) {
        let is_seen = self.visibility.sees(vertex, of);
        let vertex = &self.paths.vertices[vertex];
        let intensity = Vec3::from(self.lights.intensity(of.0, of.1));
        let factor = self.lights.factor(of.0, of.1, &vertex.surface);
        let part = vertex.reflectance.dot(intensity) * (factor * self.scale);
        let total = self.totals[vertex.pixel as usize] + if is_seen { 0.0 } else { part };
        (factor, if total > 0.0 { part / total } else { 0.0 })
    }

    /// Traces the rays that are asked for towards a light.
    #[inline(always)]
    fn trace(&mut self, (index, number): ChunkLight) {
        let chunk = &self.lights.chunks()[index];
        let mut packet = RayPacket::<LANES>::empty();
        let mut owners = [0usize; LANES];
        let mut filled = 0;
        let coherence = chunk.coherence(number);
        for at in 0..self.asked.len() {
            let Asked { vertex, first, rays, .. } = self.asked[at];
            let origins = self.paths.origins_of(vertex as usize);
            let place = self.paths.vertices[vertex as usize].surface.position;
            for ray in 0..rays {
                let sample = ray as usize * origins.len() / rays as usize + first as usize;
                let origin = origins[sample % origins.len()];
                // The samples share out a lamp that has a size among them.
                set_ray(&mut packet, filled, origin, chunk.way(number, origin.to_array(), place, ray + 1));
                owners[filled] = at;
                filled += 1;
                if filled == LANES {
                    self.send(&mut packet, &owners, coherence);
                    filled = 0;
                }
            }
        }
        self.send(&mut packet, &owners[..filled], coherence);
    }

    /// Traces the rays of a packet, which belong to the `owners`.
    #[inline(always)]
    fn send(&mut self, packet: &mut RayPacket<LANES>, owners: &[usize], coherence: Coherence) {
        if owners.is_empty() {
            return;
        }
        let active = ((1u32 << owners.len()) - 1) as LaneMask;
        let blocked = self.accel.occluded_packet(active, packet, coherence);
        self.rays += owners.len() as u64;
        for (lane, &owner) in owners.iter().enumerate() {
            self.asked[owner].seeing += u32::from(!blocked >> lane & 1 == 1);
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
