//! A mesh point is evaluated at most once in its life, and only if a surface point asks for it (spec §9).

use std::collections::HashMap;
use std::sync::Mutex;

use glam::Vec3;
use lightmesh::accel::{Accel, BvhAccel, Coherence, LaneMask, RayHitPacket, RayPacket};
use lightmesh::light_mesh::{DirectMesh, IndirectMesh, MeshPoints, NeededPoints, Neighbours, PointMask};
use lightmesh::render::{LightMeshes, render_light_mesh};
use lightmesh::scene::load::LoadedScene;
use lightmesh::scene::{Camera, Hit, Ray, SurfacePoint};
use lightmesh::settings::{IndirectSettings, Leaks, Settings, Spacing};

use crate::common::{backend, bits, camera, forest, surface_point};

/// Ray queries that keep account of all occlusion rays: how often each was asked.
struct Witness {
    accel: BvhAccel,
    asked: Mutex<HashMap<[u32; 6], u32>>,
}

impl Witness {
    fn new(loaded: &LoadedScene) -> Self {
        Self { accel: BvhAccel::build(&loaded.scene).unwrap(), asked: Mutex::default() }
    }

    /// Distinct occlusion rays, and how often the most frequent one was asked.
    fn account(&self) -> (u64, u32) {
        let asked = self.asked.lock().unwrap();
        (asked.len() as u64, asked.values().copied().max().unwrap_or(0))
    }
}

impl Accel for Witness {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.accel.intersect(ray)
    }

    fn occluded(&self, _: &Ray) -> bool {
        unreachable!("occlusion rays travel in packets")
    }

    fn intersect_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayHitPacket<N>,
        coherence: Coherence,
    ) {
        self.accel.intersect_packet(active, packet, coherence);
    }

    fn occluded_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayPacket<N>,
        coherence: Coherence,
    ) -> LaneMask {
        let mut asked = self.asked.lock().unwrap();
        for lane in (0..N).filter(|lane| active >> lane & 1 == 1) {
            let ray = [
                packet.org_x[lane],
                packet.org_y[lane],
                packet.org_z[lane],
                packet.dir_x[lane],
                packet.dir_y[lane],
                packet.dir_z[lane],
            ];
            *asked.entry(ray.map(f32::to_bits)).or_default() += 1;
        }
        drop(asked);
        self.accel.occluded_packet(active, packet, coherence)
    }

    fn memory_bytes(&self) -> usize {
        self.accel.memory_bytes()
    }
}

const LIGHTS: u64 = 5;

fn settings() -> Settings {
    let mut settings = Settings { resolution: (70, 70), ..Settings::default() };
    settings.light_mesh.points.spacing = Spacing::Units(Vec3::splat(0.7));
    // Nothing but mesh points asks for occlusion then.
    settings.light_mesh.points.leaks = Leaks::Allow;
    settings
}

fn with_indirect() -> Settings {
    let mut settings = settings();
    let mut indirect = IndirectSettings { directions: 16, bounces: 2, ..IndirectSettings::default() };
    indirect.points.spacing = Spacing::Units(Vec3::splat(2.5));
    indirect.points.leaks = Leaks::Allow;
    settings.light_mesh.indirect = Some(indirect);
    settings
}

fn second_camera() -> Camera {
    camera(Vec3::new(-6.0, 5.0, 9.0), Vec3::new(0.0, 2.0, 0.0), 50.0)
}

/// The mesh points in the neighbourhoods of surface points.
fn needed(mesh: &MeshPoints, surfaces: &[SurfacePoint]) -> PointMask {
    let mut needed = NeededPoints::default();
    let mut neighbours = Neighbours::default();
    for surface in surfaces {
        mesh.neighbours(surface, &mut neighbours);
        neighbours.ids().iter().for_each(|&id| needed.insert(id));
    }
    PointMask::union(needed.into_bricks())
}

/// Surface points on the ground along x, every fifth of a unit.
fn on_the_ground(from: i32, to: i32) -> Vec<SurfacePoint> {
    (from..to).map(|i| surface_point(Vec3::new(i as f32 / 5.0, 0.3, 1.0), Vec3::Y)).collect()
}

/// No occlusion ray is ever traced twice, however often and in whatever combination points are asked for; also not by the
/// indirect mesh, whose hits ask for direct mesh points again and again.
#[test]
fn no_occlusion_ray_is_traced_twice() {
    let loaded = forest(1_500, LIGHTS as u32);
    let settings = with_indirect().light_mesh;
    let witness = Witness::new(&loaded);
    let mut direct = DirectMesh::new(&loaded.scene, &settings).unwrap();
    let mut indirect = IndirectMesh::new(&loaded.scene, &settings.indirect.unwrap()).unwrap();
    let mut rays = 0;
    for (from, to) in [(-20, 5), (-5, 20), (-20, 20)] {
        let surfaces = on_the_ground(from, to);
        rays += direct.evaluate(&witness, &loaded.scene, &needed(&direct.points, &surfaces));
        let of_indirect = needed(&indirect.points, &surfaces);
        rays += indirect.evaluate(&witness, &loaded.scene, &mut direct, 1.0, of_indirect).shadow;
    }
    assert_eq!(rays, direct.points.counters.evaluated * LIGHTS);
    assert_eq!(witness.account(), (rays, 1));
}

/// Occlusion rays equal points times lights across blocks, repeated renders and a second camera.
#[test]
fn no_mesh_point_is_evaluated_twice() {
    let loaded = forest(1_500, LIGHTS as u32);
    let backend = backend(&loaded.scene);
    for settings in [settings(), with_indirect()] {
        let settings = Settings { block_pixels: Some(1_500), ..settings };
        let mut meshes = LightMeshes::new(&loaded.scene, &settings).unwrap();
        let mut render =
            |camera: &Camera| render_light_mesh(&backend, &loaded.scene, camera, &settings, &mut meshes, &());
        let (first, stats) = render(&loaded.cameras[0]);
        let evaluated = stats.mesh_points.direct.evaluated;
        assert_eq!(stats.rays.shadow, evaluated * LIGHTS);
        assert!(stats.mesh_points.direct.needed > evaluated, "neighbouring blocks share mesh points");

        // The same again costs no ray.
        let (again, stats) = render(&loaded.cameras[0]);
        assert_eq!(stats.rays.shadow, 0);
        assert_eq!(stats.rays.indirect, 0);
        assert_eq!(stats.mesh_points.direct.evaluated, evaluated);
        assert!(bits(&again) == bits(&first));

        // Another view evaluates what is new in it alone.
        let (_, stats) = render(&second_camera());
        let both = stats.mesh_points.direct.evaluated;
        assert_eq!(stats.rays.shadow, (both - evaluated) * LIGHTS);
        assert!(both > evaluated);
    }
}

/// What was known before changes nothing: each view looks the same whether or not another was rendered first. (With
/// several bounces that holds to within their tolerance only.)
#[test]
fn a_view_does_not_depend_on_the_views_before_it() {
    let loaded = forest(1_500, LIGHTS as u32);
    let backend = backend(&loaded.scene);
    let mut one_bounce = with_indirect();
    one_bounce.light_mesh.indirect.as_mut().unwrap().bounces = 1;
    for settings in [settings(), one_bounce] {
        let render = |cameras: [&Camera; 2]| {
            let mut meshes = LightMeshes::new(&loaded.scene, &settings).unwrap();
            cameras
                .map(|camera| render_light_mesh(&backend, &loaded.scene, camera, &settings, &mut meshes, &()))
        };
        let (first, second) = (&loaded.cameras[0], &second_camera());
        let [(one, _), (two, stats)] = render([first, second]);
        let [(two_before, _), (one_after, other_order)] = render([second, first]);
        assert!(bits(&one) == bits(&one_after) && bits(&two) == bits(&two_before));
        assert_eq!(stats.mesh_points.direct.evaluated, other_order.mesh_points.direct.evaluated);
    }
}

/// Points that no surface point asks for stay unknown: most of space is empty.
#[test]
fn unneeded_points_are_never_evaluated() {
    let loaded = forest(1_500, LIGHTS as u32);
    let settings = settings();
    let backend = backend(&loaded.scene);
    let mut meshes = LightMeshes::new(&loaded.scene, &settings).unwrap();
    let mut counters = |camera: &Camera| {
        let (_, stats) = render_light_mesh(&backend, &loaded.scene, camera, &settings, &mut meshes, &());
        stats.mesh_points.direct
    };
    let sky = camera(Vec3::new(0.0, 30.0, 0.0), Vec3::new(0.1, 60.0, 0.0), 40.0);
    assert_eq!(counters(&sky).evaluated, 0);
    let counters = counters(&loaded.cameras[0]);
    assert!(counters.evaluated > 0 && counters.evaluated < counters.total / 2, "{counters:?}");
}
