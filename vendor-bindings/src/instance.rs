//! Instances: geometries that place a scene.

use crate::bindings::embree4 as v4;
use crate::error::Error;
use crate::geometry::Geometry;
use crate::library::call;
use crate::placement::largest_coordinate;
use crate::scene::Scene;

impl Geometry {
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
        let geometry = Self::new_instance(device, largest, Box::new(scene.clone()))?;
        let handle = geometry.handle();
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
        device.check("place an instance")?;
        geometry.commit()
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
