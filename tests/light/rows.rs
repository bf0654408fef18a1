//! The short cut for surface points in a row of the same normal gives what the plain way of shading gives.

use glam::Vec3;
use lightmesh::World;
use lightmesh::accel::BvhAccel;
use lightmesh::light_mesh::direct::DirectMesh;
use lightmesh::light_mesh::lookup::LookupScratch;
use lightmesh::light_mesh::points::AutoSpacing;
use lightmesh::scene::SurfacePoint;
use lightmesh::settings::{Estimator, KernelSettings, Leaks, Neighbourhood, PointSettings, Spacing};

use crate::common::{forest, surface_point, with_world};

/// Rows of surface points: on the ground, and across the crowns at any slope.
fn rows() -> Vec<SurfacePoint> {
    let row = |start: Vec3, step: Vec3, normal: Vec3| {
        (0..200).map(move |i| surface_point(start + step * i as f32, normal.normalize()))
    };
    row(Vec3::new(-8.0, 0.0, 2.0), Vec3::new(0.08, 0.0, 0.01), Vec3::Y)
        .chain(row(Vec3::new(-7.0, 3.0, -3.0), Vec3::new(0.07, 0.01, 0.03), Vec3::new(1.0, 2.0, -0.5)))
        .chain(row(Vec3::new(0.0, 2.0, -6.0), Vec3::new(0.0, 0.01, 0.06), Vec3::NEG_X))
        .collect()
}

/// Both sum the same products, in another order: they agree to within rounding, whatever is done against leaks, and for
/// estimators that have no short cut they are the same.
#[test]
fn surface_points_in_a_row_are_shaded_as_if_alone() {
    let loaded = forest(5_000, 40);
    let surfaces = rows();
    with_world(&loaded.scene, |world| compare_rows(world, &surfaces));
}

fn compare_rows(world: World<BvhAccel>, surfaces: &[SurfacePoint]) {
    for estimator in [Estimator::Directional, Estimator::PerLight] {
        for leaks in [Leaks::Allow, Leaks::Invalidate, Leaks::Visibility] {
            for neighbourhood in [Neighbourhood::SmoothSphere, Neighbourhood::Sphere, Neighbourhood::Nearest]
            {
                let spacing = Spacing::Units(Vec3::splat(0.4));
                let points = PointSettings { spacing, ..PointSettings::default() };
                let kernel = KernelSettings { leaks, neighbourhood, ..KernelSettings::default() };
                let mut mesh = DirectMesh::new(world.scene.bounds());
                let shading = mesh.interpolation(&points, &kernel, estimator, AutoSpacing::AVERAGED).unwrap();
                let needed = mesh.view(world.lights, &shading).lookup.needed_anywhere(surfaces.iter());
                mesh.evaluate(world, &shading, &needed);
                let view = mesh.view(world.lights, &shading);
                // Both keep cells, whose surface points share what they see of the mesh points.
                let (mut alone, mut tile) = (LookupScratch::for_tile(), LookupScratch::for_tile());
                let mut lit = 0;
                for surface in surfaces {
                    let expected = view.illumination(world.accel, surface, &mut alone);
                    let found = view.illumination_in_row(world.accel, surface, &mut tile);
                    // Light from all sides cancels where a normal turns away from it: what rounding is measured by.
                    let scale = expected.max_element().max(0.1);
                    assert!(
                        found.abs_diff_eq(expected, 1e-5 * scale),
                        "{found} for {expected}: {estimator:?}, {leaks:?}, {neighbourhood:?}, {}",
                        surface.position
                    );
                    lit += usize::from(expected.max_element() > 0.01);
                }
                assert!(lit > surfaces.len() / 3, "only {lit} surface points have any light to compare");
                assert_eq!(tile.fallbacks, alone.fallbacks);
            }
        }
    }
}
