//! Surface points of a pixel that lie close together: they take the same light from surfaces.

use glam::Vec3;

use crate::scene::{PixelFootprint, SurfacePoint};

/// Number of no group.
const NONE: u32 = u32::MAX;
/// Cosine between normals of a group.
const SAME_WAY: f32 = 0.98;
/// Edges of a pixel between points of a group: along the normal, and in all.
const HEIGHT: f32 = 0.5;
const WAY: f32 = 16.0;

/// Surface points of one pixel in about the same plane.
pub struct PixelGroup {
    /// The first of them.
    pub first: SurfacePoint,
    sum: Vec3,
    count: f32,
    /// The group of the pixel before it.
    before: u32,
}

impl PixelGroup {
    /// The middle of the points.
    #[inline(always)]
    pub fn middle(&self) -> SurfacePoint {
        SurfacePoint { position: self.sum / self.count, ..self.first }
    }
}

/// The surface points of some pixels in groups.
pub struct PixelGroups {
    /// The groups.
    pub groups: Vec<PixelGroup>,
    /// Number of its group by surface point.
    pub group_of: Vec<u32>,
}

impl PixelGroups {
    /// Groups surface points, given with the number of their pixel, below `pixels`. A pixel's groups don't depend on other pixels.
    #[inline(always)]
    pub fn new<'s>(
        surfaces: impl Iterator<Item = (u32, &'s SurfacePoint)>,
        pixels: usize,
        footprint: &PixelFootprint,
    ) -> Self {
        let mut last_of = vec![NONE; pixels];
        let mut groups = Vec::<PixelGroup>::with_capacity(pixels);
        let group_of = surfaces
            .map(|(pixel, surface)| {
                let last = &mut last_of[pixel as usize];
                let mut number = *last;
                while let Some(group) = groups.get_mut(number as usize) {
                    let way = surface.position - group.first.position;
                    let edge = footprint.edge * group.first.position.distance(footprint.eye);
                    if group.first.shading_normal.dot(surface.shading_normal) > SAME_WAY
                        && way.dot(group.first.geometric_normal).abs() < HEIGHT * edge
                        && way.length_squared() < (WAY * edge) * (WAY * edge)
                    {
                        group.sum += surface.position;
                        group.count += 1.0;
                        return number;
                    }
                    number = group.before;
                }
                groups.push(PixelGroup { first: *surface, sum: surface.position, count: 1.0, before: *last });
                *last = groups.len() as u32 - 1;
                *last
            })
            .collect();
        Self { groups, group_of }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a pixel in a plane are one group, whatever lies between them in the list; other planes, other sides and other pixels have
    /// their own.
    #[test]
    fn a_group_is_a_plane_in_a_pixel() {
        let footprint = PixelFootprint { eye: Vec3::Y * 10.0, edge: 0.01 };
        let at = |x: f32, y: f32, normal| SurfacePoint::flat(Vec3::new(x, y, 0.0), normal);
        let surfaces = [
            (0, at(0.0, 0.0, Vec3::Y)),
            (1, at(0.1, 0.0, Vec3::Y)),
            (0, at(0.0, 0.0, Vec3::NEG_Y)),
            (0, at(0.02, 0.0, Vec3::Y)),
            (0, at(0.0, 1.0, Vec3::Y)),
            (0, at(9.0, 0.0, Vec3::Y)),
        ];
        let groups =
            PixelGroups::new(surfaces.iter().map(|(pixel, surface)| (*pixel, surface)), 2, &footprint);
        assert_eq!(groups.group_of, [0, 1, 2, 0, 3, 4]);
        assert!(groups.groups[0].middle().position.abs_diff_eq(Vec3::X * 0.01, 1e-6));
    }
}
