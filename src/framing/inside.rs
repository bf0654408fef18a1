//! Views from inside.

use std::f32::consts::TAU;

use glam::Vec3;

use super::probe::Probe;
use crate::accel::Accel;
use crate::scene::Camera;

/// Vertical field of view, degrees: wider than from outside, for rooms are near.
const FOV: f32 = 60.0;
/// Positions that are tried.
const EYES: usize = 64;
/// Directions around a position that are looked along, and views that are made of them.
const COLUMNS: usize = 48;
/// Slopes of the rays of a column: they fill the field of view.
const SLOPES: [f32; 7] = [-0.48, -0.32, -0.16, 0.0, 0.16, 0.32, 0.48];
/// What surfaces that no light reaches count for, if the model has lights.
const DARK: f32 = 0.25;

/// The level view from one of the positions in which the most is to be seen.
///
/// What a ray adds is ln(1 + distance in hundredths of the diagonal): depth counts, but does not outweigh everything. Backs
/// and the outside count nothing, what is dark a part. A view is worth the mean of its rays times their standard
/// deviation, so that neither a wall right ahead nor one far ahead wins, but near and far together.
pub fn best_view<A: Accel>(probe: &Probe<A>, eyes: &[Vec3], aspect: f32) -> Option<Camera> {
    let half_width = ((FOV.to_radians() * 0.5).tan() * aspect).atan();
    let reach = ((half_width / TAU * COLUMNS as f32) as usize).clamp(1, COLUMNS / 2 - 1);
    let direction = |column: usize| {
        let turn = TAU * column as f32 / COLUMNS as f32;
        Vec3::new(turn.sin(), 0.0, turn.cos())
    };
    let views = eyes.iter().take(EYES).flat_map(|&eye| {
        let eye = probe.at_height(eye, 0.5);
        let panorama: Vec<Moments> =
            (0..COLUMNS).map(|column| moments(probe, eye, direction(column))).collect();
        (0..COLUMNS).map(move |column| {
            let in_view = (column + COLUMNS - reach)..=(column + COLUMNS + reach);
            let rays = (SLOPES.len() * (2 * reach + 1)) as f32;
            let [mean, square] = in_view.fold([0.0; 2], |[mean, square], column| {
                let column = panorama[column % COLUMNS];
                [mean + column[0] / rays, square + column[1] / rays]
            });
            (mean * (square - mean * mean).max(0.0).sqrt(), eye, column)
        })
    });
    let (_, eye, column) = views.reduce(|best, other| if other.0 > best.0 { other } else { best })?;
    let forward = direction(column);
    let distance = probe.look(eye, forward).map_or(probe.diagonal(), |sight| sight.distance);
    let target = eye + forward * distance.max(1e-3 * probe.diagonal());
    Some(Camera::look_at(eye, target).with_fov(FOV).named("default"))
}

/// Sums over the rays of a column of what they add, and of its squares.
type Moments = [f32; 2];

fn moments<A: Accel>(probe: &Probe<A>, eye: Vec3, forward: Vec3) -> Moments {
    let unit = 0.01 * probe.diagonal();
    let sights = SLOPES.iter().filter_map(|&slope| probe.look(eye, (forward + Vec3::Y * slope).normalize()));
    let worth = sights.filter(|sight| sight.front).map(|sight| {
        let light = if probe.is_lit(&sight) { 1.0 } else { DARK };
        light * (1.0 + sight.distance / unit).ln()
    });
    worth.fold([0.0; 2], |[sum, squares], worth| [sum + worth, squares + worth * worth])
}
