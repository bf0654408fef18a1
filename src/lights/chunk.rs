//! Sixteen lights, and what they are made of.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::emitters::Emitter;
use super::kinds::KindLanes;
use super::shape::{LampShape, ball_parts, lamp_numbers};
use super::visibility::VisibilityBits;
use crate::accel::Coherence;
use crate::scene::{Light, LightKind, Scene};
use crate::simd::{LANES, Lanes};

/// Sixteen lights.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LightChunk {
    /// lp, by axis; of directional lights, the way to walk from anywhere to be beyond the scene.
    pub position: [Lanes; 3],
    /// Kinds of the lights that are no point lights; `None` where all lanes are point lights.
    pub(super) kinds: Option<Box<KindLanes>>,
    /// E, by channel; 0 in lanes that hold no light.
    pub intensity: [Lanes; 3],
    /// The lanes that hold a light.
    pub used: VisibilityBits,
    /// Where rays to the lights end; `None` where all end at the position.
    shapes: Option<Box<[LampShape; LANES]>>,
}

impl LightChunk {
    /// No lights.
    pub(super) const EMPTY: Self = Self {
        position: [[0.0; LANES]; 3],
        kinds: None,
        intensity: [[0.0; LANES]; 3],
        used: 0,
        shapes: None,
    };

    /// Puts a light into a lane; the way to directional ones is `reach` long.
    pub(super) fn set(&mut self, lane: usize, light: &Loose, reach: f32) {
        let (position, intensity, shape) = match light {
            Loose::Light(light, shape) => {
                let position = match light.kind {
                    LightKind::Directional { direction } => direction * -reach.max(1.0),
                    _ => light.position,
                };
                if !matches!(light.kind, LightKind::Point | LightKind::Ball { .. }) {
                    self.kinds.get_or_insert_with(Default::default).set(lane, light.kind);
                }
                let parts = if let LampShape::Ball { part: (_, parts), .. } = shape { *parts } else { 1 };
                (position, light.intensity / f32::from(parts), shape.clone())
            }
            Loose::Emitter(emitter) => {
                self.kinds.get_or_insert_with(Default::default).set_emitter(lane, emitter);
                (emitter.position, emitter.intensity, LampShape::Emitter(emitter.pieces.clone()))
            }
        };
        for axis in 0..3 {
            self.position[axis][lane] = position[axis];
            self.intensity[axis][lane] = intensity[axis];
        }
        self.used |= 1 << lane;
        if !matches!(shape, LampShape::Point) {
            self.shapes.get_or_insert_default()[lane] = shape;
        }
    }

    /// The lanes to whose lights rays end elsewhere than to those of another chunk: of the others, what is known of their visibility is known
    /// of both.
    pub fn placed_unlike(&self, other: &Self) -> VisibilityBits {
        let differs = |&lane: &usize| {
            let place = |chunk: &Self| {
                let local = chunk.kinds.as_ref().map_or(1.0, |kinds| kinds.local[lane]);
                (chunk.used >> lane & 1, [0, 1, 2].map(|axis| chunk.position[axis][lane]), local)
            };
            place(self) != place(other) || self.lamp(lane) != other.lamp(lane)
        };
        (0..LANES).filter(differs).fold(0, |lanes, lane| lanes | 1 << lane)
    }

    /// The way from `x` to the light in `lane`: its end is beyond all that could hide the light.
    #[inline(always)]
    pub fn to_light(&self, lane: usize, x: [f32; 3]) -> [f32; 3] {
        let local = self.kinds.as_ref().map_or(1.0, |kinds| kinds.local[lane]);
        [0, 1, 2].map(|axis| self.position[axis][lane] - local * x[axis])
    }

    /// Squared length of the ways from `x` to the lights.
    #[inline(always)]
    pub fn squared_distances(&self, x: Vec3) -> Lanes {
        let mut squared = [0.0; LANES];
        for axis in 0..3 {
            for lane in 0..LANES {
                let local = self.kinds.as_ref().map_or(1.0, |kinds| kinds.local[lane]);
                let way = self.position[axis][lane] - local * x[axis];
                squared[lane] += way * way;
            }
        }
        squared
    }

    /// The light in a lane, if it is part of a lamp that has a size.
    #[inline(always)]
    pub fn lamp(&self, lane: usize) -> Option<&LampShape> {
        self.shapes.as_ref().map(|shapes| &shapes[lane]).filter(|shape| !matches!(shape, LampShape::Point))
    }

    /// Of a cluster of emissive triangles, the square of the radius of a disc of its size; `None` of all other lights.
    pub fn emitter_size(&self, lane: usize) -> Option<f32> {
        self.kinds.as_ref()?.emitter_size(lane)
    }

    /// What a point of a flat cluster of emissive triangles sends along the way to it, over the cluster's intensity: the cosine there over the squared
    /// distance.
    #[inline(always)]
    pub fn emitted_along(&self, lane: usize, way: [f32; 3]) -> f32 {
        self.kinds.as_ref().map_or(0.0, |kinds| kinds.emitted_along(lane, way))
    }

    /// Whether rays of neighbours towards a light stay together: those to a lamp with a size go to different points of it, and take a tenth longer as
    /// one packet.
    #[inline(always)]
    pub fn coherence(&self, lane: usize) -> Coherence {
        if self.lamp(lane).is_some() { Coherence::Incoherent } else { Coherence::Coherent }
    }

    /// The way from `x` to the light in `lane`: of a lamp with a size, to the point that the k-th numbers of a place choose.
    #[inline(always)]
    pub fn way(&self, lane: usize, x: [f32; 3], place: Vec3, k: u32) -> [f32; 3] {
        let to_light = self.to_light(lane, x);
        match self.lamp(lane) {
            Some(lamp) => lamp.way(to_light.into(), x.into(), lamp_numbers(place, k)).to_array(),
            None => to_light,
        }
    }
}

/// A light before it is packed.
pub(super) enum Loose<'a> {
    /// A light, or a part of a ball.
    Light(&'a Light, LampShape),
    /// A cluster of emissive triangles.
    Emitter(&'a Emitter),
}

impl Loose<'_> {
    /// Where the light is.
    pub fn position(&self) -> Vec3 {
        match self {
            Self::Light(light, _) => light.position,
            Self::Emitter(emitter) => emitter.position,
        }
    }

    /// Lights of a kind share chunks.
    pub fn class(&self) -> u8 {
        match self {
            Self::Light(Light { kind: LightKind::Point, .. }, _) => 0,
            Self::Light(Light { kind: LightKind::Ball { .. }, .. }, _) => 1,
            Self::Light(..) => 2,
            Self::Emitter(_) => 3,
        }
    }

    /// Numbers of the groups of the lights that stand for a scene's.
    pub fn groups_of(scene: &Scene) -> Vec<u16> {
        // The parts of a light follow each other, from number 0 on.
        let mut begun = 0;
        let group = |light: Loose| {
            begun += usize::from(!matches!(light, Loose::Light(_, LampShape::Ball { part: (1.., _), .. })));
            scene.light_groups.of(begun.saturating_sub(1))
        };
        Loose::of(&scene.lights).map(group).collect()
    }

    /// The lights that stand for some lights.
    pub fn of(lights: &[Light]) -> impl Iterator<Item = Loose<'_>> {
        let balls = lights.iter().filter(|light| matches!(light.kind, LightKind::Ball { .. })).count();
        lights.iter().flat_map(move |light| {
            let (radius, parts) = match light.kind {
                LightKind::Ball { radius } => (Some(radius), ball_parts(balls)),
                _ => (None, 1),
            };
            (0..parts).map(move |number| {
                let part = (number, parts);
                let shape = radius.map_or(LampShape::Point, |radius| LampShape::Ball { radius, part });
                Loose::Light(light, shape)
            })
        })
    }
}
