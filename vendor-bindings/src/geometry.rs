//! Geometries: triangles over shared buffers, and instances of scenes.

use std::{mem::size_of, sync::Arc};

use crate::bindings::{RTCGeometry, embree4 as v4};
use crate::device::Device;
use crate::error::Error;
use crate::filter::{Filter, Opacity};
use crate::library::call;
use crate::packet::MAX_COORDINATE;
use crate::placement::largest_coordinate;
use crate::scene::Scene;

/// A geometry, ready to be attached to a scene.
pub struct Geometry {
    handle: RTCGeometry,
    device: Device,
    instance: bool,
    largest_coordinate: f32,
    // Held for Embree, which has their addresses; dropped after the handle.
    _buffers: Option<Buffers>,
    _filter: Option<Box<Filter>>,
    _instanced: Option<Scene>,
}

/// Shared vertices and triangles.
struct Buffers(#[expect(dead_code)] Arc<Vec<[f32; 3]>>, #[expect(dead_code)] Arc<Vec<[u32; 3]>>);

// SAFETY: a geometry may be used and released on any thread; its methods take no `&self` that writes.
unsafe impl Send for Geometry {}
// SAFETY: as above.
unsafe impl Sync for Geometry {}

impl Geometry {
    /// Triangles over shared buffers, which are not copied.
    ///
    /// `vertices` ends in one vertex of padding, which no triangle may name: Embree reads four bytes
    /// past the last position. With `opacity`, a triangle is only hit where that says so.
    /// Triangles with coordinates that are not finite, or beyond ±1.8·10¹⁸, are never hit.
    ///
    /// # Errors
    ///
    /// [`Error::VertexBuffer`], [`Error::IndexOutOfRange`], [`Error::TooManyTriangles`], and
    /// [`Error::Embree`].
    pub fn triangles(
        device: &Device,
        vertices: Arc<Vec<[f32; 3]>>,
        triangles: Arc<Vec<[u32; 3]>>,
        opacity: Option<Opacity>,
    ) -> Result<Self, Error> {
        let count = vertices.len().checked_sub(1).filter(|count| u32::try_from(*count).is_ok());
        let count = count.ok_or(Error::VertexBuffer)?;
        if triangles.len() >= u32::MAX as usize {
            return Err(Error::TooManyTriangles { triangles: triangles.len() });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|index| **index as usize >= count) {
                return Err(Error::IndexOutOfRange { triangle, index, vertices: count });
            }
        }

        let mut geometry = Self::new(device, v4::RTC_GEOMETRY_TYPE_TRIANGLE)?;
        let (handle, api) = (geometry.handle, device.api());
        // SAFETY: the pointers stay valid, and what they point at unchanged, since `_buffers` shares the
        // ownership; formats, strides and counts are those of the vectors, with the padding behind.
        unsafe {
            call!(
                api,
                rtcSetSharedGeometryBuffer(
                    handle,
                    v4::RTC_BUFFER_TYPE_VERTEX,
                    0,
                    v4::RTC_FORMAT_FLOAT3,
                    vertices.as_ptr().cast(),
                    0,
                    size_of::<[f32; 3]>(),
                    count,
                )
            );
            call!(
                api,
                rtcSetSharedGeometryBuffer(
                    handle,
                    v4::RTC_BUFFER_TYPE_INDEX,
                    0,
                    v4::RTC_FORMAT_UINT3,
                    triangles.as_ptr().cast(),
                    0,
                    size_of::<[u32; 3]>(),
                    triangles.len(),
                )
            );
        }
        geometry._buffers = Some(Buffers(vertices, triangles));
        device.check("share vertices and triangles")?;
        if let Some(opacity) = opacity {
            geometry._filter = Some(Filter::register(device, handle, opacity));
            device.check("set the opacity filter")?;
        }
        geometry.commit()
    }

    /// A placed scene. `to_world` holds the columns of the affine map from the scene's space to that
    /// of the scene to which the instance is attached: three axes, then the origin.
    ///
    /// # Errors
    ///
    /// [`Error::NestedInstance`] where the scene itself holds instances, [`Error::Transform`] for a map
    /// that has no inverse or scales by less than about 10⁻⁹, and [`Error::Embree`].
    pub fn instance(scene: &Scene, to_world: [[f32; 3]; 4]) -> Result<Self, Error> {
        if scene.has_instances() {
            return Err(Error::NestedInstance);
        }
        let largest = largest_coordinate(&to_world).ok_or(Error::Transform)?;
        let to_world = without_tiny(to_world);
        let device = scene.device();
        let mut geometry = Self::new(device, v4::RTC_GEOMETRY_TYPE_INSTANCE)?;
        geometry.instance = true;
        geometry.largest_coordinate = largest;
        let handle = geometry.handle;
        // SAFETY: both handles are valid and of one device; the matrix is copied.
        unsafe {
            call!(device.api(), rtcSetGeometryInstancedScene(handle, scene.handle()));
            call!(
                device.api(),
                rtcSetGeometryTransform(
                    handle,
                    0,
                    v4::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR,
                    to_world.as_ptr().cast()
                )
            );
        }
        geometry._instanced = Some(scene.clone());
        device.check("place an instance")?;
        geometry.commit()
    }

    fn new(device: &Device, kind: v4::RTCGeometryType) -> Result<Self, Error> {
        // SAFETY: the device is valid, the type one of Embree's.
        let handle = unsafe { call!(device.api(), rtcNewGeometry(device.handle(), kind)) };
        device.check("create a geometry")?;
        Ok(Self {
            handle,
            device: device.clone(),
            instance: false,
            largest_coordinate: MAX_COORDINATE,
            _buffers: None,
            _filter: None,
            _instanced: None,
        })
    }

    fn commit(self) -> Result<Self, Error> {
        // SAFETY: the geometry is valid. Version 4's default mask has one bit only; version 3's has all.
        unsafe {
            call!(self.device.api(), rtcSetGeometryMask(self.handle, u32::MAX));
            call!(self.device.api(), rtcCommitGeometry(self.handle));
        }
        self.device.check("commit a geometry")?;
        Ok(self)
    }

    pub(crate) fn handle(&self) -> RTCGeometry {
        self.handle
    }

    pub(crate) fn device(&self) -> &Device {
        &self.device
    }

    pub(crate) fn largest_coordinate(&self) -> f32 {
        self.largest_coordinate
    }

    pub(crate) fn is_instance(&self) -> bool {
        self.instance
    }
}

impl Drop for Geometry {
    fn drop(&mut self) {
        // SAFETY: the handle is valid and released once. A scene that holds the geometry releases its
        // own reference first (see `scene::Inner`).
        unsafe { call!(self.device.api(), rtcReleaseGeometry(self.handle)) }
    }
}

/// Entries below this part of the largest one of their column become 0.
const TINY: f32 = f32::EPSILON;

/// The map without the remains of rounding that turns by quaternions leave where there should be 0, such as 10⁻¹⁷:
/// they make components of directions tiny, and [Embree's packets lose hits](crate::query) over those.
///
/// That moves a point by no more than rounding does, by a few 10⁻⁷ of its distance from the instance's own origin.
fn without_tiny([x, y, z, origin]: [[f32; 3]; 4]) -> [[f32; 3]; 4] {
    let [x, y, z] = [x, y, z].map(|axis| {
        let limit = TINY * axis.iter().fold(0.0f32, |largest, entry| largest.max(entry.abs()));
        axis.map(|entry| if entry.abs() < limit { 0.0 } else { entry })
    });
    [x, y, z, origin]
}
