//! The view of a model that brings no camera: chosen by what rays find, the same every time.
//!
//! A model that is looked at, such as a figure, is framed from outside. A model that is lived in, such as a room, shows
//! nothing from outside: it is seen through its open side if it has one, from above if it has no ceiling, cut open if
//! it is a maze, otherwise from where much of it is in view. Lines through the model decide which of them it is.

mod inside;
mod lamps;
mod outside;
mod probe;

use self::probe::Probe;
use crate::accel::{Accel, Backend};
use crate::scene::load::OpenedScene;
use crate::scene::{Camera, Light};

/// What is chosen for a scene that lacks a camera or lights; nothing for one that lacks neither.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChosenView {
    /// The camera of a scene without one.
    pub camera: Option<Camera>,
    /// The lights of a bare model without lights.
    pub lights: Vec<Light>,
    /// Whether the view shows anything only if camera rays pass through the backs of all materials.
    pub cull: bool,
    /// What was chosen, in words.
    pub choices: Vec<String>,
}

impl ChosenView {
    /// The scene with the choices in their places, and in [`OpenedScene::choices`]. Geometry and alpha masks stay as they
    /// are, so that an acceleration structure built before serves the completed scene too.
    pub fn complete(self, mut opened: OpenedScene) -> OpenedScene {
        let OpenedScene { loaded, choices, .. } = &mut opened;
        loaded.cameras.extend(self.camera);
        loaded.scene.lights.extend(self.lights);
        if self.cull {
            loaded.scene.materials.iter_mut().for_each(|material| material.cull = true);
        }
        choices.extend(self.choices);
        opened
    }
}

/// Chooses a camera for a scene without one, and lights for a bare model without lights; `backend` must hold the scene.
pub fn choose_view(opened: &OpenedScene, backend: &Backend) -> ChosenView {
    let OpenedScene { loaded, bare, .. } = opened;
    let lacks_lights = *bare && loaded.scene.lights.is_empty();
    let (width, height) = loaded.settings.view.resolution;
    let aspect = width as f32 / height as f32;
    let mut chosen = ChosenView::default();
    if loaded.cameras.is_empty() {
        let view = {
            let probe = Probe { accel: backend, scene: &loaded.scene, bounds: loaded.scene.bounds() };
            // Materials may be changed for a view of a bare model only, and two-sided ones have no back.
            let can_cull = *bare && loaded.scene.materials.iter().all(|material| !material.two_sided);
            choose(&probe, aspect, can_cull)
        };
        chosen.choices.push(format!("no camera in the file: {}", view.how));
        chosen.camera = Some(view.camera);
        chosen.cull = view.cut_open;
        if lacks_lights && !view.lamps.is_empty() {
            chosen.choices.push(format!("no lights in the file: {} lamps in its rooms", view.lamps.len()));
            chosen.lights = view.lamps;
            return chosen;
        }
    }
    if let Some(camera) = chosen.camera.as_ref().or(loaded.cameras.first())
        && lacks_lights
    {
        chosen.lights = lamps::directional(camera);
        chosen.choices.push(format!("no lights in the file: {} directional ones", chosen.lights.len()));
    }
    chosen
}

/// A camera and what goes with it.
struct View {
    camera: Camera,
    /// In words.
    how: &'static str,
    /// Whether it shows anything only if backs are culled.
    cut_open: bool,
    /// Lights for rooms that sunlight doesn't reach.
    lamps: Vec<Light>,
}

/// Share of a position's surroundings that must be fronts for it to be enclosed: five sides of a box are more.
const ENCLOSED: f32 = 0.75;
/// Share of the lines through a model that pass through enclosed room, from which it counts as lived in.
const LIVED_IN: f32 = 0.5;
/// Rooms without ceilings: the same two shares, if more than a share of what is seen from outside are backs.
const OPEN_ABOVE: (f32, f32, f32) = (0.5, 0.1, 0.2);

/// Rooms that have nothing around them, if at least this share of what is seen from outside are backs.
const BACKS_ONLY: f32 = 0.9;
/// Rooms of which no view from inside shows much: no position sees this share of the others.
const SEEN_AT_ONCE: f32 = 0.5;

/// `can_cull`: whether camera rays may be let through the backs of all materials.
fn choose<A: Accel>(probe: &Probe<A>, aspect: f32, can_cull: bool) -> View {
    let front = outside::from_the_front(probe, aspect);
    let from_outside = |camera, how| View { camera, how, cut_open: false, lamps: Vec::new() };
    let rooms = probe.rooms();
    let backs = outside::backs(probe, &front);
    let (open, lived_in, backs_above) = OPEN_ABOVE;
    let is_closed = rooms.share(ENCLOSED) >= LIVED_IN;
    if !is_closed && (rooms.share(open) < lived_in || backs < backs_above) {
        return from_outside(front, "one that frames the model");
    }
    let positions = rooms.enclosed(if is_closed { ENCLOSED } else { open });
    let lamps = lamps::in_rooms(probe, &positions);
    if let Some(camera) = outside::through_an_open_side(probe, aspect) {
        return View { lamps, ..from_outside(camera, "one that looks in through the open side") };
    }
    if !is_closed {
        return from_outside(outside::from_above(probe, &positions, aspect), "one that looks down into it");
    }
    if can_cull && backs >= BACKS_ONLY && probe.seen_at_once(&positions) < SEEN_AT_ONCE {
        let camera = outside::cut_open(probe, aspect);
        return View { lamps, cut_open: true, ..from_outside(camera, "one that sees the rooms cut open") };
    }
    match inside::best_view(probe, &positions, aspect) {
        Some(camera) => View {
            lamps: lamps::with_one_at(&camera, lamps),
            ..from_outside(camera, "one inside, where much is in view")
        },
        None => View { lamps, ..from_outside(front, "one that frames the model") },
    }
}
