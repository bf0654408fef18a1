//! Camera rays through stratified positions in the pixels.

use glam::{DVec3, Vec2, Vec3};

use super::{Camera, Ray};

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
    strata: (u32, u32),
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
            strata: strata(samples_per_pixel),
        }
    }

    /// Ray of sample `sample` of the pixel in column `x`, row `y` (from the top left).
    ///
    /// One sample per pixel goes through its centre; several are jittered within a grid of strata. The
    /// position depends on pixel and sample alone.
    #[inline(always)]
    pub fn ray(&self, x: u32, y: u32, sample: u32) -> Ray {
        let offset = if self.strata == (1, 1) {
            Vec2::splat(0.5)
        } else {
            let (columns, rows) = self.strata;
            let noise = hash(x, y, sample);
            let jitter = Vec2::new((noise & 0xffff) as f32, (noise >> 16) as f32) / 65536.0;
            let stratum = Vec2::new((sample % columns) as f32, (sample / columns) as f32);
            (stratum + jitter) / Vec2::new(columns as f32, rows as f32)
        };
        let at = Vec2::new(x as f32, y as f32) + offset - self.middle;
        Ray::new(self.origin, self.forward + self.right * at.x + self.down * at.y)
    }
}

/// The grid of strata closest to a square that has exactly `samples` cells.
fn strata(samples: u32) -> (u32, u32) {
    let rows = (1..=samples.isqrt()).rev().find(|rows| samples.is_multiple_of(*rows)).unwrap_or(1);
    (samples / rows, rows)
}

/// Well-mixed bits of pixel and sample (the finaliser of MurmurHash3 over a linear combination).
fn hash(x: u32, y: u32, sample: u32) -> u32 {
    let mut h = x
        .wrapping_mul(0x9E37_79B1)
        .wrapping_add(y.wrapping_mul(0x85EB_CA77))
        .wrapping_add(sample.wrapping_mul(0xC2B2_AE3D));
    h ^= h >> 16;
    h = h.wrapping_mul(0x85EB_CA6B);
    h ^= h >> 13;
    h = h.wrapping_mul(0xC2B2_AE35);
    h ^ h >> 16
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

    /// Each stratum of a pixel holds exactly one sample, whatever their number.
    #[test]
    fn samples_are_stratified() {
        for samples in [2, 3, 4, 6, 7, 16, 30] {
            let rays = CameraRays::new(&camera(), (8, 8), samples);
            let (columns, rows) = strata(samples);
            assert_eq!(columns * rows, samples);
            let mut seen = vec![0; samples as usize];
            for sample in 0..samples {
                let d = rays.ray(5, 3, sample).direction;
                let in_pixel = Vec2::new(d.x, -d.y) * 4.0 + Vec2::splat(4.0) - Vec2::new(5.0, 3.0);
                let column = (in_pixel.x * columns as f32) as u32;
                let row = (in_pixel.y * rows as f32) as u32;
                seen[(row * columns + column) as usize] += 1;
            }
            assert!(seen.iter().all(|&count| count == 1), "{samples}: {seen:?}");
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
