//! What the rendering tests share: small scenes made by hand, and renders with the best backend there is.

#![allow(dead_code, reason = "every test program uses a part")]

pub mod data;
pub mod failed;
pub mod soup;
pub mod triangles;

use std::io::Write as _;
use std::sync::Arc;

use glam::Vec3;
use lightmesh::World;
use lightmesh::accel::{Backend, BackendChoice, BvhAccel};
use lightmesh::image::Image;
use lightmesh::light_mesh::direct::DirectMesh;
use lightmesh::light_mesh::lookup::LookupScratch;
use lightmesh::light_mesh::points::AutoSpacing;
use lightmesh::lights::{EmissiveTriangles, PackedLights};
use lightmesh::render::{RenderStats, Session, render};
use lightmesh::scene::generate::forest::Forest;
use lightmesh::scene::load::{LoadedScene, load_scene_file};
use lightmesh::scene::{
    Camera, Falloff, Instance, Light, LightKind, Material, Positions, Scene, SurfacePoint, TriangleMaterials,
    TriangleMesh,
};
use lightmesh::settings::{Integrator, Settings};

/// Triangles by hand, with a material each.
#[derive(Default)]
pub struct Builder {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    materials: Vec<u32>,
}

impl Builder {
    pub fn triangle(&mut self, corners: [Vec3; 3], material: u32) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners.map(|corner| corner.to_array()));
        self.triangles.push([first, first + 1, first + 2]);
        self.materials.push(material);
    }

    /// A parallelogram whose front is the side that `u × v` points to.
    pub fn quad(&mut self, corner: Vec3, u: Vec3, v: Vec3, material: u32) {
        self.triangle([corner, corner + u, corner + u + v], material);
        self.triangle([corner, corner + u + v, corner + v], material);
    }

    /// A box; its fronts point outwards, or inwards for a room.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3, inwards: bool, material: u32) {
        let size = max - min;
        let (x, y, z) = (Vec3::X * size, Vec3::Y * size, Vec3::Z * size);
        for (u, v, w) in [(x, y, z), (y, z, x), (z, x, y)] {
            let (far, near) = if inwards { ((v, u), (u, v)) } else { ((u, v), (v, u)) };
            self.quad(min + w, far.0, far.1, material);
            self.quad(min, near.0, near.1, material);
        }
    }

    /// A few tiny triangles at the corners of a box, which make it part of the scene's bounds.
    pub fn stretch_bounds(&mut self, min: Vec3, max: Vec3) {
        for corner in [min, max] {
            self.triangle([corner, corner + Vec3::X * 1e-4, corner + Vec3::Y * 1e-4], 0);
        }
    }

    pub fn scene(self, materials: Vec<Material>, lights: Vec<Light>, falloff: Falloff) -> Scene {
        let mesh = TriangleMesh {
            name: String::new(),
            positions: Positions::new(self.positions),
            triangles: Arc::new(self.triangles),
            normals: None,
            uvs: None,
            colors: None,
            materials: TriangleMaterials::PerTriangle(self.materials),
        };
        Scene {
            meshes: vec![Arc::new(mesh)],
            instances: vec![Instance { mesh: 0, to_world: None }],
            materials,
            lights,
            falloff,
            ..Scene::default()
        }
    }
}

pub fn grey(diffuse: f32) -> Material {
    Material { diffuse: Vec3::splat(diffuse), ..Material::default() }
}

pub fn light(position: Vec3, intensity: Vec3) -> Light {
    Light { position, intensity, kind: LightKind::Point }
}

pub fn camera(position: Vec3, look_at: Vec3, vertical_fov: f32) -> Camera {
    Camera { name: String::new(), position, look_at, up: Vec3::Y, vertical_fov }
}

/// A backend over a scene; `None`, and said so, for Embree where it is not installed. Where `REQUIRE_EMBREE` is set that is
/// a failure.
pub fn backend_if_installed(choice: BackendChoice, scene: &Scene) -> Option<Backend> {
    match Backend::build(choice, scene) {
        Ok(chosen) => Some(chosen.backend),
        Err(error) => {
            assert_eq!(choice, BackendChoice::Embree, "{error}");
            assert!(std::env::var_os("REQUIRE_EMBREE").is_none(), "REQUIRE_EMBREE is set, but {error}");
            let test = std::thread::current();
            // Not println!, which the test harness swallows.
            let _ =
                writeln!(std::io::stderr(), "SKIPPED Embree in {}: {error}", test.name().unwrap_or_default());
            None
        }
    }
}

/// Embree where it is installed, the built-in BVH elsewhere.
pub fn backend(scene: &Scene) -> Backend {
    Backend::build(BackendChoice::Auto, scene).expect("a backend").backend
}

/// Renders with the integrator that the settings name.
pub fn picture(scene: &Scene, camera: &Camera, settings: &Settings) -> (Image, RenderStats) {
    render(&backend(scene), scene, camera, settings).expect("a picture")
}

/// A session, with the best backend there is.
pub fn session(scene: &Scene) -> Session {
    Session::new(scene.clone(), BackendChoice::Auto).expect("a sound scene")
}

/// The default settings at a resolution.
pub fn settings_at(resolution: (u32, u32)) -> Settings {
    let mut settings = Settings::default();
    // What is promised holds for each surface point; several to a pixel would only be their mean.
    settings.view.samples_per_pixel = 1;
    // What `auto` takes is tested by itself.
    settings.shading.integrator = Integrator::LightMesh;
    settings.view.resolution = resolution;
    settings
}

/// The conventional picture with otherwise the same settings.
pub fn conventional(scene: &Scene, camera: &Camera, settings: &Settings) -> (Image, RenderStats) {
    let mut settings = settings.clone();
    settings.shading.integrator = Integrator::Conventional;
    picture(scene, camera, &settings)
}

/// A surface point in free space.
pub fn surface_point(position: Vec3, normal: Vec3) -> SurfacePoint {
    SurfacePoint::flat(position, normal)
}

/// Calls `each` with the World of a scene in the BVH.
pub fn with_world<T>(scene: &Scene, each: impl FnOnce(World<BvhAccel>) -> T) -> T {
    let accel = BvhAccel::build(scene).expect("a BVH");
    let (lights, emissive) = (PackedLights::of_scene(scene), EmissiveTriangles::of_scene(scene));
    each(World { accel: &accel, scene, lights: &lights, emissive: &emissive })
}

/// I(y) at surface points, which need not lie on any geometry.
pub fn direct_illumination(scene: &Scene, settings: &Settings, surfaces: &[SurfacePoint]) -> Vec<Vec3> {
    with_world(scene, |world| {
        let mut mesh = DirectMesh::new(scene.bounds());
        let shading = &settings.shading;
        let shading = mesh.interpolation(
            &settings.mesh.direct,
            &shading.kernel,
            shading.estimator,
            AutoSpacing::AVERAGED,
        );
        let shading = shading.expect("a light mesh");
        let needed = mesh.view(world.lights, &shading).lookup.needed_anywhere(surfaces.iter());
        mesh.evaluate(world, &shading, &needed);
        let view = mesh.view(world.lights, &shading);
        let mut scratch = LookupScratch::default();
        surfaces.iter().map(|surface| view.illumination(world.accel, surface, &mut scratch)).collect()
    })
}

/// The generated forest as `lightmesh generate forest` writes it.
pub fn forest(triangles: u32, lights: u32) -> LoadedScene {
    let folder = tempfile::tempdir().expect("a folder");
    Forest { triangles, lights, seed: 1 }.write(folder.path()).expect("a forest");
    load_scene_file(&folder.path().join("forest.toml")).expect("the forest")
}

/// Mean over pixels and channels.
pub fn mean(image: &Image) -> f64 {
    let sum: f64 = image.pixels().iter().flatten().map(|&value| f64::from(value)).sum();
    sum / (3 * image.pixels().len()) as f64
}

/// Root of the mean squared difference over the mean of `reference`.
pub fn relative_rmse(image: &Image, reference: &Image) -> f64 {
    assert_eq!((image.width(), image.height()), (reference.width(), reference.height()));
    let squares: f64 = image
        .pixels()
        .iter()
        .flatten()
        .zip(reference.pixels().iter().flatten())
        .map(|(a, b)| f64::from(a - b).powi(2))
        .sum();
    (squares / (3 * image.pixels().len()) as f64).sqrt() / mean(reference)
}

/// The bits of all channels: equal exactly if the pictures are.
pub fn bits(image: &Image) -> Vec<u32> {
    image.pixels().iter().flatten().map(|value| value.to_bits()).collect()
}
