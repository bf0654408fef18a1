//! Direct light of surfaces that indirect mesh points see.

use std::f32::consts::PI;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayPacket};
use crate::lights::{IncidentLights, LightChunk, PackedLights};
use crate::sampling::hash_to_unit_cube;
use crate::scene::{Falloff, Ray, SurfacePoint};
use crate::simd::{LANES, Lanes};

/// A light that may be asked about.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Candidate {
    /// Its index in the packed lights.
    pub light: u32,
    /// One over the probability with which it was chosen.
    pub weight: f32,
}

/// I at single surface points, from at most 16 occlusion rays each.
#[derive(Default)]
pub struct DirectLight {
    /// By point and light, in the order of the packed lights: what a light gives the point if nothing stands in its way.
    unoccluded: Vec<f32>,
    /// Points and lights that a ray is traced between, as indices of the above, and what their light is multiplied by.
    chosen: Vec<(usize, f32)>,
    /// Length of the rows of `unoccluded`.
    row: usize,
    /// Rays traced.
    pub rays: u64,
}

impl DirectLight {
    /// I at a surface point that stands for a square around it of the given width: Σ_i V_i · φ2 · E_i / φ1.
    ///
    /// With inverse-square falloff, close to a light that single point may get many times what the square does on average. As the
    /// light comes down to it, a disc of area w² gets as much as a point at a distance of w/√2π; so distances d count as
    /// (d⁴ + (w²/2π)²)^¼, which changes them by a thousandth from 2 w on.
    ///
    /// Where more than 16 lights lie above the horizon, 16 rays are dealt out among them in proportion to what each would give, at equal
    /// steps through their sum from a start that belongs to the position, so that the mean over all starts is I.
    #[inline(always)]
    pub fn at<A: Accel>(
        &mut self,
        accel: &A,
        lights: &PackedLights,
        surface: &SurfacePoint,
        width: f32,
    ) -> Vec3 {
        self.mean(accel, lights, &[*surface], width).0
    }

    /// Mean of I over some surface points, each of which stands for a square around it, and how uneven it is: the difference between the
    /// most and the least, over the mean, 0 where all is dark.
    #[inline(always)]
    pub fn mean<A: Accel, const N: usize>(
        &mut self,
        accel: &A,
        lights: &PackedLights,
        surfaces: &[SurfacePoint; N],
        width: f32,
    ) -> (Vec3, f32) {
        self.unoccluded.clear();
        for surface in surfaces {
            self.add_unoccluded(lights, surface, Square::POINT);
        }
        let count = lights.chunks().len() * LANES;
        self.row = count;
        let above = self.unoccluded.iter().filter(|&&amount| amount > 0.0).count();
        self.chosen.clear();
        if above <= LANES {
            let above = self.unoccluded.iter().enumerate().filter(|(_, amount)| **amount > 0.0);
            self.chosen.extend(above.map(|(light, _)| (light, 1.0)));
        } else {
            let step = self.unoccluded.iter().sum::<f32>() / LANES as f32;
            // How far it is from the sum of the lights before to the next step.
            let mut ahead = hash_to_unit_cube(surfaces[0].position).x * step;
            for (light, &amount) in self.unoccluded.iter().enumerate() {
                let steps = ((amount - ahead) / step).ceil().clamp(0.0, LANES as f32);
                ahead += steps * step - amount;
                if steps > 0.0 {
                    self.chosen.push((light, steps * step / amount));
                }
            }
            // Rounding may find one more.
            self.chosen.truncate(LANES);
        }
        let mut packet = RayPacket::<LANES>::empty();
        let mut active: LaneMask = 0;
        for (lane, (light, factor)) in self.chosen.iter_mut().enumerate() {
            let origin = surfaces[*light / count].ray_origin();
            let chunk = &lights.chunks()[*light % count / LANES];
            let way = Vec3::from_array(chunk.way(*light % LANES, origin.to_array(), origin, 0));
            *factor *= of_square(lights, way.length_squared(), width);
            packet.set_lane(lane, &Ray { t_far: 1.0, ..Ray::new(origin, way) });
            active |= 1 << lane;
        }
        self.rays += u64::from(active.count_ones());
        let blocked = accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
        let (mut sum, mut amounts) = (Vec3::ZERO, [0.0f32; N]);
        for (lane, &(light, factor)) in self.chosen.iter().enumerate() {
            if blocked >> lane & 1 == 1 {
                self.unoccluded[light] *= HIDDEN;
            } else {
                let intensity = Vec3::from_array(lights.intensity(light % count / LANES, light % LANES));
                let amount = self.unoccluded[light] * factor;
                amounts[light / count] += amount;
                sum += intensity * (amount / intensity.element_sum());
            }
        }
        let most = amounts.iter().copied().fold(0.0, f32::max);
        let least = amounts.iter().copied().fold(most, f32::min);
        let count = N as f32;
        let unevenness = if most > 0.0 { (most - least) * count / amounts.iter().sum::<f32>() } else { 0.0 };
        (sum / count, unevenness)
    }

    #[inline(always)]
    fn add_unoccluded(&mut self, lights: &PackedLights, surface: &SurfacePoint, square: Square) {
        let amounts = &mut self.unoccluded;
        lights.incident_at(surface.position, &mut Unoccluded { lights, surface, square, amounts });
    }

    /// The light that a number in [0, 1) chooses: evenly spread numbers choose lights by what they would give the surface, which stands for a square.
    /// `None` if none lies above its horizon.
    #[inline(always)]
    pub fn choose(
        &mut self,
        lights: &PackedLights,
        surface: &SurfacePoint,
        square: Square,
        number: f32,
    ) -> Option<Candidate> {
        self.unoccluded.clear();
        self.add_unoccluded(lights, surface, square);
        let sum = self.unoccluded.iter().sum::<f32>();
        let mut left = number * sum;
        let chosen = self.unoccluded.iter().position(|&amount| {
            let here = amount > 0.0 && left < amount;
            left -= amount;
            here
        });
        // Rounding may pass them all by.
        let light = chosen.or_else(|| self.unoccluded.iter().rposition(|&amount| amount > 0.0))?;
        Some(Candidate { light: light as u32, weight: sum / self.unoccluded[light] })
    }

    /// After [`Self::mean`], of the lights above the horizon of some of the surface points: their indices and what they may give all of them
    /// together, of which those that were seen to be hidden count a part.
    pub fn amounts(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let amount = |light: usize| self.unoccluded.iter().skip(light).step_by(self.row).sum::<f32>();
        (0..self.row).map(move |light| (light as u32, amount(light))).filter(|(_, amount)| *amount > 0.0)
    }
}

/// What a square of the given width gets on average of what a single point gets from a light at a distance, given squared (see
/// [`DirectLight::at`]).
#[inline(always)]
fn of_square(lights: &PackedLights, squared: f32, width: f32) -> f32 {
    let near = width * width / (2.0 * PI);
    // Further away they are the same to a part in a million.
    if lights.falloff() == Falloff::InverseSquare && squared < 1e3 * near {
        squared / squared.hypot(near)
    } else {
        1.0
    }
}

/// A square of surface that one ray stands for, wherever in it the ray ends.
///
/// Close to a light of inverse-square falloff the point may get many times what the square gets on average, or nearly nothing beside the light's foot. So
/// lights are lifted: one at height h above the surface counts as if it were at √(h² + w²/2π). As it comes down, the point below it gets what a
/// disc of area w² gets from it on average, and all of the surface gets as much light as before, which no limit on single points keeps.
#[derive(Clone, Copy, Debug)]
pub struct Square {
    /// w²/2π, 0 where the falloff is another.
    lift: f32,
}

/// Lift over squared distance beyond which nothing changes but the size of numbers.
const MOST_LIFTED: f32 = 1e12;

/// Lights closer to the horizon are not lifted: rounding would decide what they give.
const LEAST_COSINE: f32 = 1e-4;

impl Square {
    /// Of no width.
    pub const POINT: Self = Self { lift: 0.0 };

    /// Of the given width, under some lights.
    #[inline(always)]
    pub fn new(lights: &PackedLights, width: f32) -> Self {
        let inverse_square = lights.falloff() == Falloff::InverseSquare;
        Self { lift: if inverse_square { width * width / (2.0 * PI) } else { 0.0 } }
    }

    /// What takes the place of the cosine at a light's squared distance.
    #[inline(always)]
    fn cosine(self, cosine: f32, squared: f32) -> f32 {
        let lifted = (self.lift / squared.max(f32::MIN_POSITIVE)).min(MOST_LIFTED);
        let beyond = 1.0 / (1.0 + lifted);
        (cosine * cosine + lifted).sqrt() * beyond * beyond.sqrt()
    }

    /// What light from a lane of a chunk that was found for a point above whose horizon it lies is multiplied by.
    #[inline(always)]
    pub fn factor(self, chunk: &LightChunk, lane: usize, surface: &SurfacePoint) -> f32 {
        let way = Vec3::from_array(chunk.to_light(lane, surface.position.to_array()));
        let squared = way.length_squared();
        let cosine = surface.shading_normal.dot(way) / squared.sqrt().max(f32::MIN_POSITIVE);
        if cosine > LEAST_COSINE { self.cosine(cosine, squared) / cosine } else { 1.0 }
    }
}

/// Part of what a hidden light would give that is still expected of it nearby.
const HIDDEN: f32 = 0.2;

/// Writes what lights give a surface without occluders: the sum of the colours.
struct Unoccluded<'a> {
    lights: &'a PackedLights,
    surface: &'a SurfacePoint,
    square: Square,
    amounts: &'a mut Vec<f32>,
}

impl IncidentLights for Unoccluded<'_> {
    #[inline(always)]
    fn chunk(&mut self, index: usize, direction: &[Lanes; 3], reciprocal: &Lanes) {
        let chunk = &self.lights.chunks()[index];
        let [r, g, b] = &chunk.intensity;
        let (n, h) = (self.surface.shading_normal, self.surface.geometric_normal);
        let squared = chunk.squared_distances(self.surface.position);
        let mut amounts = [0.0; LANES];
        for lane in 0..LANES {
            let [x, y, z] = [direction[0][lane], direction[1][lane], direction[2][lane]];
            let cosine = n.x * x + n.y * y + n.z * z;
            let side = h.x * x + h.y * y + h.z * z;
            let lifted = self.square.cosine(cosine, squared[lane]);
            let lit = if side > 0.0 && cosine > 0.0 { lifted } else { 0.0 };
            amounts[lane] = (r[lane] + g[lane] + b[lane]) * reciprocal[lane] * lit;
        }
        self.amounts.extend_from_slice(&amounts);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::BruteForceAccel;
    use crate::lights::Unoccluded as AllSeen;
    use crate::scene::{Light, Scene};

    fn lights(count: usize) -> PackedLights {
        let at = |i: usize| Vec3::new((i % 7) as f32 - 3.0, 1.0 + (i % 3) as f32, (i / 7) as f32 - 2.0);
        let lights: Vec<Light> =
            (0..count).map(|i| Light::point(at(i), Vec3::new(1.0, 0.5, (i % 4) as f32))).collect();
        PackedLights::new(&lights, Falloff::InverseSquare, 0.0)
    }

    fn nothing() -> BruteForceAccel {
        BruteForceAccel::new(&Scene::default())
    }

    /// Of up to 16 lights above the horizon each has its ray, and none that is below it.
    #[test]
    fn few_lights_are_summed_exactly() {
        let (accel, lights) = (nothing(), lights(16));
        for normal in [Vec3::Y, Vec3::X, Vec3::NEG_Y] {
            let surface = SurfacePoint::flat(Vec3::new(0.1, 0.0, 0.2), normal);
            let mut direct = DirectLight::default();
            let found = direct.at(&accel, &lights, &surface, 0.0);
            assert!(found.abs_diff_eq(lights.irradiance(&surface, AllSeen), 1e-4), "{normal}: {found}");
        }
        let below = SurfacePoint::flat(Vec3::ZERO, Vec3::NEG_Y);
        let mut direct = DirectLight::default();
        assert_eq!((direct.at(&accel, &lights, &below, 0.0), direct.rays), (Vec3::ZERO, 0));
    }

    /// Of many lights 16 rays make an estimate whose mean over many places is that of the sum of all.
    #[test]
    fn many_lights_are_summed_on_average() {
        let (accel, lights) = (nothing(), lights(60));
        let (mut found, mut expected, mut direct) = (Vec3::ZERO, Vec3::ZERO, DirectLight::default());
        for i in 0..2000 {
            let surface = SurfacePoint::flat(Vec3::new(1e-5 * i as f32, 0.0, 0.0), Vec3::Y);
            found += direct.at(&accel, &lights, &surface, 0.0);
            expected += lights.irradiance(&surface, AllSeen);
        }
        assert!(direct.rays <= 2000 * 16);
        assert!((found / expected - 1.0).abs().max_element() < 0.01, "{found} for {expected}");
    }

    /// Without a cell's advice, too, one light at a time makes all the light.
    #[test]
    fn one_light_at_a_time_is_all_of_them() {
        let lights = lights(60);
        let surface = SurfacePoint::flat(Vec3::new(0.1, 0.0, 0.2), Vec3::Y);
        let (mut direct, mut found, numbers) = (DirectLight::default(), Vec3::ZERO, 5000);
        let square = Square::new(&lights, 0.0);
        for number in 0..numbers {
            let number = (number as f32 + 0.5) / numbers as f32;
            let chosen = direct.choose(&lights, &surface, square, number).expect("lights above");
            let (chunk, lane) = (chosen.light as usize / LANES, chosen.light as usize % LANES);
            let intensity = Vec3::from_array(lights.intensity(chunk, lane));
            found += intensity * lights.factor(chunk, lane, &surface) * chosen.weight / numbers as f32;
        }
        let expected = lights.irradiance(&surface, AllSeen);
        assert!((found / expected - 1.0).abs().max_element() < 0.005, "{found} for {expected}");
        let below = SurfacePoint::flat(Vec3::ZERO, Vec3::NEG_Y);
        assert!(direct.choose(&lights, &below, square, 0.5).is_none());
    }

    /// At the foot of a lamp, low above the floor, a point gets what a disc around it gets on average: 2I/a² · (1 − h/√(h² + a²)), with
    /// area πa² = w².
    #[test]
    fn close_to_a_light_the_mean_of_the_square_counts() {
        let width = 0.4f32;
        for height in [0.001f32, 0.01, 2.0] {
            let lamp = Light::point(Vec3::new(0.0, height, 0.0), Vec3::ONE);
            let lights = PackedLights::new(&[lamp], Falloff::InverseSquare, 0.0);
            let floor = SurfacePoint::flat(Vec3::ZERO, Vec3::Y);
            let found = DirectLight::default().at(&nothing(), &lights, &floor, width).x;
            let squared = width * width / PI;
            let expected = 2.0 / squared * (1.0 - height / (height * height + squared).sqrt());
            assert!((found / expected - 1.0).abs() < 0.06, "{found} for {expected} at {height}");
        }
    }

    /// However low a lamp is above a floor, and however few rays end on that, on average they bring along all that it sends there: the solid angle of a
    /// square of edge 2a from height h above its middle, 4 atan(a²/(h √(2a² + h²))).
    #[test]
    fn low_lamps_give_a_floor_what_they_send() {
        let (width, count) = (0.4f32, 30);
        for height in [0.003f32, 0.1, 0.5] {
            let lamp = Light::point(Vec3::new(0.0, height, 0.0), Vec3::ONE);
            let lights = PackedLights::new(&[lamp], Falloff::InverseSquare, 0.0);
            let square = Square::new(&lights, width);
            // Five by five rays in each square.
            let place = |i: i32| ((i as f32 + 0.5) / 5.0 - 0.5 * count as f32) * width;
            let light = |i: i32| {
                let place = Vec3::new(place(i % (5 * count)), 0.0, place(i / (5 * count)));
                let surface = SurfacePoint::flat(place, Vec3::Y);
                lights.factor(0, 0, &surface) * square.factor(&lights.chunks()[0], 0, &surface)
            };
            let found = (0..25 * count * count).map(light).sum::<f32>() * width * width / 25.0;
            let a = 0.5 * width * count as f32;
            let expected = 4.0 * (a * a / (height * (2.0 * a * a + height * height).sqrt())).atan();
            assert!((found / expected - 1.0).abs() < 0.06, "{found} for {expected} at {height}");
        }
    }
}
