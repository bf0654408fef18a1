//! Trees are sound, and the same every time.

use super::*;

/// Reproducible images need equal trees: ties at equal distance are settled without the tree, but box
/// culling and work counters are not.
#[test]
fn the_tree_is_the_same_for_any_number_of_threads() {
    let mut random = Random::new(11);
    // Above the size from which ranges are binned in parallel.
    let meshes = vec![
        triangles::soup(&mut random, 150_000, 0.01, None),
        triangles::soup(&mut random, 5000, 0.1, None),
    ];
    let scene = scene(meshes, vec![(0, None), (1, Some(Affine3A::from_translation(Vec3::X)))]);
    let digests = [1, 2, 7].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let accel = pool.install(|| BvhAccel::build(&scene)).unwrap();
        accel.validate().unwrap();
        assert_eq!(accel.triangle_count(), 155_000);
        accel.digest()
    });
    assert_eq!(digests[0], digests[1]);
    assert_eq!(digests[0], digests[2]);
}

/// Inputs that defeat the surface-area heuristic must not make a tree deeper than the stack.
#[test]
fn inputs_that_make_deep_trees_are_built_and_answered() {
    let mut random = Random::new(12);
    // Each triangle is 10 % larger than the one before: every split peels off a few.
    let nested = soup((0..800).map(|i| [Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * 1e-12 * 1.1f32.powi(i))));
    let same = soup([[Vec3::X, Vec3::Y, Vec3::Z]; 3000]);
    let line = soup((0..2000).map(|i| [0.0, 1e-3, 2e-3].map(|x| Vec3::new(i as f32 * 1e-3 + x, x * x, 0.0))));
    for mesh in [nested, same, line] {
        let rays = rays_for(&mut random, &mesh, 600);
        check(&single(mesh), &rays);
    }
}

#[test]
fn an_instance_of_a_mesh_that_does_not_exist_is_an_error() {
    let broken = scene(vec![sphere(4, 1.0)], vec![(0, None), (7, None)]);
    assert_eq!(BvhAccel::build(&broken).err(), Some(BvhError::NoSuchMesh { instance: 1, mesh: 7 }));
}
