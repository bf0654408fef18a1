//! The lights of a scene, packed for every kind of surface.

use crate::lights::{PackedLights, emitters};
use crate::scene::Scene;
use crate::settings::Settings;

/// The lights of a scene, as integrators take them.
pub(super) struct SceneLights {
    /// Without emissive triangles, whose light comes with that of all other surfaces: the paper's way.
    pub plain: PackedLights,
    /// With those, if there are any, for Lambertian reflectors, which know what radiance is.
    pub with_emitters: Option<PackedLights>,
}

impl SceneLights {
    pub fn of(scene: &Scene) -> Self {
        let emitters = emitters(scene);
        let with_emitters = (!emitters.is_empty()).then(|| PackedLights::with_emitters(scene, &emitters));
        Self { plain: PackedLights::of_scene(scene), with_emitters }
    }

    /// Those that some settings ask for.
    pub fn of_settings(&self, settings: &Settings) -> &PackedLights {
        let with_emitters = self.with_emitters.as_ref().filter(|_| settings.shading.lambertian);
        with_emitters.unwrap_or(&self.plain)
    }
}
