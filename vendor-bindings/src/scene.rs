//! Scenes: geometries under one acceleration structure.

use std::{collections::BTreeMap, sync::Arc};

use crate::bindings::{RTCScene, embree4 as v4};
use crate::device::Device;
use crate::error::Error;
use crate::geometry::Geometry;
use crate::library::{Api, call};
use crate::packet::{INVALID_ID, MAX_COORDINATE};

/// How much time a build may take for faster queries. With robust traversal Embree builds `High` as
/// `Medium`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// Fast builds.
    Low,
    /// The default.
    #[default]
    Medium,
    /// Spatial splits.
    High,
}

/// A scene under construction.
pub struct SceneBuilder(Inner);

/// A committed scene. Cheap to clone; queries may run on any number of threads.
#[derive(Clone)]
pub struct Scene(Arc<Inner>);

struct Inner {
    handle: RTCScene,
    device: Device,
    // By id. Dropped after `Inner::drop` released the scene, so that buffers outlive their last user.
    geometries: BTreeMap<u32, Geometry>,
    largest_coordinate: f32,
    // Widths of packets that are traversed as such; a sum, since all are powers of two.
    native_widths: usize,
}

// SAFETY: a scene may be built on any thread, one at a time, which `&mut SceneBuilder` ensures; once
// committed it only answers queries, which may run concurrently.
unsafe impl Send for Inner {}
// SAFETY: as above.
unsafe impl Sync for Inner {}

impl SceneBuilder {
    /// An empty scene, robust (watertight) and of medium quality.
    ///
    /// # Errors
    ///
    /// [`Error::Embree`].
    pub fn new(device: &Device) -> Result<Self, Error> {
        // SAFETY: the device is valid.
        let handle = unsafe { call!(device.api(), rtcNewScene(device.handle())) };
        device.check("create a scene")?;
        let builder = Self(Inner {
            handle,
            device: device.clone(),
            geometries: BTreeMap::new(),
            largest_coordinate: MAX_COORDINATE,
            native_widths: [4, 8, 16].into_iter().filter(|width| device.native_packets(*width)).sum(),
        });
        builder.robust(true)
    }

    /// Whether traversal and intersection avoid the optimisations that lose hits on shared edges.
    ///
    /// # Errors
    ///
    /// [`Error::Embree`].
    pub fn robust(self, robust: bool) -> Result<Self, Error> {
        let flags = if robust { v4::RTC_SCENE_FLAG_ROBUST } else { v4::RTC_SCENE_FLAG_NONE };
        // SAFETY: the scene is valid.
        unsafe { call!(self.0.device.api(), rtcSetSceneFlags(self.0.handle, flags)) };
        self.0.device.check("set scene flags")?;
        Ok(self)
    }

    /// How much time the build may take.
    ///
    /// # Errors
    ///
    /// [`Error::Embree`].
    pub fn quality(self, quality: BuildQuality) -> Result<Self, Error> {
        let quality = match quality {
            BuildQuality::Low => v4::RTC_BUILD_QUALITY_LOW,
            BuildQuality::Medium => v4::RTC_BUILD_QUALITY_MEDIUM,
            BuildQuality::High => v4::RTC_BUILD_QUALITY_HIGH,
        };
        // SAFETY: the scene is valid.
        unsafe { call!(self.0.device.api(), rtcSetSceneBuildQuality(self.0.handle, quality)) };
        self.0.device.check("set the build quality")?;
        Ok(self)
    }

    /// Adds a geometry under an id, which hits will carry as `geom_id`, or as `inst_id` where the
    /// geometry is an instance. Embree keeps a table as long as the largest id.
    ///
    /// # Errors
    ///
    /// [`Error::ForeignDevice`], [`Error::GeometryId`] for an id that is taken or reserved, and
    /// [`Error::Embree`].
    pub fn attach(&mut self, id: u32, geometry: Geometry) -> Result<(), Error> {
        if !geometry.device().is(&self.0.device) {
            return Err(Error::ForeignDevice);
        }
        if id == INVALID_ID || self.0.geometries.contains_key(&id) {
            return Err(Error::GeometryId { id });
        }
        // SAFETY: both handles are valid and of one device.
        unsafe { call!(self.0.device.api(), rtcAttachGeometryByID(self.0.handle, geometry.handle(), id)) };
        self.0.largest_coordinate = self.0.largest_coordinate.min(geometry.largest_coordinate());
        // Kept even where that failed: Embree might have taken its reference before.
        self.0.geometries.insert(id, geometry);
        self.0.device.check("attach a geometry")
    }

    /// Builds the acceleration structure, on the device's threads.
    ///
    /// # Errors
    ///
    /// [`Error::Embree`], such as for lack of memory.
    pub fn commit(self) -> Result<Scene, Error> {
        // SAFETY: the scene is valid, and nobody else has access to it.
        unsafe { call!(self.0.device.api(), rtcCommitScene(self.0.handle)) };
        self.0.device.check("build the acceleration structure")?;
        Ok(Scene(Arc::new(self.0)))
    }
}

impl Scene {
    /// Lower and upper corner of the box around everything that can be hit; `None` for nothing.
    pub fn bounds(&self) -> Option<([f32; 3], [f32; 3])> {
        let mut b = v4::RTCBounds {
            lower_x: 0.0,
            lower_y: 0.0,
            lower_z: 0.0,
            align0: 0.0,
            upper_x: 0.0,
            upper_y: 0.0,
            upper_z: 0.0,
            align1: 0.0,
        };
        // SAFETY: the scene is committed; the struct is the same in both versions (see `layout`).
        unsafe { call!(self.api(), rtcGetSceneBounds(self.0.handle, (&raw mut b).cast())) };
        let (lower, upper) = ([b.lower_x, b.lower_y, b.lower_z], [b.upper_x, b.upper_y, b.upper_z]);
        lower.iter().zip(&upper).all(|(l, u)| l <= u).then_some((lower, upper))
    }

    /// Largest magnitude of a coordinate that a ray's origin and direction may have to hit anything:
    /// [`MAX_COORDINATE`], or less where instances scale rays up, but never below 10⁹.
    #[inline(always)]
    pub fn largest_coordinate(&self) -> f32 {
        self.0.largest_coordinate
    }

    /// Bytes of the handles to the scene's geometries, which [`Device::memory_bytes`] doesn't count.
    pub fn handle_bytes(&self) -> usize {
        self.0.geometries.len() * size_of::<(u32, Geometry)>()
    }

    /// The device that the scene belongs to.
    pub fn device(&self) -> &Device {
        &self.0.device
    }

    #[inline(always)]
    pub(crate) fn api(&self) -> &Api {
        self.0.device.api()
    }

    #[inline(always)]
    pub(crate) fn handle(&self) -> RTCScene {
        self.0.handle
    }

    #[inline(always)]
    pub(crate) fn is_native(&self, width: usize) -> bool {
        self.0.native_widths & width != 0
    }

    pub(crate) fn has_instances(&self) -> bool {
        self.0.geometries.values().any(Geometry::is_instance)
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        // SAFETY: the handle is valid and released once; scenes that instance this one hold a `Scene`.
        unsafe { call!(self.device.api(), rtcReleaseScene(self.handle)) }
    }
}
