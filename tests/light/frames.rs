//! A session that goes from frame to frame: it forgets what a motion may have changed and nothing else, and every frame is the image that a
//! session which saw no other frame has (method §9).

use glam::{Affine3A, Quat, Vec3};
use lightmesh::accel::BackendChoice;
use lightmesh::render::{Moved, Session, SessionError};
use lightmesh::sampling::SplitMix64;
use lightmesh::scene::{Camera, Falloff, Frame, Instance, Light, Material, Scene, TriangleMesh};
use lightmesh::settings::{Estimator, IndirectForm, IndirectSettings, Leaks, Resolve, Settings, Spacing};

use crate::common::{Builder, backend_if_installed, bits, camera, grey, settings_at};

const SIZE: Vec3 = Vec3::new(8.0, 3.0, 6.0);
/// Boxes that move.
const BOXES: u32 = 5;

/// A room with a pillar, small boxes as instances, and lamps of all kinds all over it; box 0 glows where `glowing`.
fn room(glowing: bool) -> Scene {
    let mut builder = Builder::default();
    builder.cuboid(Vec3::ZERO, SIZE, true, 0);
    builder.cuboid(Vec3::new(3.0, 0.0, 2.0), Vec3::new(3.5, 3.0, 2.5), false, 0);
    let mut random = SplitMix64::new(11);
    let mut place = || random.in_box(Vec3::splat(0.2), SIZE - 0.2);
    let mut lights: Vec<Light> = (0..36).map(|_| Light::point(place(), Vec3::splat(0.3))).collect();
    lights.push(Light::ball(place(), 0.1, Vec3::ONE));
    lights.push(Light::spot(place(), Vec3::NEG_Y, [20.0, 50.0], Vec3::splat(4.0)));
    lights.push(Light::directional(Vec3::new(0.1, -1.0, 0.2), Vec3::ONE));
    let glow = Material { emission: Vec3::splat(if glowing { 3.0 } else { 0.0 }), ..grey(0.5) };
    let mut scene = builder.scene(vec![grey(0.7), glow], lights, Falloff::InverseSquare);
    let mut corners = Builder::default();
    corners.cuboid(Vec3::splat(-0.25), Vec3::splat(0.25), false, 0);
    let unit = corners.scene(Vec::new(), Vec::new(), Falloff::None).meshes.remove(0);
    for number in 0..BOXES {
        let mesh = scene.meshes.len() as u32;
        let of_box = TriangleMesh::clone(&unit).with_material(u32::from(number == 0));
        scene.meshes.push(of_box.into());
        let to_world = Some(Affine3A::from_translation(Vec3::splat(0.5 + 0.4 * number as f32)));
        scene.instances.push(Instance { mesh, to_world });
    }
    scene
}

/// Some boxes at random places; every other frame a lamp moves too.
fn frame(number: i64, scene: &Scene) -> Frame {
    let mut random = SplitMix64::new(100 + number as u64);
    let instances = (1..=BOXES).filter(|index| i64::from(*index) % 3 != number % 3).map(|index| {
        let turn = Quat::from_axis_angle(Vec3::ONE.normalize(), number as f32 + index as f32);
        let at = random.in_box(Vec3::splat(0.5), SIZE - 0.5);
        (index, Some(Affine3A::from_rotation_translation(turn, at)))
    });
    let mut frame = Frame { number, instances: instances.collect(), ..Frame::default() };
    if number % 2 == 1 {
        let lamp = Light { position: scene.lights[3].position + Vec3::splat(0.1), ..scene.lights[3] };
        frame.lights.push((3, lamp));
    }
    frame
}

fn view() -> Camera {
    camera(Vec3::new(7.5, 2.0, 5.5), Vec3::new(2.0, 1.0, 1.0), 60.0)
}

fn settings() -> Settings {
    let mut settings = settings_at((48, 36));
    settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(0.5));
    settings
}

fn image(session: &mut Session, settings: &Settings) -> (Vec<u32>, u64) {
    let (image, stats) = session.render(&view(), settings).expect("an image");
    (bits(&image), stats.rays.shadow)
}

/// Goes through some frames, and compares each to that of a new session; returns what the moves kept, and the rays of the session and of
/// the new ones.
fn walk(scene: &Scene, choice: BackendChoice, settings: &Settings, frames: i64) -> (Vec<Moved>, u64, u64) {
    let mut session = Session::new(scene.clone(), choice).expect("a sound scene");
    image(&mut session, settings);
    let mut moved_scene = scene.clone();
    let (mut moves, mut rays, mut new_rays) = (Vec::new(), 0, 0);
    for number in 0..frames {
        let frame = frame(number, scene);
        frame.apply(&mut moved_scene);
        moves.push(session.move_to(&frame).expect("the parts are there"));
        assert_eq!(*session.scene(), moved_scene);
        let (kept, retraced) = image(&mut session, settings);
        let mut new = Session::new(moved_scene.clone(), choice).expect("a sound scene");
        let (expected, all) = image(&mut new, settings);
        assert!(kept == expected, "frame {number} on {choice}: {settings:?}");
        rays += retraced;
        new_rays += all;
    }
    (moves, rays, new_rays)
}

fn choices() -> impl Iterator<Item = BackendChoice> {
    let all = [BackendChoice::Bvh, BackendChoice::Embree];
    all.into_iter().filter(|&choice| backend_if_installed(choice, &room(false)).is_some())
}

/// Boxes and a lamp move through the room: each frame is that of a new session, for every estimator, resolution of shadows and leak rule, and
/// most bits stay. With averages no ray is traced but those from mesh points, so that fewer rays than those of new sessions show that kept bits are used.
#[test]
fn frames_are_those_of_new_sessions() {
    type Change = fn(&mut Settings);
    let changes: [Change; 5] = [
        |s| s.shading.kernel.leaks = Leaks::Allow,
        |s| s.shading.kernel.leaks = Leaks::Invalidate,
        |s| s.shading.resolve = Resolve::Trace,
        |s| s.shading.estimator = Estimator::Directional,
        |s| s.shading.estimator = Estimator::Paper,
    ];
    let scene = room(false);
    for choice in choices() {
        for (number, change) in changes.iter().enumerate() {
            let mut settings = settings();
            change(&mut settings);
            let (moves, rays, new_rays) = walk(&scene, choice, &settings, 6);
            for moved in &moves {
                assert!(moved.instances > 0 && moved.lights <= 1, "{moved:?}");
                let known = moved.known;
                assert!(known.bits_forgotten > 0 && known.bits_kept > known.bits_forgotten, "{known:?}");
            }
            assert!(number != 0 || 2 * rays < new_rays, "{rays} rays of {new_rays}");
        }
    }
}

/// A box that glows is a lamp that moves, and one that is seen by all surfaces.
#[test]
fn lamps_with_a_shape_may_move() {
    let mut settings = settings();
    settings.shading.lambertian = true;
    walk(&room(true), BackendChoice::Bvh, &settings, 6);
}

/// Light from surfaces, and points that build on coarser ones, are found anew.
#[test]
fn what_builds_on_other_values_is_forgotten() {
    let scene = room(false);
    let mut with_levels = settings();
    with_levels.mesh.direct.levels = 2;
    let (moves, ..) = walk(&scene, BackendChoice::Bvh, &with_levels, 6);
    assert!(moves.iter().all(|moved| moved.known.bits_kept == 0 && moved.known.points_kept == 0));
    let mut with_surface = settings();
    with_surface.shading.lambertian = true;
    with_surface.mesh.indirect = Some(IndirectSettings {
        form: IndirectForm::Surface,
        directions: 16,
        bounces: 2,
        ..IndirectSettings::default()
    });
    walk(&scene, BackendChoice::Bvh, &with_surface, 2);
}

/// A camera that moves alone forgets nothing; nor does a frame that has everything where it is.
#[test]
fn a_moving_camera_forgets_nothing() {
    let scene = room(false);
    let mut session = Session::new(scene.clone(), BackendChoice::Bvh).expect("a sound scene");
    let mut settings = settings();
    settings.shading.kernel.leaks = Leaks::Allow;
    let (_, rays) = image(&mut session, &settings);
    let moved_camera = Frame { cameras: vec![(0, view().with_fov(30.0))], ..Frame::default() };
    let still = Frame {
        lights: vec![(3, scene.lights[3])],
        instances: vec![(1, scene.instances[1].to_world)],
        ..Frame::default()
    };
    for frame in [moved_camera, still] {
        let moved = session.move_to(&frame).expect("nothing to move");
        assert_eq!((moved.instances, moved.lights, moved.known.bits_forgotten), (0, 0, 0));
        assert_eq!(moved.known.bits_kept, rays, "a bit for each ray");
        assert_eq!(image(&mut session, &settings).1, 0, "nothing is traced again");
    }
}

/// What has left the scene's bounds changes where mesh points lie, unless the extent holds it: then bits stay.
#[test]
fn the_extent_keeps_mesh_points_where_they_are() {
    let away = Affine3A::from_translation(SIZE + 2.0);
    let frame = Frame { instances: vec![(1, Some(away))], ..Frame::default() };
    for roomy in [false, true] {
        let mut scene = room(false);
        if roomy {
            scene.extent = lightmesh::Bounds { min: Vec3::splat(-3.0), max: SIZE + 3.0 };
        }
        let mut session = Session::new(scene.clone(), BackendChoice::Bvh).expect("a sound scene");
        image(&mut session, &settings());
        let moved = session.move_to(&frame).expect("a box");
        assert_eq!(moved.known.bits_kept > 0, roomy);
        frame.apply(&mut scene);
        let mut new = Session::new(scene, BackendChoice::Bvh).expect("a sound scene");
        assert!(image(&mut session, &settings()).0 == image(&mut new, &settings()).0);
    }
}

/// A frame of another scene, or one with a light nowhere, is an error after which all is as before.
#[test]
fn what_cannot_be_moved_is_an_error() {
    let scene = room(false);
    let mut session = Session::new(scene.clone(), BackendChoice::Bvh).expect("a sound scene");
    let box_there = (1, Some(Affine3A::from_translation(Vec3::ONE)));
    let nowhere = Light { position: Vec3::NAN, ..scene.lights[0] };
    for wrong in [
        Frame { instances: vec![box_there, (99, None)], number: 7, ..Frame::default() },
        Frame { instances: vec![box_there], lights: vec![(99, scene.lights[0])], ..Frame::default() },
        Frame { instances: vec![box_there], lights: vec![(0, nowhere)], ..Frame::default() },
    ] {
        let error = session.move_to(&wrong).expect_err("there is no such part");
        assert!(matches!(error, SessionError::NothingToMove { .. } | SessionError::Scene(_)), "{error}");
        assert_eq!(*session.scene(), scene);
    }
}
