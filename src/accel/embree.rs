//! The `embree` backend: Embree 4 or 3, whichever is installed.

use std::collections::HashMap;
use std::sync::Arc;

use embree_sys::{Device, Error, Geometry, Library, Opacity, SceneBuilder};
use thiserror::Error as ThisError;

use super::limits::columns;
use super::{Accel, Coherence, INVALID_ID, LaneMask, RayHitPacket, RayPacket};
use crate::scene::{AlphaMasks, Hit, Ray, Scene, TriangleMesh};

/// What keeps Embree from being used.
#[derive(Clone, Debug, ThisError)]
pub enum EmbreeError {
    /// No library, or none that can be used.
    #[error(
        "{0}\nhint: Debian 12 has Embree in the package libembree3-3, Debian 13 in libembree4-4; \
         EMBREE_LIB=FILE names another one"
    )]
    Library(Error),
    /// Embree could not set up a device or a scene.
    #[error("{0}")]
    Setup(Error),
    /// A mesh that Embree cannot take.
    #[error("mesh `{name}`: {error}")]
    Mesh {
        /// Name of the mesh.
        name: String,
        /// What Embree, or the check before it, refused.
        error: Error,
    },
    /// An instance of a mesh that the scene does not have.
    #[error("instance {instance} places mesh {mesh}, which does not exist")]
    NoSuchMesh {
        /// Index of the instance.
        instance: usize,
        /// Index of the mesh.
        mesh: u32,
    },
}

/// Ray queries through Embree.
///
/// Vertices and triangles are shared with the scene, not copied. Meshes in world space are geometries
/// of the top-level scene; placed ones are built once and instanced. Traversal is robust, so rays don't
/// slip through shared edges. Triangles with coordinates that are not finite, or beyond ±1.8·10¹⁸,
/// are never hit, nor are instances whose transform has no inverse.
pub struct EmbreeAccel {
    scene: embree_sys::Scene,
    /// Structures of the placed meshes, by their index.
    placed: HashMap<u32, embree_sys::Scene>,
}

impl EmbreeAccel {
    /// Loads Embree and builds the acceleration structure, on as many threads as rayon has.
    ///
    /// # Errors
    ///
    /// [`EmbreeError::Library`] where no usable Embree is installed, and the others for a scene that
    /// Embree cannot take.
    pub fn build(scene: &Scene) -> Result<Self, EmbreeError> {
        Self::build_with(&Library::load().map_err(EmbreeError::Library)?, scene)
    }

    /// Makes it the structure of a scene that differs only in where instances stand: meshes that are placed are not built again.
    ///
    /// # Errors
    ///
    /// As for [`EmbreeAccel::build`]; then it is what it was.
    pub(super) fn rebuild(&mut self, scene: &Scene) -> Result<(), EmbreeError> {
        let device = self.scene.device().clone();
        *self = Self::build_on(&device, scene, self.placed.clone())?;
        Ok(())
    }

    /// [`EmbreeAccel::build`] with the versions of Embree that are installed besides the one that it takes.
    ///
    /// # Errors
    ///
    /// As for [`EmbreeAccel::build`].
    pub(super) fn build_others(scene: &Scene) -> Result<Vec<Self>, EmbreeError> {
        let libraries = Library::load_all().map_err(EmbreeError::Library)?;
        libraries.iter().skip(1).map(|library| Self::build_with(library, scene)).collect()
    }

    /// [`EmbreeAccel::build`] with a library that is loaded already; hidden, since outside of here only tests need it.
    ///
    /// # Errors
    ///
    /// As for [`EmbreeAccel::build`].
    #[doc(hidden)]
    // For tests and benches only.
    #[doc(hidden)]
    pub fn build_with(library: &Library, scene: &Scene) -> Result<Self, EmbreeError> {
        let threads = format!("threads={}", rayon::current_num_threads());
        let device = Device::new(library, &threads).map_err(EmbreeError::Library)?;
        Self::build_on(&device, scene, HashMap::new())
    }

    /// Builds the acceleration structure; some placed meshes may have theirs already.
    fn build_on(
        device: &Device,
        scene: &Scene,
        mut placed: HashMap<u32, embree_sys::Scene>,
    ) -> Result<Self, EmbreeError> {
        let mut top = SceneBuilder::new(device).map_err(EmbreeError::Setup)?;
        let masks = AlphaMasks::of_scene(scene);
        for (id, instance) in (0..INVALID_ID).zip(&scene.instances) {
            let mesh = scene
                .meshes
                .get(instance.mesh as usize)
                .ok_or(EmbreeError::NoSuchMesh { instance: id as usize, mesh: instance.mesh })?;
            let mesh_error = |error| EmbreeError::Mesh { name: mesh.name.clone(), error };
            let geometry = match instance.to_world {
                None => triangles(device, mesh, &masks).map_err(mesh_error)?,
                Some(to_world) => {
                    let object = match placed.get(&instance.mesh) {
                        Some(object) => object,
                        None => {
                            let object = object(device, mesh, &masks).map_err(mesh_error)?;
                            placed.entry(instance.mesh).or_insert(object)
                        }
                    };
                    match Geometry::instance(object, columns(&to_world)) {
                        // Rays cannot be brought into its space: never hit, as in the other backends.
                        Err(Error::Transform) => continue,
                        geometry => geometry.map_err(mesh_error)?,
                    }
                }
            };
            top.attach(id, geometry).map_err(mesh_error)?;
        }
        Ok(Self { scene: top.commit().map_err(EmbreeError::Setup)?, placed })
    }

    /// Version of the loaded Embree, such as `4.3.3`.
    pub fn version(&self) -> String {
        self.scene.device().library().version().to_string()
    }
}

/// A mesh as an Embree geometry.
fn triangles(device: &Device, mesh: &Arc<TriangleMesh>, masks: &AlphaMasks) -> Result<Geometry, Error> {
    let opacity = masks
        .of_mesh(mesh)
        .map(|masked| -> Opacity { Arc::new(move |triangle, u, v| masked.is_opaque(triangle, u, v)) });
    Geometry::triangles(device, mesh.positions.padded().clone(), mesh.triangles.clone(), opacity)
}

/// A scene of one mesh, for instances.
fn object(device: &Device, mesh: &Arc<TriangleMesh>, masks: &AlphaMasks) -> Result<embree_sys::Scene, Error> {
    let mut builder = SceneBuilder::new(device)?;
    builder.attach(0, triangles(device, mesh, masks)?)?;
    builder.commit()
}

#[inline(always)]
fn single(ray: &Ray) -> embree_sys::Ray {
    embree_sys::Ray {
        origin: ray.origin.to_array(),
        direction: ray.direction.to_array(),
        tnear: ray.t_near,
        tfar: ray.t_far,
    }
}

impl Accel for EmbreeAccel {
    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.scene.intersect1(&single(ray)).map(|hit| Hit {
            t: hit.t,
            u: hit.u,
            v: hit.v,
            instance: if hit.inst_id == INVALID_ID { hit.geom_id } else { hit.inst_id },
            triangle: hit.prim_id,
        })
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        self.scene.occluded1(&single(ray))
    }

    #[inline(always)]
    fn intersect_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayHitPacket<N>,
        coherence: Coherence,
    ) {
        self.scene.intersect_packet(active, packet, coherence == Coherence::Coherent);
    }

    #[inline(always)]
    fn occluded_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayPacket<N>,
        coherence: Coherence,
    ) -> LaneMask {
        self.scene.occluded_packet(active, packet, coherence == Coherence::Coherent)
    }

    fn memory_bytes(&self) -> usize {
        self.scene.device().memory_bytes() + self.scene.handle_bytes()
    }
}
