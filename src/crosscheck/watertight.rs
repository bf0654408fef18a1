//! Whether rays escape from inside closed surfaces.

use std::fmt;

use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;

use super::queries::{BLOCK, GROUP, Query, RayQueries, Subject};
use crate::sampling::SplitMix64;
use crate::scene::{Ray, Scene};

/// Of this many rays one may escape.
const GOAL: u64 = 10_000_000;

/// Directions that are tried to find out how far the walls are.
const PROBES: usize = 1000;

/// What rays are aimed at.
const AIMS: [&str; 3] = ["vertices", "edges", "anywhere"];

/// Rays that escaped from inside a closed scene.
#[derive(Clone, Debug, Serialize)]
pub struct Watertightness {
    /// Counts by backend and aim.
    pub rows: Vec<Escapes>,
}

/// Rays of one backend aimed at one kind of place.
#[derive(Clone, Debug, Serialize)]
pub struct Escapes {
    /// The backend.
    pub backend: String,
    /// What was aimed at.
    pub aim: &'static str,
    /// Rays, each of them traced in every form of query.
    pub rays: u64,
    /// Rays that escaped from one of the queries at least.
    pub escaped: u64,
}

impl Watertightness {
    /// Whether no backend lets more than one ray in 10⁷ escape.
    pub fn is_tight(&self) -> bool {
        self.rows.iter().all(|row| row.escaped * GOAL <= row.rays)
    }
}

impl fmt::Display for Watertightness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:<16} {:<10} {:>11} {:>11} {:>10}", "backend", "aimed at", "rays", "escaped", "share")?;
        self.rows.iter().try_for_each(|Escapes { backend, aim, rays, escaped }| {
            let share = *escaped as f64 / (*rays).max(1) as f64;
            writeln!(f, "{backend:<16} {aim:<10} {rays:>11} {escaped:>11} {share:>10.1e}")
        })
    }
}

/// Shoots rays from around `inside`, a point that the scene is closed around, and counts those that escape.
///
/// They start from a ball with a quarter of the distance to the nearest wall, and are aimed at vertices, at points of
/// edges, and in all directions, a third each. The result depends on scene, point, number and seed alone.
pub fn watertightness(
    scene: &Scene,
    subjects: &[Subject],
    inside: Vec3,
    rays: u64,
    seed: u64,
) -> Watertightness {
    let Some(first) = subjects.first() else { return Watertightness { rows: Vec::new() } };
    let radius = 0.25 * distance_to_walls(first.accel, inside);
    let placed: Vec<_> = scene
        .instances
        .iter()
        .filter(|instance| {
            scene.meshes.get(instance.mesh as usize).is_some_and(|mesh| !mesh.triangles.is_empty())
        })
        .collect();
    let each = rays.div_ceil(AIMS.len() as u64);
    let blocks_per_aim = each.div_ceil(BLOCK);
    let escaped: Vec<_> = (0..blocks_per_aim * AIMS.len() as u64)
        .into_par_iter()
        .map(|block| {
            let aim = (block / blocks_per_aim) as usize;
            let count = BLOCK.min(each - block % blocks_per_aim * BLOCK);
            let mut random = SplitMix64::new(seed ^ SplitMix64::new(block).next());
            let rays: Vec<_> = (0..count)
                .map(|_| {
                    let origin = inside + radius * in_ball(&mut random);
                    let instance = placed.get(random.next() as usize % placed.len().max(1));
                    let target = match (aim, instance) {
                        (2, _) | (_, None) => origin + in_ball(&mut random),
                        (_, Some(instance)) => {
                            let mesh = &scene.meshes[instance.mesh as usize];
                            let corners = mesh.corners((random.next() % mesh.triangles.len() as u64) as u32);
                            let corners =
                                corners.map(|p| instance.to_world.map_or(p, |map| map.transform_point3(p)));
                            let first = random.next() as usize % 3;
                            let along = random.between(0.01, 0.99);
                            if aim == 0 {
                                corners[first]
                            } else {
                                corners[first].lerp(corners[(first + 1) % 3], along)
                            }
                        }
                    };
                    Ray::new(origin, target - origin)
                })
                .collect();
            let escaped: Vec<u64> =
                subjects.iter().map(|subject| count_escapes(subject.accel, &rays)).collect();
            (aim, count, escaped)
        })
        .collect();
    let mut rows = Vec::new();
    for (number, subject) in subjects.iter().enumerate() {
        for (aim, name) in AIMS.into_iter().enumerate() {
            let of_aim = escaped.iter().filter(|(other, _, _)| *other == aim);
            let (rays, escaped) =
                of_aim.fold((0, 0), |(r, e), (_, count, escaped)| (r + count, e + escaped[number]));
            rows.push(Escapes { backend: subject.name.to_owned(), aim: name, rays, escaped });
        }
    }
    Watertightness { rows }
}

fn distance_to_walls(accel: &dyn RayQueries, inside: Vec3) -> f32 {
    let mut random = SplitMix64::new(1);
    let hits = (0..PROBES).filter_map(|_| {
        let ray = Ray::new(inside, in_ball(&mut random).normalize_or(Vec3::X));
        accel.closest(&ray).map(|hit| hit.t)
    });
    Some(hits.fold(f32::INFINITY, f32::min)).filter(|t| t.is_finite()).unwrap_or(0.0)
}

fn count_escapes(accel: &dyn RayQueries, rays: &[Ray]) -> u64 {
    let of_group = |(number, rays): (usize, &[Ray])| {
        let mut escaped = [false; GROUP];
        for query in Query::all() {
            for (escaped, answer) in escaped.iter_mut().zip(accel.trace(query, number, rays).answers) {
                *escaped |= !answer.is_hit();
            }
        }
        escaped.into_iter().filter(|escaped| *escaped).count() as u64
    };
    rays.chunks(GROUP).enumerate().map(of_group).sum()
}

/// Uniform in the unit ball, without its middle.
fn in_ball(random: &mut SplitMix64) -> Vec3 {
    loop {
        let point = random.in_box(Vec3::NEG_ONE, Vec3::ONE);
        let length = point.length();
        if length > 1e-3 && length <= 1.0 {
            return point;
        }
    }
}
