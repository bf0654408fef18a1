//! The light meshes of a scene, and how one render interpolates them.

use glam::Vec3;

use super::known_view::{KnownView, identity};
use super::scene_lights::SceneLights;
use super::stats::RenderStats;
use crate::Bounds;
use crate::light_mesh::direct::{DirectInterpolation, DirectMesh, KeptBits, Motion};
use crate::light_mesh::indirect::{DirectTransport, IndirectInterpolation, IndirectMesh};
use crate::light_mesh::points::{AutoSpacing, MeshError};
use crate::light_mesh::surface::SurfaceMesh;
use crate::lights::PackedLights;
use crate::scene::{Camera, Fingerprint, Scene};
use crate::settings::{
    Estimator, IndirectForm, IndirectSettings, IndirectShading, KernelSettings, PointSettings, Settings,
    Spacing,
};

/// Light meshes of a scene; they keep their values from one render to the next, whatever settings follow.
///
/// Known values are never changed. With several bounces of indirect light, points that a later view adds build on the
/// final values of those that are there, so that views agree with first renders to within the tolerance, not to the bit.
pub struct LightMeshes {
    pub(super) direct: DirectMesh,
    /// One whose points lie elsewhere: by how the two differ, errors are measured (method §10).
    pub(super) other: DirectMesh,
    /// Whether emissive triangles are among the lights that the direct mesh knows.
    has_emitters: bool,
    pub(super) indirect: Option<IndirectMesh>,
    /// Points on surfaces, in the form that has them.
    pub(super) surface: Option<SurfaceMesh>,
    /// What the values of the indirect mesh follow from.
    indirect_identity: Option<IndirectIdentity>,
    /// Views that were rendered, or that a file knows.
    pub(super) views: Vec<KnownView>,
}

/// Where the points of the other mesh lie, in spacings: far from all points of a regular mesh and from the centres of its cells.
const SHIFT: Vec3 = Vec3::new(0.27, 0.72, 0.23);

/// The meshes of indirect light, while others are rendered.
pub(super) struct IndirectLight {
    indirect: Option<IndirectMesh>,
    surface: Option<SurfaceMesh>,
    identity: Option<IndirectIdentity>,
}

/// What the values of an indirect mesh follow from beside geometry and materials: others make it another mesh.
#[derive(Clone, Debug, PartialEq)]
struct IndirectIdentity {
    settings: IndirectSettings,
    /// How hits look up the direct mesh, in the form that does.
    direct: Option<(PointSettings, KernelSettings, Estimator)>,
    direct_scale: f32,
    /// How further bounces interpolate the mesh itself.
    shading: Option<IndirectShading>,
    intensities: Vec<Vec3>,
    background: Vec3,
}

impl IndirectIdentity {
    fn of(settings: &Settings, scene: &Scene) -> Option<Self> {
        let shading = &settings.shading;
        let indirect = settings.mesh.indirect.clone()?;
        Some(Self {
            // Light at surfaces takes nothing from a kernel.
            shading: (indirect.bounces > 1 && indirect.form != IndirectForm::Surface)
                .then(|| shading.indirect.clone()),
            direct: (indirect.form == IndirectForm::Scalar)
                .then(|| (settings.mesh.direct.clone(), shading.kernel.clone(), shading.estimator)),
            direct_scale: shading.direct_scale(),
            intensities: scene.lights.iter().map(|light| light.intensity).collect(),
            background: scene.background,
            settings: indirect,
        })
    }
}

/// How one render interpolates the light meshes.
pub struct MeshInterpolation {
    pub(super) direct: DirectInterpolation,
    pub(super) indirect: Option<IndirectInterpolation>,
    /// What I(y) is multiplied by before k_d.
    pub(super) direct_scale: f32,
    /// Whether lights on which mesh points disagree are traced.
    pub(super) hybrid: bool,
    /// What may be wrong with a pixel that is traced in part, as a share of its light.
    pub(super) tolerance: f32,
    /// What interpolation of averaged light between pixels may change, as a share of it.
    pub(super) pixel_tolerance: f32,
}

impl MeshInterpolation {
    /// How surfaces send on direct light.
    pub(super) fn transport(&self) -> DirectTransport<'_> {
        DirectTransport { interpolation: &self.direct, scale: self.direct_scale }
    }
}

impl LightMeshes {
    /// Meshes over a scene of the given bounds, with no point known.
    pub fn new(bounds: Bounds) -> Self {
        Self {
            direct: DirectMesh::new(bounds),
            other: DirectMesh::shifted(bounds, SHIFT),
            has_emitters: false,
            indirect: None,
            surface: None,
            indirect_identity: None,
            views: Vec::new(),
        }
    }

    /// Whether emissive triangles are among the lights that the direct mesh knows.
    pub(super) fn has_emitters(&self) -> bool {
        self.has_emitters
    }

    /// Makes the direct mesh one of these lights: it starts anew where emissive triangles are among them all at once, or no longer.
    pub(super) fn renew_lights(&mut self, lights: &PackedLights) {
        if self.has_emitters != lights.has_emitters() {
            *self = Self {
                has_emitters: lights.has_emitters(),
                ..Self::new(self.direct.store().points.bounds())
            };
        }
    }

    /// Makes the meshes of indirect light those that the settings ask for: values stay, but for those that other settings would have
    /// made.
    ///
    /// # Errors
    /// [`MeshError::TooFine`]; then nothing has changed.
    pub(super) fn renew_indirect(&mut self, scene: &Scene, settings: &Settings) -> Result<(), MeshError> {
        let identity = IndirectIdentity::of(settings, scene);
        if self.indirect_identity != identity {
            let bounds = self.direct.store().points.bounds();
            let of_form = |surface| {
                let settings = settings.mesh.indirect.as_ref();
                settings.filter(|indirect| (indirect.form == IndirectForm::Surface) == surface)
            };
            // Before anything is changed: an error leaves all as it is.
            let width = of_form(true).map(|indirect| surface_width(indirect, bounds)).transpose()?;
            if self.indirect_identity.is_some() {
                // Views are interpolated from points of the mesh that goes.
                self.views.clear();
            }
            self.indirect = of_form(false).map(|indirect| IndirectMesh::new(bounds, indirect));
            self.surface = of_form(true)
                .zip(width)
                .map(|(indirect, width)| SurfaceMesh::new(indirect, width, settings.shading.direct_scale()));
            self.indirect_identity = identity;
        }
        Ok(())
    }

    /// Makes the meshes ready to be interpolated by these settings. Values stay, but for those of an indirect mesh that other settings
    /// would have made.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn interpolation(
        &mut self,
        scene: &Scene,
        camera: &Camera,
        settings: &Settings,
    ) -> Result<MeshInterpolation, MeshError> {
        let shading = &settings.shading;
        let hybrid = shading.is_hybrid();
        // Values that are averaged must not change their spacing within the picture, nor what indirect light is made of with the view.
        let by_direct = |indirect: &IndirectSettings| indirect.form != IndirectForm::Surface;
        let auto = if hybrid && !settings.mesh.indirect.as_ref().is_some_and(by_direct) {
            AutoSpacing::Pixels(camera.pixel_footprint(settings.view.resolution))
        } else {
            AutoSpacing::AVERAGED
        };
        let direct =
            self.direct.interpolation(&settings.mesh.direct, &shading.kernel, shading.estimator, auto)?;
        self.renew_indirect(scene, settings)?;
        let indirect = match &mut self.indirect {
            Some(mesh) => Some(mesh.interpolation(&shading.indirect)?),
            None => None,
        };
        Ok(MeshInterpolation {
            direct,
            indirect,
            direct_scale: shading.direct_scale(),
            hybrid,
            tolerance: shading.tolerance,
            pixel_tolerance: shading.pixel_tolerance,
        })
    }

    /// How the other mesh is interpolated by settings whose shadows are averaged. It traces all lights, whatever levels there are.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub(super) fn other_interpolation(
        &mut self,
        settings: &Settings,
    ) -> Result<MeshInterpolation, MeshError> {
        let Settings { mesh, shading, .. } = settings;
        let points = PointSettings { levels: 0, ..mesh.direct.clone() };
        let auto = AutoSpacing::AVERAGED;
        Ok(MeshInterpolation {
            direct: self.other.interpolation(&points, &shading.kernel, shading.estimator, auto)?,
            indirect: None,
            direct_scale: shading.direct_scale(),
            hybrid: false,
            tolerance: shading.tolerance,
            pixel_tolerance: shading.pixel_tolerance,
        })
    }

    /// Forgets the mesh by which errors are measured, where memory is short: it is found again as it was.
    pub(super) fn forget_other(&mut self) {
        self.other = DirectMesh::shifted(self.direct.store().points.bounds(), SHIFT);
    }

    /// Takes the meshes of indirect light away, to be [put back](Self::put_indirect_back).
    pub(super) fn set_indirect_aside(&mut self) -> IndirectLight {
        IndirectLight {
            indirect: self.indirect.take(),
            surface: self.surface.take(),
            identity: self.indirect_identity.take(),
        }
    }

    /// Puts back what was [set aside](Self::set_indirect_aside).
    pub(super) fn put_indirect_back(&mut self, aside: IndirectLight) {
        (self.indirect, self.surface, self.indirect_identity) =
            (aside.indirect, aside.surface, aside.identity);
    }

    /// Forgets what depends on the lights' intensities; visibility stays.
    pub(super) fn forget_intensities(&mut self) {
        self.direct.forget_intensities();
        self.other.forget_intensities();
        (self.indirect, self.surface, self.indirect_identity) = (None, None, None);
        self.views.clear();
    }

    /// Fingerprint of what light from surfaces follows from, if there is any.
    pub(super) fn indirect_fingerprint(&self) -> Option<Fingerprint> {
        self.indirect_identity.as_ref().map(Fingerprint::of)
    }

    /// The same for settings.
    pub(super) fn wanted_indirect(scene: &Scene, settings: &Settings) -> Option<Fingerprint> {
        IndirectIdentity::of(settings, scene).as_ref().map(Fingerprint::of)
    }

    /// Takes the meshes of indirect light that were put in for those that the settings ask for.
    pub(super) fn accept_indirect(&mut self, scene: &Scene, settings: &Settings) {
        self.indirect_identity = IndirectIdentity::of(settings, scene);
    }

    /// Makes the meshes of indirect light ones like those of other meshes, with no point known.
    pub(super) fn take_indirect_like(
        &mut self,
        other: &Self,
        scene: &Scene,
        settings: &Settings,
    ) -> Result<(), MeshError> {
        if other.indirect_identity.is_some() {
            self.indirect_identity = None;
            self.renew_indirect(scene, settings)?;
        }
        Ok(())
    }

    /// Remembers a view that was rendered, unless a file knows it.
    pub(super) fn remember(&mut self, camera: &Camera, settings: &Settings, stats: &RenderStats) {
        let records = self.surface.as_ref().map(SurfaceMesh::view_records).unwrap_or_default();
        let Some(view) = KnownView::of(camera, settings, stats, records) else { return };
        match self.views.iter_mut().find(|known| known.identity == view.identity) {
            Some(known) if known.of_file => {}
            Some(known) => *known = view,
            None => self.views.push(view),
        }
    }

    /// What a file knows of a view.
    pub(super) fn known_view(&self, camera: &Camera, settings: &Settings) -> Option<&KnownView> {
        let identity = identity(camera, settings);
        self.views.iter().find(|view| view.of_file && view.identity == identity)
    }

    /// Forgets what may be otherwise after geometry in some boxes, where it was and where it is, has moved, or lights; `lights` are those before
    /// and after. Returns what stays known of direct light.
    pub(super) fn forget_moved(
        &mut self,
        bounds: Bounds,
        boxes: Vec<Bounds>,
        lights: [&SceneLights; 2],
    ) -> KeptBits {
        (self.indirect, self.surface, self.indirect_identity) = (None, None, None);
        self.views.clear();
        let [before, after] = lights.map(|lights| {
            lights
                .with_emitters
                .as_ref()
                .filter(|_| self.has_emitters)
                .or((!self.has_emitters).then_some(&lights.plain))
        });
        let Some(before) = before else { return KeptBits::default() };
        let motion = after.and_then(|after| Some((after, Motion::new(boxes, before, after)?)));
        match motion {
            Some((after, motion)) if bounds == self.direct.store().points.bounds() => {
                self.other.forget_moved(after, &motion);
                self.direct.forget_moved(after, &motion)
            }
            _ => {
                let forgotten = self.direct.forget_all(before);
                *self = Self::new(bounds);
                forgotten
            }
        }
    }

    /// What is known of direct light, as after something that changes nothing.
    pub(super) fn all_kept(&self, lights: &SceneLights) -> KeptBits {
        let points = self.direct.store().positions().len() as u64;
        let of_mesh = lights.with_emitters.as_ref().filter(|_| self.has_emitters).unwrap_or(&lights.plain);
        KeptBits { points_kept: points, bits_kept: points * of_mesh.len() as u64, ..KeptBits::default() }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.direct.memory_bytes()
            + self.other.memory_bytes()
            + self.indirect.as_ref().map_or(0, IndirectMesh::memory_bytes)
            + self.surface.as_ref().map_or(0, SurfaceMesh::memory_bytes)
    }
}

/// Cells of a surface mesh along the diagonal of a scene, by default.
const CELLS_ALONG_DIAGONAL: f32 = 60.0;

/// The same at most: finer ones would find surfaces for hours, and take all memory.
const MOST_CELLS_ALONG_DIAGONAL: f32 = 2000.0;

/// Width of the cells of a surface mesh.
///
/// # Errors
/// [`MeshError::TooFine`].
pub(crate) fn surface_width(settings: &IndirectSettings, bounds: Bounds) -> Result<f32, MeshError> {
    let diagonal = bounds.extent().length();
    match settings.points.spacing {
        Spacing::Auto => Ok(diagonal / CELLS_ALONG_DIAGONAL),
        Spacing::Units(spacing) if spacing.max_element() * MOST_CELLS_ALONG_DIAGONAL < diagonal => {
            Err(MeshError::TooFine(spacing))
        }
        Spacing::Units(spacing) => Ok(spacing.max_element()),
    }
}
