//! A mesh point is evaluated at most once in its life, and only if a surface point asks for it (method §9).

use std::collections::HashMap;
use std::sync::Mutex;

use glam::Vec3;
use lightmesh::World;
use lightmesh::accel::{Accel, BvhAccel, Coherence, LaneMask, RayHitPacket, RayPacket};
use lightmesh::light_mesh::direct::DirectMesh;
use lightmesh::light_mesh::indirect::{DirectTransport, IndirectMesh};
use lightmesh::light_mesh::points::AutoSpacing;
use lightmesh::lights::{EmissiveTriangles, PackedLights};
use lightmesh::render::RenderStats;
use lightmesh::scene::load::LoadedScene;
use lightmesh::scene::{Camera, Hit, Ray, SurfacePoint};
use lightmesh::settings::{IndirectSettings, Leaks, Settings, Spacing};

use crate::common::{bits, camera, forest, session, settings_at, surface_point};

/// Ray queries that keep account of all occlusion rays towards lights: how often each was asked.
struct Witness {
    accel: BvhAccel,
    lights: Vec<Vec3>,
    asked: Mutex<HashMap<[u32; 6], u32>>,
}

impl Witness {
    fn new(loaded: &LoadedScene) -> Self {
        let lights = loaded.scene.lights.iter().map(|light| light.position).collect();
        Self { accel: BvhAccel::build(&loaded.scene).unwrap(), lights, asked: Mutex::default() }
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
            let [x, y, z, dx, dy, dz] = ray;
            let end = Vec3::new(x + dx, y + dy, z + dz);
            if self.lights.iter().any(|light| light.abs_diff_eq(end, 1e-4)) {
                *asked.entry(ray.map(f32::to_bits)).or_default() += 1;
            }
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
    let mut settings = settings_at((70, 70));
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.7));
    // Nothing but mesh points asks for occlusion then.
    settings.shading.kernel.leaks = Leaks::Allow;
    settings
}

fn with_indirect() -> Settings {
    let mut settings = settings();
    let mut indirect = IndirectSettings { directions: 16, bounces: 2, ..IndirectSettings::default() };
    indirect.points.spacing = Spacing::Units(Vec3::splat(2.5));
    settings.mesh.indirect = Some(indirect);
    settings.shading.indirect.kernel.leaks = Leaks::Allow;
    settings
}

fn second_camera() -> Camera {
    camera(Vec3::new(-6.0, 5.0, 9.0), Vec3::new(0.0, 2.0, 0.0), 50.0)
}

/// Surface points on the ground along x, every fifth of a unit.
fn on_the_ground(from: i32, to: i32) -> Vec<SurfacePoint> {
    (from..to).map(|i| surface_point(Vec3::new(i as f32 / 5.0, 0.3, 1.0), Vec3::Y)).collect()
}

/// No occlusion ray is ever traced twice, however often and in whatever combination points are asked for; also not by the
/// indirect mesh, whose hits ask for the light of the same surfaces again and again.
#[test]
fn no_occlusion_ray_is_traced_twice() {
    let loaded = forest(1_500, LIGHTS as u32);
    let settings = with_indirect();
    let witness = Witness::new(&loaded);
    let scene = &loaded.scene;
    let (lights, emissive) = (PackedLights::of_scene(scene), EmissiveTriangles::of_scene(scene));
    let world = World { accel: &witness, scene, lights: &lights, emissive: &emissive };
    let mut direct = DirectMesh::new(scene.bounds());
    let Settings { mesh, shading, .. } = &settings;
    let reading = direct
        .interpolation(&mesh.direct, &shading.kernel, shading.estimator, AutoSpacing::AVERAGED)
        .unwrap();
    let mut indirect = IndirectMesh::new(scene.bounds(), mesh.indirect.as_ref().unwrap());
    let reading_indirect = indirect.interpolation(&shading.indirect).unwrap();
    let (mut rays, mut evaluated, mut at_patches) = (0, 0, 0);
    for (from, to) in [(-20, 5), (-5, 20), (-20, 20)] {
        let surfaces = on_the_ground(from, to);
        let needed = direct.view(&lights, &reading).lookup.needed_anywhere(surfaces.iter());
        let counted = direct.evaluate(world, &reading, &needed);
        let needed = indirect.view(&reading_indirect).lookup.needed_anywhere(surfaces.iter());
        let transport = DirectTransport { interpolation: &reading, scale: 1.0 };
        let of_indirect = indirect.evaluate(world, &mut direct, transport, &reading_indirect, needed);
        assert_eq!(counted.inside, 0);
        // From the surfaces that the indirect mesh sees.
        at_patches += of_indirect.shadow;
        rays += counted.shadow + of_indirect.direct.shadow;
        evaluated += counted.evaluated + of_indirect.direct.evaluated;
    }
    assert_eq!(rays, evaluated * LIGHTS);
    // Others look from surface to surface.
    let (asked, most) = witness.account();
    assert!(
        rays < asked && asked < rays + at_patches && most == 1,
        "{asked} rays, each {most} times at most"
    );
}

/// Occlusion rays equal points times lights across blocks, repeated renders and a second camera.
#[test]
fn no_mesh_point_is_evaluated_twice() {
    let loaded = forest(1_500, LIGHTS as u32);
    for mut settings in [settings(), with_indirect()] {
        settings.view.block_samples = Some(1_500);
        let mut session = session(&loaded.scene);
        let mut render = |camera: &Camera| session.render(camera, &settings).unwrap();
        let (first, stats) = render(&loaded.cameras[0]);
        let evaluated = stats.mesh_points.direct.evaluated;
        // What is left are rays from surfaces that the indirect mesh sees.
        let of_indirect =
            |stats: &RenderStats| stats.rays.shadow - stats.mesh_points.direct.evaluated * LIGHTS;
        assert_eq!(of_indirect(&stats) > 0, settings.mesh.indirect.is_some());
        assert!(stats.mesh_points.direct.needed > evaluated, "neighbouring blocks share mesh points");

        // The same again costs no ray.
        let (again, stats) = render(&loaded.cameras[0]);
        assert_eq!(stats.rays.shadow, 0);
        assert_eq!(stats.rays.indirect, 0);
        assert_eq!(stats.mesh_points.direct.evaluated, 0);
        assert!(bits(&again) == bits(&first));

        // Another view evaluates what is new in it alone.
        let (_, stats) = render(&second_camera());
        assert!(settings.mesh.indirect.is_some() || of_indirect(&stats) == 0);
        assert!(stats.mesh_points.direct.evaluated > 0);
    }
}

/// What was known before changes nothing: each view looks the same whether or not another was rendered first. (With
/// several bounces that holds to within their tolerance only.)
#[test]
fn a_view_does_not_depend_on_the_views_before_it() {
    let loaded = forest(1_500, LIGHTS as u32);
    let mut one_bounce = with_indirect();
    one_bounce.mesh.indirect.as_mut().unwrap().bounces = 1;
    for settings in [settings(), one_bounce] {
        let render = |cameras: [&Camera; 2]| {
            let mut session = session(&loaded.scene);
            cameras.map(|camera| session.render(camera, &settings).unwrap())
        };
        let (first, second) = (&loaded.cameras[0], &second_camera());
        let [(one, _), (two, stats)] = render([first, second]);
        let [(two_before, other_order), (one_after, last)] = render([second, first]);
        assert!(bits(&one) == bits(&one_after) && bits(&two) == bits(&two_before));
        // Both orders come to the same points in all.
        let [counted, both] = [stats, other_order].map(|stats| stats.mesh_points.direct.evaluated);
        assert!(counted < both && last.mesh_points.direct.evaluated > 0);
    }
}

/// Points that no surface point asks for stay unknown: most of space is empty.
#[test]
fn unneeded_points_are_never_evaluated() {
    let loaded = forest(1_500, LIGHTS as u32);
    let settings = settings();
    let mut session = session(&loaded.scene);
    let mut counters = |camera: &Camera| session.render(camera, &settings).unwrap().1.mesh_points.direct;
    let sky = camera(Vec3::new(0.0, 30.0, 0.0), Vec3::new(0.1, 60.0, 0.0), 40.0);
    assert_eq!(counters(&sky).evaluated, 0);
    let counters = counters(&loaded.cameras[0]);
    assert!(counters.evaluated > 0 && counters.evaluated < counters.total / 2, "{counters:?}");
}
