//! Readings of a plane as images.

use glam::Vec3;

use super::probes::Plane;
use super::table::Unit;
use crate::image::{Image, ImageError};

/// Irradiance on a plane as an image, linear RGB.
///
/// # Errors
/// [`ImageError::Size`] for more pixels than an image may have, or other than there are probes.
pub fn luminous_map(plane: &Plane, light: &[Vec3]) -> Result<Image, ImageError> {
    let (width, height) = plane.resolution();
    let pixels = plane.image_order(light).into_iter().map(|light| light.to_array()).collect();
    Image::from_pixels(width, height, pixels)
}

/// Illuminance on a plane in false colours, 8-bit sRGB, row-major from the top left: those of the map `turbo`, from dark blue for 0 over green and yellow
/// to dark red for `full_scale` lux and more. The scale is linear.
pub fn false_colours(plane: &Plane, light: &[Vec3], unit: Unit, full_scale: f32) -> Vec<[u8; 3]> {
    let colour = |light: Vec3| {
        let share = unit.lux(light) / full_scale;
        // What is no number is dark.
        let share = if share > 0.0 { share.min(1.0) } else { 0.0 };
        let colour = colorous::TURBO.eval_continuous(f64::from(share));
        [colour.r, colour.g, colour.b]
    };
    plane.image_order(light).into_iter().map(colour).collect()
}
