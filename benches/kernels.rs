//! The kernels of a light-mesh frame, one by one: cargo bench --bench kernels
//!
//! The scene is small and without geometry in the way, so that arithmetic is measured and not the memory.

#![allow(clippy::expect_used, reason = "a benchmark that cannot set up has nothing to measure")]

use std::sync::Arc;

use divan::{Bencher, black_box};
use glam::{Vec3, Vec4};
use lightmesh::World;
use lightmesh::accel::{Accel, BvhAccel, Coherence, PacketLanes, RayPacket};
use lightmesh::light_mesh::direct::{
    Basis, DirectField, DirectInterpolation, DirectMesh, DirectView, spherical_harmonics,
};
use lightmesh::light_mesh::lookup::{Lookup, LookupScratch};
use lightmesh::light_mesh::points::{AutoSpacing, Neighbours};
use lightmesh::lights::{EmissiveTriangles, PackedLights, Unoccluded};
use lightmesh::sampling::SplitMix64;
use lightmesh::scene::{
    Instance, Light, LightKind, Material, Positions, Ray, Scene, SurfacePoint, TriangleMaterials,
    TriangleMesh,
};
use lightmesh::settings::{Estimator, KernelSettings, Leaks, PointSettings, Radius, Spacing};
use lightmesh::simd::vectorize;
use pulp::NullaryFnOnce;

fn main() {
    divan::main();
}

const SURFACES: usize = 256;

/// A thousand triangles in the unit box under `lights` lights.
fn scene(lights: usize) -> Scene {
    let mut random = SplitMix64::new(1);
    let mut positions = Vec::new();
    for _ in 0..1000 {
        let corner = random.in_box(Vec3::ZERO, Vec3::ONE);
        let mut near = || (corner + random.in_box(Vec3::splat(-0.03), Vec3::splat(0.03))).to_array();
        positions.extend([near(), near(), near()]);
    }
    let count = positions.len() as u32 / 3;
    let mesh = TriangleMesh {
        name: String::new(),
        positions: Positions::new(positions),
        triangles: Arc::new((0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()),
        normals: None,
        uvs: None,
        colors: None,
        materials: TriangleMaterials::Uniform(0),
    };
    let light = |_| Light {
        position: random.in_box(Vec3::new(0.0, 1.1, 0.0), Vec3::new(1.0, 1.3, 1.0)),
        intensity: Vec3::ONE,
        kind: LightKind::Point,
    };
    Scene {
        meshes: vec![Arc::new(mesh)],
        instances: vec![Instance { mesh: 0, to_world: None }],
        materials: vec![Material::default()],
        lights: (0..lights).map(light).collect(),
        ..Scene::default()
    }
}

fn surfaces() -> Vec<SurfacePoint> {
    let mut random = SplitMix64::new(2);
    let surface = |_| {
        let normal = random.in_box(Vec3::NEG_ONE, Vec3::ONE).normalize_or(Vec3::Y);
        SurfacePoint::flat(random.in_box(Vec3::splat(0.2), Vec3::splat(0.8)), normal)
    };
    (0..SURFACES).map(surface).collect()
}

/// A mesh of spacing 1/20 over the scene of a number of lights, read with R of `spacings` spacings.
fn mesh(lights: usize, spacings: f32, estimator: Estimator) -> (DirectMesh, DirectInterpolation) {
    let points = PointSettings { spacing: Spacing::Units(Vec3::splat(0.05)), ..PointSettings::default() };
    let kernel = KernelSettings {
        radius: Radius::Spacings(spacings),
        leaks: Leaks::Allow,
        ..KernelSettings::default()
    };
    let mut mesh = DirectMesh::new(scene(lights).bounds());
    let shading =
        mesh.interpolation(&points, &kernel, estimator, AutoSpacing::AVERAGED).expect("a modest grid");
    (mesh, shading)
}

/// Finding D_y by a search for each surface point.
#[divan::bench(args = [1.5, 3.0])]
fn gather(bencher: Bencher, spacings: f32) {
    let (mesh, shading) = mesh(1, spacings, Estimator::PerLight);
    let surfaces = surfaces();
    let mut neighbours = Neighbours::default();
    bencher.counter(SURFACES).bench_local(|| {
        for surface in &surfaces {
            shading.neighbourhoods.find(&mesh.store().points, black_box(surface), &mut neighbours);
        }
        neighbours.ids().len()
    });
}

/// Finding the points of all D_y, by a search for each cell.
#[divan::bench(args = [1.5, 3.0])]
fn needed(bencher: Bencher, spacings: f32) {
    let (mesh, shading) = mesh(1, spacings, Estimator::PerLight);
    let lights = PackedLights::of_scene(&scene(1));
    let lookup = mesh.view(&lights, &shading).lookup;
    let surfaces = surfaces();
    bencher.counter(SURFACES).bench_local(|| vectorize(Needed { lookup, surfaces: black_box(&surfaces) }));
}

struct Needed<'a> {
    lookup: Lookup<'a>,
    surfaces: &'a [SurfacePoint],
}

impl NullaryFnOnce for Needed<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        self.lookup.needed(self.surfaces.iter()).into_bricks().count()
    }
}

/// Σ E φ2/φ1 over the lights.
#[divan::bench(args = [16, 100, 1000])]
fn illuminate(bencher: Bencher, lights: usize) {
    let scene = scene(lights);
    let table = PackedLights::of_scene(&scene);
    let surfaces = surfaces();
    bencher.counter(SURFACES).bench_local(|| vectorize(Illuminate { table: &table, surfaces: &surfaces }));
}

struct Illuminate<'a> {
    table: &'a PackedLights,
    surfaces: &'a [SurfacePoint],
}

impl NullaryFnOnce for Illuminate<'_> {
    type Output = Vec3;

    #[inline(always)]
    fn call(self) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for surface in self.surfaces {
            sum += self.table.irradiance(black_box(surface), Unoccluded);
        }
        sum
    }
}

/// Irradiance of a normal from the directional basis.
#[divan::bench]
fn irradiance(bencher: Bencher) {
    let coefficients = [Vec4::splat(0.1); spherical_harmonics::COEFFICIENTS];
    let surfaces = surfaces();
    bencher.counter(SURFACES).bench_local(|| {
        let light = |surface: &SurfacePoint| {
            spherical_harmonics::irradiance(black_box(&coefficients), surface.shading_normal)
        };
        surfaces.iter().map(light).sum::<Vec3>()
    });
}

/// Tracing and summing up at mesh points, by what is derived.
#[divan::bench(args = [Basis::Bits, Basis::Light, Basis::Irradiance])]
fn evaluate(bencher: Bencher, basis: Basis) {
    let scene = scene(100);
    let accel = BvhAccel::build(&scene).expect("finite triangles");
    let table = PackedLights::of_scene(&scene);
    let points: Vec<Vec3> = surfaces().iter().map(|surface| surface.position).collect();
    bencher.counter(points.len()).bench_local(|| {
        let mut field = DirectField::default();
        let rays = field.trace(&accel, &table, black_box(&points));
        field.derive(&table, basis, &points);
        rays
    });
}

/// Shading one surface point with all its mesh points known.
#[divan::bench(args = [Estimator::PerLight, Estimator::Ratio, Estimator::Directional])]
fn shade(bencher: Bencher, estimator: Estimator) {
    let scene = scene(100);
    let accel = BvhAccel::build(&scene).expect("finite triangles");
    let (lights, emissive) = (PackedLights::of_scene(&scene), EmissiveTriangles::default());
    let world = World { accel: &accel, scene: &scene, lights: &lights, emissive: &emissive };
    let (mut mesh, shading) = mesh(100, 1.5, estimator);
    let surfaces = surfaces();
    let needed = mesh.view(&lights, &shading).lookup.needed_anywhere(surfaces.iter());
    mesh.evaluate(world, &shading, &needed);
    let view = mesh.view(&lights, &shading);
    let mut scratch = LookupScratch::for_tile();
    bencher
        .counter(SURFACES)
        .bench_local(|| vectorize(Shade { view, accel: &accel, surfaces: &surfaces, scratch: &mut scratch }));
}

struct Shade<'a> {
    view: DirectView<'a>,
    accel: &'a BvhAccel,
    surfaces: &'a [SurfacePoint],
    scratch: &'a mut LookupScratch,
}

impl NullaryFnOnce for Shade<'_> {
    type Output = Vec3;

    #[inline(always)]
    fn call(self) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for surface in self.surfaces {
            sum += self.view.illumination(self.accel, surface, self.scratch);
        }
        sum
    }
}

/// One packet from neighbouring points towards one light.
#[divan::bench(consts = [4, 8, 16])]
fn occluded_packet<const N: usize>(bencher: Bencher) {
    let scene = scene(1);
    let accel = BvhAccel::build(&scene).expect("finite triangles");
    let light = scene.lights[0].position;
    let mut packet = RayPacket::<N>::empty();
    for lane in 0..N {
        let origin = Vec3::new(0.5 + 0.01 * lane as f32, 0.1, 0.5);
        packet.set_lane(lane, &Ray::between(origin, light));
    }
    let active = ((1u64 << N) - 1) as u32;
    bencher
        .counter(N)
        .with_inputs(|| packet)
        .bench_local_refs(|packet| accel.occluded_packet(active, packet, Coherence::Coherent));
}
