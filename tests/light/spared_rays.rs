//! Camera rays that are spared change nothing: what they would meet follows from what those around them meet.

use std::sync::Arc;

use glam::{Affine2, Affine3A, Vec3};
use lightmesh::render::{SparedRays, TILE, Tile, TilePaths, trace_paths};
use lightmesh::sampling::SplitMix64;
use lightmesh::scene::{
    AlphaMask, Camera, CameraRays, Material, Scene, Texture, TextureMap, TriangleMesh, Wrap,
};
use lightmesh::settings::ViewSettings;

use crate::common::{camera, grey, with_world};

const SIDE: u32 = 256;

fn view(samples_per_pixel: u32) -> ViewSettings {
    ViewSettings { resolution: (SIDE, SIDE), samples_per_pixel, ..ViewSettings::default() }
}

/// Looks along −z; at a distance of 1 a pixel is 1/128 wide.
fn eye() -> Camera {
    camera(Vec3::ZERO, Vec3::NEG_Z, 90.0)
}

/// A material that shines, unlike any other.
fn shining(scene: &mut Scene, random: &mut SplitMix64) -> u32 {
    let emission = random.in_box(Vec3::ZERO, Vec3::ONE);
    scene.add_material(Material { emission, two_sided: true, ..grey(0.0) })
}

/// Adds a triangle; every other one is placed, in a space of its own.
fn add(scene: &mut Scene, corners: [Vec3; 3], material: u32) {
    if scene.meshes.len().is_multiple_of(2) {
        scene.add(TriangleMesh::new(corners.map(Vec3::into).into(), vec![[0, 1, 2]]).with_material(material));
        return;
    }
    let to_world = Affine3A::from_rotation_y(1.0) * Affine3A::from_scale(Vec3::splat(3.0));
    let to_object = to_world.inverse();
    let corners = corners.map(|corner| to_object.transform_point3(corner).into());
    let mesh = TriangleMesh::new(corners.into(), vec![[0, 1, 2]]).with_material(material);
    scene.meshes.push(Arc::new(mesh));
    scene.place(scene.meshes.len() as u32 - 1, to_world);
}

/// Triangles of all sizes and shapes, from 1/5 to 150 pixels and with all angles, each in a layer of its own, so that none pierces another; needles that reach from
/// behind the eye into the view, nearer than all of them; and a few that are transparent in places.
fn scene() -> Scene {
    let mut scene = Scene::new();
    let mut random = SplitMix64::new(5);
    for layer in 0..400 {
        let depth = 10.0 + layer as f32 * 0.1;
        let size = depth / 128.0 * 0.2 * 750f32.powf(random.unit());
        let middle = Vec3::new(random.between(-depth, depth), random.between(-depth, depth), -depth - 0.05);
        let mut corner = |thinness: f32| {
            let way = random.in_box(Vec3::splat(-1.0), Vec3::ONE);
            // Corners stay within the layer.
            middle + Vec3::new(way.x * size, way.y * size * thinness, way.z * 0.04)
        };
        let thinness = if layer % 3 == 0 { 0.02 } else { 1.0 };
        let corners = [corner(thinness), corner(thinness), corner(thinness)];
        let material = shining(&mut scene, &mut random);
        if layer % 25 == 0 {
            let texture = Texture::new(2, 1, vec![[255; 4], [0; 4]]).expect("a texture");
            let map = TextureMap {
                texture: Arc::new(texture),
                transform: Affine2::from_scale((5.0, 5.0).into()),
                wrap: [Wrap::Repeat; 2],
            };
            scene.materials[material as usize].alpha_mask =
                Some(AlphaMask { map: Some(map), alpha: 1.0, cutoff: 0.5 });
        }
        add(&mut scene, corners, material);
    }
    for (index, x) in [-2.0f32, -0.7, 0.4, 1.9].into_iter().enumerate() {
        let material = shining(&mut scene, &mut random);
        let y = -0.5 + 0.2 * index as f32;
        let start = Vec3::new(x, y, 4.0);
        let end = Vec3::new(-2.0 * x, y * 3.0, -9.0);
        add(&mut scene, [start, end, end + Vec3::Y * 0.02], material);
        add(&mut scene, [start + Vec3::Y * 3.0, start + Vec3::Y * 3.03, end + Vec3::Y], material);
    }
    scene
}

/// Paths of the whole view, tile by tile.
fn traced(scene: &Scene, view: &ViewSettings, spare: bool) -> Vec<TilePaths> {
    let samples = view.samples();
    let rays = CameraRays::new(&eye(), view.resolution, 1).with_samples(samples.clone());
    let pattern = &samples[..view.samples_per_pixel as usize];
    let spared = spare.then(|| SparedRays::of_view(scene, &rays, view.resolution, pattern));
    let tiles = (0..SIDE).step_by(TILE as usize).flat_map(|y| {
        (0..SIDE).step_by(TILE as usize).map(move |x| Tile { x, y, width: TILE, height: TILE })
    });
    with_world(scene, |world| {
        let trace = |tile: Tile| {
            let mut paths = TilePaths::default();
            trace_paths(world, &rays, view, spared.as_ref(), &tile, &mut paths);
            paths
        };
        tiles.map(trace).collect()
    })
}

/// Whatever is seen, however thin, cut off, hidden or transparent: with fewer rays the picture is the one of all of them. Emission is what shows it, since it
/// comes from each sample alone.
#[test]
fn rays_that_are_spared_would_have_met_the_same() {
    let scene = scene();
    for (samples, most) in [(16, 0.75), (32, 0.6)] {
        let view = view(samples);
        let (all, spared) = (traced(&scene, &view, false), traced(&scene, &view, true));
        let rays = |paths: &[TilePaths]| paths.iter().map(|paths| paths.camera_rays).sum::<u64>() as f64;
        assert!(rays(&spared) < most * rays(&all), "{} of {}", rays(&spared), rays(&all));
        let mut wrong = 0;
        for (all, spared) in all.iter().zip(&spared) {
            for (all, spared) in all.radiance.iter().zip(&spared.radiance) {
                wrong += u32::from(!all.abs_diff_eq(*spared, 1e-3));
            }
        }
        assert_eq!(wrong, 0, "{samples} samples");
    }
}
