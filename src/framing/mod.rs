//! The view of a model that brings no camera: chosen by what rays find, the same every time.
//!
//! A model that is looked at, such as a figure, is framed from outside. A model that is lived in, such as a room, shows
//! nothing from outside: it is seen through its open side if it has one, otherwise from where much of it is in view.
//! Which of the two it is, lines through the model tell.

mod inside;
mod lamps;
mod outside;
mod probe;

use self::probe::Probe;
use crate::accel::{Accel, Backend};
use crate::scene::load::OpenedScene;
use crate::scene::{Camera, PointLight};
use crate::with_accel;

/// Gives a scene without a camera one, and a bare model without lights some; says so in [`OpenedScene::choices`].
pub fn complete_view(opened: &mut OpenedScene, backend: &Backend) {
    let OpenedScene { loaded, choices, bare } = opened;
    let lacks_lights = *bare && loaded.scene.lights.is_empty();
    let (width, height) = loaded.settings.resolution;
    let aspect = width as f32 / height as f32;
    if loaded.cameras.is_empty() {
        let view = with_accel!(backend, accel => {
            choose(&Probe { accel, scene: &loaded.scene, bounds: loaded.scene.bounds() }, aspect)
        });
        choices.push(format!("no camera in the file: {}", view.how));
        loaded.cameras.push(view.camera);
        if lacks_lights && !view.lamps.is_empty() {
            choices.push(format!("no lights in the file: {} lamps in its rooms", view.lamps.len()));
            loaded.scene.lights = view.lamps;
            return;
        }
    }
    if let Some(camera) = loaded.cameras.first()
        && lacks_lights
    {
        loaded.scene.lights = lamps::directional(camera);
        choices.push(format!("no lights in the file: {} directional ones", loaded.scene.lights.len()));
    }
}

/// What was chosen.
struct View {
    camera: Camera,
    /// In words.
    how: &'static str,
    /// Lights for rooms that sunlight doesn't reach.
    lamps: Vec<PointLight>,
}

/// Share of a position's surroundings that must be fronts for it to be enclosed: five sides of a box are more.
const ENCLOSED: f32 = 0.75;
/// Share of the lines through a model that pass through enclosed room, from which it counts as lived in.
const LIVED_IN: f32 = 0.5;
/// Rooms without ceilings: the same two shares, if more than a share of what is seen from outside are backs.
const OPEN_ABOVE: (f32, f32, f32) = (0.5, 0.1, 0.2);

fn choose<A: Accel>(probe: &Probe<A>, aspect: f32) -> View {
    let front = outside::from_the_front(probe, aspect);
    let rooms = probe.rooms();
    let (open, lived_in, backs) = OPEN_ABOVE;
    let eyes = if rooms.share(ENCLOSED) >= LIVED_IN {
        rooms.enclosed(ENCLOSED)
    } else if rooms.share(open) >= lived_in && outside::backs(probe, &front) >= backs {
        rooms.enclosed(open)
    } else {
        return View { camera: front, how: "one that frames the model", lamps: Vec::new() };
    };
    let lamps = lamps::in_rooms(probe, &eyes);
    if let Some(camera) = outside::through_an_open_side(probe, aspect) {
        return View { camera, how: "one that looks in through the open side", lamps };
    }
    match inside::best_view(probe, &eyes, aspect) {
        Some(camera) => View {
            how: "one inside, where much is in view",
            lamps: lamps::with_one_at(&camera, lamps),
            camera,
        },
        None => View { camera: front, how: "one that frames the model", lamps },
    }
}
