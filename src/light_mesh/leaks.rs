//! Keeping light from leaking through walls, and darkness out of solids (method §3).

use glam::Vec3;

use super::points::Neighbours;
use crate::accel::{Accel, Coherence, PacketLanes, RayHitPacket, RayPacket, hit_of_lane};
use crate::scene::{Ray, Scene, SurfacePoint};
use crate::settings::Leaks;
use crate::simd::LANES;

/// Directions in which a mesh point looks for back faces: towards the faces and corners of a cube, turned so that
/// none is parallel to axis-aligned walls.
pub const PROBES: usize = 14;

/// A point lies inside of something when more than this share of its probes end at the back of a one-sided surface. In
/// the open even a crowd of single leaves shows about as many fronts as backs.
const INSIDE_SHARE: f32 = 0.7;

fn probe(index: usize) -> Vec3 {
    let corner = match index {
        0..6 => Vec3::AXES[index / 2] * if index.is_multiple_of(2) { 1.0 } else { -1.0 },
        _ => {
            let sign = |bit: usize| if index >> bit & 1 == 1 { 1.0 } else { -1.0 };
            Vec3::new(sign(0), sign(1), if index < 10 { 1.0 } else { -1.0 })
        }
    };
    // A fixed rotation by an odd angle about an odd axis.
    glam::Quat::from_axis_angle(Vec3::new(0.36, 0.48, 0.8), 0.83) * corner.normalize()
}

/// Whether a mesh point lies inside of geometry, judged by the share of back faces that it sees.
pub fn is_inside<A: Accel>(accel: &A, scene: &Scene, x: Vec3) -> bool {
    let mut packet = RayHitPacket::<LANES>::empty();
    for lane in 0..PROBES {
        packet.set_lane(lane, &Ray::new(x, probe(lane)));
    }
    accel.intersect_packet((1 << PROBES) - 1, &mut packet, Coherence::Incoherent);
    let shows_back = |lane: usize| {
        hit_of_lane(&packet, lane).is_some_and(|hit| scene.interaction(&hit, probe(lane)).shows_back())
    };
    is_inside_by_share((0..PROBES).filter(|&lane| shows_back(lane)).count(), PROBES)
}

/// Whether `backs` back faces in so many directions say that the point is inside.
pub fn is_inside_by_share(backs: usize, directions: usize) -> bool {
    backs as f32 > INSIDE_SHARE * directions as f32
}

/// Ratio of the amounts of light at neighbouring mesh points that calls for a look: points of one room rarely differ as
/// much, points on both sides of a wall mostly do.
const CONTRAST: f32 = 2.0;

/// Whether mesh points get so different amounts of light that a wall may stand between them.
#[inline(always)]
pub fn amounts_differ(amounts: impl Iterator<Item = f32>) -> bool {
    let (least, most) =
        amounts.fold((f32::INFINITY, 0.0f32), |(least, most), amount| (least.min(amount), most.max(amount)));
    most > CONTRAST * least
}

/// Whether mesh points see so different lights that a wall may stand between them: of the lights that any of them sees,
/// less than one in `SHARED` is seen by all. A few leaves in the way don't do that where there are many lights. The lights are given in parts, by how many all see and how
/// many any.
#[inline(always)]
pub fn lights_differ(parts: impl Iterator<Item = (u32, u32)>) -> bool {
    /// See above.
    const SHARED: u32 = 4;
    let (by_all, by_any) = parts.fold((0, 0), |(by_all, by_any), (all, any)| (by_all + all, by_any + any));
    by_all * SHARED < by_any
}

/// Decides which points of D_y count for a surface point, for light meshes and for the reference alike.
pub struct LeakGuard<'a, A> {
    /// Answers rays.
    pub accel: &'a A,
    /// The rule.
    pub leaks: Leaks,
    /// Positions of the points, by slot.
    pub positions: &'a [Vec3],
}

/// What [`LeakGuard::keep_counting`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeakedPoints {
    /// Rays traced.
    pub rays: u64,
    /// Whether no point counts, so that only the first was kept.
    pub all_dropped: bool,
}

impl<A: Accel> LeakGuard<'_, A> {
    /// Keeps those of the points that count; `inside` reports by slot which lie in geometry, `uncertain` whether points
    /// differ so much that it matters which of them the surface point sees.
    #[inline(always)]
    pub fn keep_counting(
        &self,
        surface: &SurfacePoint,
        points: &mut Neighbours,
        inside: impl Fn(u32) -> bool,
        uncertain: impl Fn(&[u32]) -> bool,
    ) -> LeakedPoints {
        let mut leaked = LeakedPoints::default();
        match self.leaks {
            Leaks::Allow => {}
            Leaks::Invalidate => {
                if points.slots().iter().any(|&slot| inside(slot)) && !points.keep(|_, slot| !inside(slot)) {
                    points.keep_first();
                    leaked.all_dropped = true;
                }
            }
            Leaks::Visibility => {
                if uncertain(points.slots()) {
                    leaked.rays = self.keep_visible(surface, points);
                }
            }
        }
        leaked
    }

    /// Keeps those of the points that a surface point sees; returns the number of rays. If it sees none, all stay.
    #[inline(never)]
    fn keep_visible(&self, surface: &SurfacePoint, points: &mut Neighbours) -> u64 {
        let origin = surface.ray_origin();
        let rays = points.slots().len();
        let mut blocked = Vec::with_capacity(rays);
        for slots in points.slots().chunks(LANES) {
            let mut packet = RayPacket::<LANES>::empty();
            for (lane, &slot) in slots.iter().enumerate() {
                packet.set_lane(lane, &Ray::between(origin, self.positions[slot as usize]));
            }
            let active = ((1u64 << slots.len()) - 1) as u32;
            let lanes = self.accel.occluded_packet(active, &mut packet, Coherence::Incoherent);
            blocked.extend((0..slots.len()).map(|lane| lanes >> lane & 1 == 1));
        }
        points.keep(|index, _| !blocked[index]);
        rays as u64
    }
}
