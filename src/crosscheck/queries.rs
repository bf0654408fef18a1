//! The forms of ray query, and how lists of rays are put through them.

use crate::accel::{Accel, Coherence, LaneMask, PacketLanes, RayHitPacket, RayPacket, hit_of_lane};
use crate::scene::{Hit, Ray};

/// Rays that are made and traced together, all of one kind.
pub const BLOCK: u64 = 4096;

/// Rays that are traced in one go, in all forms of query: what the first reads of a tree is still in the
/// processor's cache for the others.
pub const GROUP: usize = 64;

/// Rays per packet; 1 for single rays.
pub const WIDTHS: [usize; 4] = [1, 4, 8, 16];

/// A form of ray query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Query {
    /// Whether the query is for any hit, or else for the closest one.
    pub occlusion: bool,
    /// One of 1, 4, 8 and 16.
    pub width: usize,
}

impl Query {
    /// All forms.
    pub fn all() -> impl Iterator<Item = Self> {
        [false, true].into_iter().flat_map(|occlusion| WIDTHS.map(|width| Self { occlusion, width }))
    }
}

impl std::fmt::Display for Query {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let what = if self.occlusion { "occlusion" } else { "closest hit" };
        match self.width {
            1 => write!(f, "{what}, single ray"),
            width => write!(f, "{what}, packet of {width}"),
        }
    }
}

/// What a query reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// Of a closest-hit query.
    Closest(Option<Hit>),
    /// Of an occlusion query.
    Occluded(bool),
}

impl Answer {
    /// The hit of a closest-hit query.
    pub(super) fn closest(&self) -> Option<Hit> {
        match self {
            Self::Closest(hit) => *hit,
            Self::Occluded(_) => None,
        }
    }

    /// Whether it reports a hit.
    pub fn is_hit(&self) -> bool {
        match self {
            Self::Closest(hit) => hit.is_some(),
            Self::Occluded(occluded) => *occluded,
        }
    }
}

/// The answers to a list of rays.
#[derive(Default)]
pub struct Answers {
    /// Answers in the order of the rays.
    pub answers: Vec<Answer>,
    /// First rays of packets in which a lane answered that was switched off.
    pub strays: Vec<usize>,
}

/// All queries of an [`Accel`], as an object whose type is not known at compile time.
pub trait RayQueries: Send + Sync {
    /// The answers to all rays, traced one by one or in packets.
    fn trace(&self, query: Query, group: usize, rays: &[Ray]) -> Answers;
    /// The closest hit of one ray.
    fn closest(&self, ray: &Ray) -> Option<Hit>;
}

impl<A: Accel> RayQueries for A {
    fn trace(&self, query: Query, group: usize, rays: &[Ray]) -> Answers {
        match (query.occlusion, query.width) {
            (false, 4) => closest::<A, 4>(self, group, rays),
            (false, 8) => closest::<A, 8>(self, group, rays),
            (false, 16) => closest::<A, 16>(self, group, rays),
            (true, 4) => occlusion::<A, 4>(self, group, rays),
            (true, 8) => occlusion::<A, 8>(self, group, rays),
            (true, 16) => occlusion::<A, 16>(self, group, rays),
            (false, _) => {
                let answers = rays.iter().map(|ray| Answer::Closest(self.intersect(ray)));
                Answers { answers: answers.collect(), strays: Vec::new() }
            }
            (true, _) => {
                let answers = rays.iter().map(|ray| Answer::Occluded(self.occluded(ray)));
                Answers { answers: answers.collect(), strays: Vec::new() }
            }
        }
    }

    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.intersect(ray)
    }
}

/// A backend under test.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Name in tables.
    pub name: &'a str,
    /// The backend.
    pub accel: &'a dyn RayQueries,
}

/// Cuts rays into packets of `width`, every eighth of them partly filled as the last ones of a list are, with
/// either hint of coherence in turn. The number of the group makes groups start at different places of that
/// sequence.
pub fn packets(width: usize, group: usize, rays: &[Ray]) -> impl Iterator<Item = (usize, &[Ray], Coherence)> {
    // One more than a group has full ones is odd, so that all places have their turn.
    let (mut first, mut number) = (0, group * (GROUP / width + 1));
    std::iter::from_fn(move || {
        let wanted = if number % 8 == 7 { 1 + (number / 8) % width } else { width };
        let coherence = if number % 2 == 0 { Coherence::Coherent } else { Coherence::Incoherent };
        number += 1;
        let packet = rays.get(first..(first + wanted).min(rays.len())).filter(|rays| !rays.is_empty())?;
        let start = first;
        first += packet.len();
        Some((start, packet, coherence))
    })
}

/// Lanes in use, of a packet that holds a first few rays. The lanes behind them repeat the first, so that one that
/// is traced by mistake has something to hit.
fn active(rays: &[Ray]) -> LaneMask {
    (1 << rays.len()) - 1
}

fn closest<A: Accel, const N: usize>(accel: &A, group: usize, rays: &[Ray]) -> Answers {
    let mut answers = Answers { answers: Vec::with_capacity(rays.len()), strays: Vec::new() };
    for (first, rays, coherence) in packets(N, group, rays) {
        let mut packet = RayHitPacket::<N>::empty();
        (0..N).for_each(|lane| packet.set_lane(lane, rays.get(lane).unwrap_or(&rays[0])));
        accel.intersect_packet(active(rays), &mut packet, coherence);
        answers.answers.extend((0..rays.len()).map(|lane| Answer::Closest(hit_of_lane(&packet, lane))));
        if (rays.len()..N).any(|lane| hit_of_lane(&packet, lane).is_some()) {
            answers.strays.push(first);
        }
    }
    answers
}

fn occlusion<A: Accel, const N: usize>(accel: &A, group: usize, rays: &[Ray]) -> Answers {
    let mut answers = Answers { answers: Vec::with_capacity(rays.len()), strays: Vec::new() };
    for (first, rays, coherence) in packets(N, group, rays) {
        let mut packet = RayPacket::<N>::empty();
        (0..N).for_each(|lane| packet.set_lane(lane, rays.get(lane).unwrap_or(&rays[0])));
        let blocked = accel.occluded_packet(active(rays), &mut packet, coherence);
        answers.answers.extend((0..rays.len()).map(|lane| Answer::Occluded(blocked >> lane & 1 != 0)));
        if blocked & !active(rays) != 0 {
            answers.strays.push(first);
        }
    }
    answers
}
