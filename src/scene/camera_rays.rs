//! Camera rays through the samples of pixels.

use glam::{DVec3, Mat3A, Vec2, Vec3};

use super::{Camera, PixelFootprint, Ray};
use crate::sampling::pixel_pattern;
use crate::simd::{LANES, Lanes};

/// Maps positions in the image to camera rays.
#[derive(Clone, Debug)]
pub struct CameraRays {
    origin: Vec3,
    forward: Vec3,
    /// From one pixel to the next on the plane at distance 1, to the right.
    right: Vec3,
    /// The same, downwards.
    down: Vec3,
    middle: Vec2,
    /// Samples of a pixel, from its upper left corner.
    samples: Vec<Vec2>,
}

impl CameraRays {
    /// Rays of `camera` for an image of the given resolution and rays per pixel (each ≥ 1).
    ///
    /// An `up` along the view direction is replaced by some perpendicular, a `look_at` at the eye by −z.
    pub fn new(camera: &Camera, resolution: (u32, u32), samples_per_pixel: u32) -> Self {
        let exact = |vector: DVec3| vector.try_normalize().map(|unit| unit.as_vec3());
        // Squares of very large and very small numbers leave single precision.
        let forward = (camera.look_at - camera.position)
            .try_normalize()
            .or_else(|| exact(camera.look_at.as_dvec3() - camera.position.as_dvec3()))
            .unwrap_or(Vec3::NEG_Z);
        let right = forward
            .cross(camera.up)
            .try_normalize()
            .or_else(|| exact(forward.as_dvec3().cross(camera.up.as_dvec3())))
            .unwrap_or(forward.any_orthonormal_vector());
        let down = forward.cross(right);
        let (width, height) = (resolution.0 as f32, resolution.1 as f32);
        let pixel = 2.0 * (camera.vertical_fov.to_radians() * 0.5).tan() / height;
        Self {
            origin: camera.position,
            forward,
            right: right * pixel,
            down: down * pixel,
            middle: Vec2::new(width, height) * 0.5,
            samples: pixel_pattern(samples_per_pixel),
        }
    }

    /// The same rays, but through these positions in every pixel, from its upper left corner; at least one.
    pub fn with_samples(self, samples: Vec<Vec2>) -> Self {
        Self { samples, ..self }
    }

    /// How large pixels are where the rays end.
    pub fn footprint(&self) -> PixelFootprint {
        PixelFootprint { eye: self.origin, edge: self.right.length() }
    }

    /// Ray of sample `sample` of the pixel in column `x`, row `y` (from the top left).
    ///
    /// One sample per pixel goes through its centre. Several have the same pattern in all pixels.
    ///
    /// # Panics
    /// Beyond the number of samples.
    #[inline(always)]
    pub fn ray(&self, x: u32, y: u32, sample: u32) -> Ray {
        let offset = self.samples[sample as usize];
        let at = Vec2::new(x as f32, y as f32) + offset - self.middle;
        Ray::new(self.origin, self.forward + self.right * at.x + self.down * at.y)
    }

    /// The view direction, of unit length.
    pub(crate) fn forward(&self) -> Vec3 {
        self.forward
    }

    /// Where all rays start.
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Maps ways from the eye to (column · depth, row · depth, depth), in pixels from the image's upper left corner.
    pub(crate) fn to_image(&self) -> Mat3A {
        let across = self.right / self.right.length_squared() + self.forward * self.middle.x;
        let down = self.down / self.down.length_squared() + self.forward * self.middle.y;
        Mat3A::from_cols(across.into(), down.into(), self.forward.into()).transpose()
    }

    /// Directions of the rays of sixteen samples of a pixel, from one on, by axis.
    ///
    /// # Panics
    /// Beyond the number of samples.
    #[inline(always)]
    pub fn directions(&self, x: u32, y: u32, first_sample: u32) -> [Lanes; 3] {
        let mut directions = [[0.0; LANES]; 3];
        let samples = &self.samples[first_sample as usize..][..LANES];
        for lane in 0..LANES {
            let at_x = x as f32 + samples[lane].x - self.middle.x;
            let at_y = y as f32 + samples[lane].y - self.middle.y;
            for axis in 0..3 {
                directions[axis][lane] =
                    self.forward[axis] + self.right[axis] * at_x + self.down[axis] * at_y;
            }
        }
        directions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, -3.0)).with_fov(90.0)
    }

    /// At 90° the image's upper edge is 45° above its middle, and right is right.
    #[test]
    fn the_field_of_view_is_vertical() {
        let rays = CameraRays::new(&camera(), (200, 100), 1);
        let corner = rays.ray(0, 0, 0).direction;
        // The centre of the first pixel is half a pixel inside the corner (−2, 1) of the plane at distance 1.
        assert!(corner.abs_diff_eq(Vec3::new(-1.99, 0.99, -1.0), 1e-5), "{corner}");
        let opposite = rays.ray(199, 99, 0).direction;
        assert!(opposite.abs_diff_eq(Vec3::new(1.99, -0.99, -1.0), 1e-5), "{opposite}");
    }

    /// Sixteen at once are the same rays.
    #[test]
    fn samples_side_by_side_are_those_one_by_one() {
        let rays = CameraRays::new(&camera(), (200, 100), 32);
        let directions = rays.directions(17, 61, 16);
        for lane in 0..LANES {
            let [x, y, z] = directions.map(|axis| axis[lane]);
            assert_eq!(rays.ray(17, 61, 16 + lane as u32), Ray::new(rays.origin(), Vec3::new(x, y, z)));
        }
    }

    /// Rays and the map to the image are each other's inverse.
    #[test]
    fn what_a_ray_meets_is_seen_at_its_sample() {
        let camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-4.0, 1.0, 0.5)).with_fov(50.0);
        let rays = CameraRays::new(&camera, (200, 100), 1);
        for (x, y, t) in [(0, 0, 1.0), (199, 3, 7.5), (120, 99, 0.01)] {
            let ray = rays.ray(x, y, 0);
            let seen = rays.to_image() * (ray.direction * t);
            let position = seen.truncate() / seen.z;
            let expected = Vec2::new(x as f32, y as f32) + 0.5;
            assert!(position.abs_diff_eq(expected, 2e-2) && (seen.z / t - 1.0).abs() < 1e-4, "{seen}");
        }
    }

    /// Coordinates whose squares are 0 or infinite in single precision are coordinates like others.
    #[test]
    fn the_direction_of_a_view_does_not_depend_on_its_scale() {
        let direction = |scale: f32| {
            let camera =
                Camera { position: camera().position * scale, look_at: camera().look_at * scale, ..camera() };
            CameraRays::new(&camera.with_up(Vec3::Y * scale), (4, 4), 1).ray(3, 1, 0).direction
        };
        for scale in [1e-30, 1e30] {
            assert!(direction(scale).abs_diff_eq(direction(1.0), 1e-6), "{scale}: {}", direction(scale));
        }
    }

    /// Looking along `up` still gives finite rays.
    #[test]
    fn a_degenerate_up_is_replaced() {
        let camera = Camera { up: Vec3::Z, ..camera() };
        assert!(CameraRays::new(&camera, (4, 4), 1).ray(0, 0, 0).direction.is_finite());
    }
}
