//! The outermost samples of a square of pixels.

use std::f32::consts::PI;

use glam::Vec2;

use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayHitPacket};
use crate::sampling::convex_hull;
use crate::scene::CameraRays;
use crate::simd::LANES;

/// The samples on the convex hull of all samples of a square of pixels, and one in the middle: a packet of rays.
///
/// A half-plane that covers any sample of the square covers one on the hull. Only where pixels have more than 32 samples the hull may have more
/// corners than there is room for; then it lacks those that stand out least, and half-planes may cover one or two samples of the square unseen.
pub struct Outline {
    /// Column, row and sample of each, from the square's upper left pixel on.
    pub samples: Vec<(u32, u32, u32)>,
    /// Those of them in each quarter of the square, row by row.
    pub quarters: [LaneMask; 4],
    /// The box around all samples, in pixels from the square's upper left corner.
    pub bounds: [Vec2; 2],
    /// The widest strip that may pass between these samples, in pixels.
    pub gap: f32,
}

impl Outline {
    /// Of squares of `edge` × `edge` pixels, `edge` being even, which have such samples each.
    pub fn new(edge: u32, samples: &[Vec2]) -> Self {
        let numbers = (0..edge * edge).flat_map(|pixel| {
            (0..samples.len() as u32).map(move |sample| (pixel % edge, pixel / edge, sample))
        });
        let all: Vec<(u32, u32, u32)> = numbers.collect();
        let at = |&(x, y, sample): &(u32, u32, u32)| {
            Vec2::new(x as f32, y as f32) + samples.get(sample as usize).copied().unwrap_or_default()
        };
        let positions: Vec<Vec2> = all.iter().map(at).collect();
        let bounds = positions.iter().fold([Vec2::INFINITY, Vec2::NEG_INFINITY], |[low, high], &position| {
            [low.min(position), high.max(position)]
        });
        let middle = 0.5 * (bounds[0] + bounds[1]);
        let distance = |&index: &usize| positions[index].distance_squared(middle);
        let central = (0..all.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let mut chosen = convex_hull(&positions);
        while chosen.len() >= LANES {
            leave_out_flattest(&mut chosen, &positions);
        }
        chosen.extend(central);
        let corners: Vec<Vec2> = chosen.iter().map(|&index| positions[index]).collect();
        let samples: Vec<(u32, u32, u32)> = chosen.into_iter().map(|index| all[index]).collect();
        let quarter = |number: u32| {
            let is_in = |&(x, y, _): &(u32, u32, u32)| y / (edge / 2) * 2 + x / (edge / 2) == number;
            let lanes = samples.iter().enumerate().filter(|(_, sample)| is_in(sample));
            lanes.fold(0, |mask, (lane, _)| mask | 1 << lane)
        };
        Self { quarters: [0, 1, 2, 3].map(quarter), samples, bounds, gap: widest_gap(&corners) }
    }

    /// Traces the outermost samples of a square of pixels, given by its upper left one, and counts them.
    #[inline(always)]
    pub fn trace<A: Accel>(
        &self,
        accel: &A,
        camera: &CameraRays,
        (left, top): (u32, u32),
        rays: &mut u64,
    ) -> RayHitPacket<LANES> {
        let mut packet = RayHitPacket::<LANES>::empty();
        for (lane, &(x, y, sample)) in self.samples.iter().enumerate() {
            packet.set_lane(lane, &camera.ray(left + x, top + y, sample));
        }
        *rays += self.samples.len() as u64;
        accel.intersect_packet(self.lanes(), &mut packet, Coherence::Coherent);
        packet
    }

    /// The lanes of a packet that the samples take.
    #[inline(always)]
    pub fn lanes(&self) -> LaneMask {
        ((1u64 << self.samples.len()) - 1) as LaneMask
    }
}

/// Leaves out the corner of a convex outline that makes the smallest triangle with its neighbours.
fn leave_out_flattest(outline: &mut Vec<usize>, positions: &[Vec2]) {
    let count = outline.len();
    let area = |&corner: &usize| {
        let [before, at, after] =
            [corner + count - 1, corner, corner + 1].map(|corner| positions[outline[corner % count]]);
        (at - before).perp_dot(after - at)
    };
    if let Some(flattest) = (0..count).min_by(|a, b| area(a).total_cmp(&area(b))) {
        outline.remove(flattest);
    }
}

/// The widest strip between points that has some on both sides.
fn widest_gap(points: &[Vec2]) -> f32 {
    /// Directions of strips that are looked at.
    const DIRECTIONS: u32 = 360;
    let in_direction = |step: u32| {
        let across = Vec2::from_angle(step as f32 * PI / DIRECTIONS as f32);
        let mut along: Vec<f32> = points.iter().map(|point| across.dot(*point)).collect();
        along.sort_unstable_by(f32::total_cmp);
        along.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f32::max)
    };
    (0..DIRECTIONS).map(in_direction).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{PixelFilter, ViewSettings};

    /// Whatever a straight edge cuts off a square, if it holds a sample it holds an outermost one: else rays at the outline would say nothing of
    /// those between.
    #[test]
    fn no_straight_edge_cuts_off_inner_samples_alone() {
        for (filter, samples_per_pixel, most) in
            [(PixelFilter::Box, 16, 1e-5), (PixelFilter::Gaussian, 16, 1e-5), (PixelFilter::Box, 64, 0.02)]
        {
            let view = ViewSettings { samples_per_pixel, filter, ..ViewSettings::default() };
            let samples = &view.samples()[..samples_per_pixel as usize];
            for edge in [2, 4] {
                let outline = Outline::new(edge, samples);
                assert!(outline.samples.len() <= LANES);
                for step in 0..360 {
                    let normal = Vec2::from_angle((step as f32).to_radians());
                    let along = |x: u32, y: u32, sample: u32| {
                        normal.dot(Vec2::new(x as f32, y as f32) + samples[sample as usize])
                    };
                    let pixels = (0..edge * edge).map(|pixel| (pixel % edge, pixel / edge));
                    let farthest = pixels
                        .flat_map(|(x, y)| (0..samples_per_pixel).map(move |sample| along(x, y, sample)))
                        .fold(f32::NEG_INFINITY, f32::max);
                    let outer = outline.samples.iter().map(|&(x, y, sample)| along(x, y, sample));
                    let outer = outer.fold(f32::NEG_INFINITY, f32::max);
                    assert!(outer >= farthest - most, "{filter}, {edge}, {step}°: {outer} of {farthest}");
                }
            }
        }
    }

    /// A disc of points around a middle one leaves strips as wide as its radius.
    #[test]
    fn the_widest_gap_is_that_from_the_middle_to_the_outline() {
        let circle = (0..64).map(|step| 2.0 * Vec2::from_angle(step as f32 * PI / 32.0));
        let points: Vec<Vec2> = circle.filter(|point| point.x.abs() > 1.5).chain([Vec2::ZERO]).collect();
        // Straight up and down, from the middle to the ends of both arcs.
        assert!((widest_gap(&points) - 1.5).abs() < 0.1, "{}", widest_gap(&points));
    }
}
