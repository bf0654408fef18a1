//! The lights as structures of arrays, and the one loop that sums their contributions.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::chunk::{LightChunk, Loose};
use super::emitters::Emitter;
use super::falloff::{FalloffLaw, InverseSquareFalloff, LinearFalloff, NoFalloff, with_falloff};
use super::visibility::Visibility;
use crate::scene::{Falloff, Light, LightKind, Scene, SurfacePoint};
use crate::simd::{LANES, Lanes, horizontal_sums};

/// All lights of a scene in chunks of 16. A lamp with a size is several lights.
///
/// The order is that of the scene, except that point lights come first, and lights are sorted along a Morton curve:
/// lights in one chunk are neighbours, so that they are mostly seen together or hidden together.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PackedLights {
    chunks: Vec<LightChunk>,
    falloff: Falloff,
    count: usize,
    has_emitters: bool,
}

impl PackedLights {
    /// Table of a scene's lights.
    pub fn of_scene(scene: &Scene) -> Self {
        Self::with_emitters(scene, &[])
    }

    /// The same with emissive triangles of the scene among them.
    pub fn with_emitters(scene: &Scene, emitters: &[Emitter]) -> Self {
        let directional = |light: &Light| matches!(light.kind, LightKind::Directional { .. });
        let reach = if scene.lights.iter().any(directional) {
            // From wherever mesh points are, a margin around the scene, to beyond its far side.
            4.0 * scene.bounds().extent().length()
        } else {
            0.0
        };
        let lights = Loose::of(&scene.lights).chain(emitters.iter().map(Loose::Emitter));
        Self::packed(lights.collect(), scene.falloff, reach)
    }

    /// Table of lights; occlusion rays to directional lights are `reach` long.
    pub fn new(lights: &[Light], falloff: Falloff, reach: f32) -> Self {
        Self::packed(Loose::of(lights).collect(), falloff, reach)
    }

    fn packed(lights: Vec<Loose>, falloff: Falloff, reach: f32) -> Self {
        let mut order: Vec<usize> = (0..lights.len()).collect();
        let mut bounds = crate::Bounds::EMPTY;
        lights.iter().for_each(|light| bounds.extend(light.position()));
        order.sort_by_key(|&i| (lights[i].class(), morton(lights[i].position(), bounds), i));
        let chunk = |members: &[usize]| {
            let mut chunk = LightChunk::EMPTY;
            members.iter().enumerate().for_each(|(lane, &i)| chunk.set(lane, &lights[i], reach));
            chunk
        };
        let chunks = order.chunks(LANES).map(chunk).collect();
        let has_emitters = lights.iter().any(|light| matches!(light, Loose::Emitter(_)));
        Self { chunks, falloff, count: lights.len(), has_emitters }
    }

    /// Whether light of emissive triangles is among them.
    #[inline(always)]
    pub(crate) fn has_emitters(&self) -> bool {
        self.has_emitters
    }

    /// The chunks.
    #[inline(always)]
    pub(crate) fn chunks(&self) -> &[LightChunk] {
        &self.chunks
    }

    /// φ1.
    #[inline(always)]
    pub fn falloff(&self) -> Falloff {
        self.falloff
    }

    /// E of one light.
    #[inline(always)]
    pub(crate) fn intensity(&self, index: usize, light: usize) -> [f32; 3] {
        self.chunks[index].intensity.map(|channel| channel[light])
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// Place of a position along a Morton curve through the bounds, 10 bits per axis.
fn morton(position: Vec3, bounds: crate::Bounds) -> u32 {
    let extent = bounds.extent().max(Vec3::splat(f32::MIN_POSITIVE));
    let cell = ((position - bounds.min) / extent * 1023.0).as_uvec3();
    let spread = |v: u32| (0..10).fold(0, |code, bit| code | (v >> bit & 1) << (3 * bit));
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}

/// Sixteen surface points, by axis.
#[derive(Clone, Debug)]
pub(crate) struct SurfaceLanes {
    /// Positions.
    pub position: [Lanes; 3],
    /// Shading normals.
    pub shading: [Lanes; 3],
    /// Geometric normals.
    pub geometric: [Lanes; 3],
}

/// Where a light coincides with the point it lights, t is raised to this, so that 0/0 can't arise.
const TINY_DISTANCE: f32 = 1e-18;

impl PackedLights {
    /// Σ_i V_i · φ2(n_y, lp_i − y) · E_i / φ1(|lp_i − y|), with the visibility V of each chunk's lights given by
    /// `visibility`. With V = 1 it is S(y) of method §4.
    ///
    /// Lights behind the triangle's plane give nothing, whatever the shading normal says (method §7).
    // For tests and benches only.
    #[doc(hidden)]
    #[inline(always)]
    pub fn irradiance(&self, surface: &SurfacePoint, visibility: impl Visibility) -> Vec3 {
        with_falloff!(self.falloff, law => self.irradiance_with(surface, law, visibility))
    }

    #[inline(always)]
    fn irradiance_with(
        &self,
        surface: &SurfacePoint,
        law: impl FalloffLaw,
        mut visibility: impl Visibility,
    ) -> Vec3 {
        let y = surface.position;
        let (n, g) = (surface.shading_normal, surface.geometric_normal);
        let mut sums = [[0.0f32; LANES]; 3];
        for (index, chunk) in self.chunks.iter().enumerate() {
            let Some(visible) = visibility.of_chunk(index) else { continue };
            let mut factor = [0.0f32; LANES];
            if let Some(kinds) = &chunk.kinds {
                for lane in 0..LANES {
                    let d = chunk.to_light(lane, y.to_array());
                    let [dx, dy, dz] = d;
                    let distance = (dx * dx + dy * dy + dz * dz).sqrt().max(TINY_DISTANCE);
                    let cosine = n.x * dx + n.y * dy + n.z * dz;
                    let side = g.x * dx + g.y * dy + g.z * dz;
                    let lit = if side > 0.0 && cosine > 0.0 { cosine } else { 0.0 };
                    let share = kinds.cone(lane, d, distance) * kinds.over_distance(lane, law, distance);
                    factor[lane] = visible[lane] * lit * share;
                }
            } else {
                for lane in 0..LANES {
                    let dx = chunk.position[0][lane] - y.x;
                    let dy = chunk.position[1][lane] - y.y;
                    let dz = chunk.position[2][lane] - y.z;
                    let distance = (dx * dx + dy * dy + dz * dz).sqrt().max(TINY_DISTANCE);
                    let cosine = n.x * dx + n.y * dy + n.z * dz;
                    let side = g.x * dx + g.y * dy + g.z * dz;
                    let lit = if side > 0.0 && cosine > 0.0 { cosine } else { 0.0 };
                    factor[lane] = visible[lane] * lit * law.over_distance(distance);
                }
            }
            for (sum, intensity) in sums.iter_mut().zip(&chunk.intensity) {
                for lane in 0..LANES {
                    sum[lane] += factor[lane] * intensity[lane];
                }
            }
        }
        let [r, g, b] = &sums;
        horizontal_sums([r, g, b, &[0.0; LANES]]).truncate()
    }

    /// φ2 · cone / φ1 of one light at sixteen surface points: what [`PackedLights::irradiance`] multiplies its intensity by.
    #[inline(always)]
    pub(crate) fn factors(&self, index: usize, light: usize, points: &SurfaceLanes) -> Lanes {
        with_falloff!(self.falloff, law => self.factors_with(index, light, points, law))
    }

    #[inline(always)]
    fn factors_with(&self, index: usize, light: usize, points: &SurfaceLanes, law: impl FalloffLaw) -> Lanes {
        let chunk = &self.chunks[index];
        let SurfaceLanes { position: [x, y, z], shading: [nx, ny, nz], geometric: [gx, gy, gz] } = points;
        let mut factors = [0.0f32; LANES];
        if let Some(kinds) = &chunk.kinds {
            for lane in 0..LANES {
                let d = chunk.to_light(light, [x[lane], y[lane], z[lane]]);
                let [dx, dy, dz] = d;
                let distance = (dx * dx + dy * dy + dz * dz).sqrt().max(TINY_DISTANCE);
                let cosine = nx[lane] * dx + ny[lane] * dy + nz[lane] * dz;
                let side = gx[lane] * dx + gy[lane] * dy + gz[lane] * dz;
                let lit = if side > 0.0 && cosine > 0.0 { cosine } else { 0.0 };
                factors[lane] =
                    lit * (kinds.cone(light, d, distance) * kinds.over_distance(light, law, distance));
            }
        } else {
            let [lx, ly, lz] = [0, 1, 2].map(|axis| chunk.position[axis][light]);
            for lane in 0..LANES {
                let (dx, dy, dz) = (lx - x[lane], ly - y[lane], lz - z[lane]);
                let distance = (dx * dx + dy * dy + dz * dz).sqrt().max(TINY_DISTANCE);
                let cosine = nx[lane] * dx + ny[lane] * dy + nz[lane] * dz;
                let side = gx[lane] * dx + gy[lane] * dy + gz[lane] * dz;
                let lit = if side > 0.0 && cosine > 0.0 { cosine } else { 0.0 };
                factors[lane] = lit * law.over_distance(distance);
            }
        }
        factors
    }

    /// φ2 · cone / φ1 of one light at a surface point: what its intensity is multiplied by.
    #[inline(always)]
    pub(crate) fn factor(&self, index: usize, light: usize, surface: &SurfacePoint) -> f32 {
        let chunk = &self.chunks[index];
        let d = chunk.to_light(light, surface.position.to_array());
        let to_light = Vec3::from_array(d);
        let cosine = surface.shading_normal.dot(to_light);
        if cosine <= 0.0 || surface.geometric_normal.dot(to_light) <= 0.0 {
            return 0.0;
        }
        let distance = to_light.length().max(TINY_DISTANCE);
        with_falloff!(self.falloff, law => cosine * match &chunk.kinds {
            Some(kinds) => kinds.cone(light, d, distance) * kinds.over_distance(light, law, distance),
            None => law.over_distance(distance),
        })
    }

    /// Passes every chunk to `incident`, as seen from the point `x`.
    #[inline(always)]
    pub(crate) fn incident_at(&self, x: Vec3, incident: &mut impl IncidentLights) {
        with_falloff!(self.falloff, law => self.incident_with(x, law, incident));
    }

    #[inline(always)]
    fn incident_with(&self, x: Vec3, law: impl FalloffLaw, incident: &mut impl IncidentLights) {
        for (index, chunk) in self.chunks.iter().enumerate() {
            let mut direction = [[0.0f32; LANES]; 3];
            let mut reciprocal = [0.0f32; LANES];
            if let Some(kinds) = &chunk.kinds {
                for lane in 0..LANES {
                    let d = chunk.to_light(lane, x.to_array());
                    let distance = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt().max(TINY_DISTANCE);
                    (0..3).for_each(|axis| direction[axis][lane] = d[axis] / distance);
                    let falloff = kinds.over_distance(lane, law, distance) * distance;
                    reciprocal[lane] = falloff * kinds.cone(lane, d, distance);
                }
            } else {
                for lane in 0..LANES {
                    let dx = chunk.position[0][lane] - x.x;
                    let dy = chunk.position[1][lane] - x.y;
                    let dz = chunk.position[2][lane] - x.z;
                    let distance = (dx * dx + dy * dy + dz * dz).sqrt().max(TINY_DISTANCE);
                    let inverse = 1.0 / distance;
                    direction[0][lane] = dx * inverse;
                    direction[1][lane] = dy * inverse;
                    direction[2][lane] = dz * inverse;
                    reciprocal[lane] = law.over_distance(distance) * distance;
                }
            }
            incident.chunk(index, &direction, &reciprocal);
        }
    }
}

/// What is made of the lights as seen from a point.
///
/// A trait, since closures are compiled for the oldest processor wherever they are not inlined.
pub trait IncidentLights {
    /// Takes a chunk: directions to its lights by axis, of unit length, and 1/φ1 times the cone's factor.
    fn chunk(&mut self, index: usize, direction: &[Lanes; 3], reciprocal: &Lanes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::{SeenLights, Unoccluded};

    /// Directions and reciprocals of all chunks.
    fn incident_at_the_origin(table: &PackedLights) -> Vec<([Lanes; 3], Lanes)> {
        struct Seen(Vec<([Lanes; 3], Lanes)>);
        impl IncidentLights for Seen {
            fn chunk(&mut self, _: usize, direction: &[Lanes; 3], reciprocal: &Lanes) {
                self.0.push((*direction, *reciprocal));
            }
        }
        let mut seen = Seen(Vec::new());
        table.incident_at(Vec3::ZERO, &mut seen);
        seen.0
    }

    fn surface() -> SurfacePoint {
        SurfacePoint::flat(Vec3::ZERO, Vec3::Y)
    }

    /// S(y) by hand: a light straight above at distance 2, one at 60° at distance 2, one below the plane.
    #[test]
    fn illumination_matches_hand_computed_numbers() {
        let lights = [
            Light::point(Vec3::new(0.0, 2.0, 0.0), Vec3::new(6.0, 3.0, 0.0)),
            Light::point(Vec3::new(3f32.sqrt(), 1.0, 0.0), Vec3::splat(12.0)),
            Light::point(Vec3::new(0.0, -1.0, 0.0), Vec3::splat(100.0)),
        ];
        // φ2/φ1: linear 1/(1+2) and 0.5/(1+2); inverse square 1/4 and 0.5/4; none 1 and 0.5.
        for (falloff, expected) in [
            (Falloff::Linear { constant: 1.0 }, Vec3::new(4.0, 3.0, 2.0)),
            (Falloff::InverseSquare, Vec3::new(3.0, 2.25, 1.5)),
            (Falloff::None, Vec3::new(12.0, 9.0, 6.0)),
        ] {
            let table = PackedLights::new(&lights, falloff, 0.0);
            let sum = table.irradiance(&surface(), Unoccluded);
            assert!(sum.abs_diff_eq(expected, 1e-5), "{falloff:?}: {sum} for {expected}");
            assert_eq!(table.irradiance(&surface(), SeenLights(&[0])), Vec3::ZERO);
        }
    }

    /// A light exactly at the lit point gives no NaN.
    #[test]
    fn a_light_at_the_point_is_finite() {
        let light = Light::point(Vec3::ZERO, Vec3::ONE);
        for falloff in [Falloff::Linear { constant: 0.0 }, Falloff::InverseSquare, Falloff::None] {
            let table = PackedLights::new(&[light], falloff, 0.0);
            assert!(table.irradiance(&surface(), Unoccluded).is_finite());
            for (direction, reciprocal) in incident_at_the_origin(&table) {
                assert!(direction.iter().flatten().chain(&reciprocal).all(|v| v.is_finite()));
            }
        }
    }

    /// A spot light 2 above the point: full on its axis, a quarter half-way (in cosines) between the cones, nothing
    /// beyond. A directional light has the cosine and no falloff, at any distance.
    #[test]
    fn spot_and_directional_lights_match_hand_computed_numbers() {
        let above = Vec3::new(0.0, 2.0, 0.0);
        let spot = |cosine: f32| Light {
            position: above,
            intensity: Vec3::splat(12.0),
            kind: LightKind::Spot {
                direction: Vec3::new((1.0 - cosine * cosine).sqrt(), -cosine, 0.0),
                inner_cosine: 0.9,
                outer_cosine: 0.5,
            },
        };
        let direction = Vec3::new(3f32.sqrt() / 2.0, -0.5, 0.0);
        let sun = Light {
            position: above,
            intensity: Vec3::splat(2.0),
            kind: LightKind::Directional { direction },
        };
        // 12/2² = 3 on the axis; 3 · ((0.7 − 0.5)/(0.9 − 0.5))² = 3/4 at cosine 0.7; 2 · 0.5 from the sun.
        for (light, expected) in [(spot(1.0), 3.0), (spot(0.7), 0.75), (spot(0.4), 0.0), (sun, 1.0)] {
            let table = PackedLights::new(&[light], Falloff::InverseSquare, 100.0);
            let sum = table.irradiance(&surface(), Unoccluded);
            assert!(sum.abs_diff_eq(Vec3::splat(expected), 1e-5), "{light:?}: {sum} for {expected}");
            let reciprocals = incident_at_the_origin(&table)[0].1[0];
            let cosine = if matches!(light.kind, LightKind::Directional { .. }) { 0.5 } else { 1.0 };
            assert!((light.intensity.x * reciprocals * cosine - expected).abs() < 1e-5);
        }
    }
}
