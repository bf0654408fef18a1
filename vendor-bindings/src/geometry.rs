//! Geometries: handles and what they keep alive, and triangles over shared buffers.

use std::{mem::size_of, sync::Arc};

use crate::bindings::{RTCGeometry, embree4 as v4};
use crate::device::Device;
use crate::error::Error;
use crate::filter::{Filter, Opacity};
use crate::library::call;
use crate::packet::MAX_COORDINATE;

/// A geometry, ready to be attached to a scene.
pub struct Geometry {
    handle: RTCGeometry,
    device: Device,
    instance: bool,
    largest_coordinate: f32,
    // What Embree has the addresses or handles of; dropped after `Geometry::drop` released the geometry.
    held: Vec<Box<dyn Send + Sync>>,
}

// SAFETY: a geometry may be used and released on any thread; its methods take no `&self` that writes.
unsafe impl Send for Geometry {}
// SAFETY: as above.
unsafe impl Sync for Geometry {}

impl Geometry {
    /// Triangles over shared buffers, which are not copied.
    ///
    /// `vertices` ends in one vertex of padding, which no triangle may name: Embree reads four bytes
    /// past the last position. With `opacity`, a triangle is only hit where that returns true.
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
        // SAFETY: the pointers stay valid, and what they point at unchanged, since `held` shares the
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
        geometry.held.push(Box::new((vertices, triangles)));
        device.check("share vertices and triangles")?;
        if let Some(opacity) = opacity {
            geometry.held.push(Filter::register(device, handle, opacity));
            device.check("set the opacity filter")?;
        }
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
            held: Vec::new(),
        })
    }

    /// An instance before its scene and placement are set. `largest_coordinate` is that of rays that can be brought into
    /// its space; `scene` is kept as long as the geometry.
    pub(crate) fn new_instance(
        device: &Device,
        largest_coordinate: f32,
        scene: Box<dyn Send + Sync>,
    ) -> Result<Self, Error> {
        let mut geometry = Self::new(device, v4::RTC_GEOMETRY_TYPE_INSTANCE)?;
        (geometry.instance, geometry.largest_coordinate) = (true, largest_coordinate);
        geometry.held = vec![scene];
        Ok(geometry)
    }

    pub(crate) fn commit(self) -> Result<Self, Error> {
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
