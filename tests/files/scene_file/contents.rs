//! What points, lights and geometry of a scene file come to.

use std::f32::consts::PI;

use lightmesh::scene::{LightKind, TriangleMaterials};

use super::*;

#[test]
fn points_come_from_a_file() {
    let scene = loaded("[light_mesh]\npoints_file = \"points.csv\"");
    let PointLayout::List(points) = scene.settings.mesh.direct.layout else { panic!("not a list") };
    assert_eq!(*points, [Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)]);
}

/// SplitMix64 from seed 0 starts with e220a8397b1dcdaf 6e789e6aa1b965f4 06c45d188009454f (its authors' reference
/// implementation); the upper 24 bits are the coordinates.
#[test]
fn random_lights_follow_the_documented_generator() {
    let scene = loaded("[[light_box]]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\ncount = 2\ntotal_intensity = 3");
    let unit = |bits: u32| bits as f32 / (1 << 24) as f32;
    let first = scene.scene.lights[0];
    assert_eq!(first.position, Vec3::new(unit(0xe220a8), unit(0x6e789e), unit(0x06c45d)));
    assert_eq!((scene.scene.lights.len(), first.intensity), (2, Vec3::splat(1.5)));
}

/// A radius makes a ball of a point, which is seen unless told otherwise, and a disc of a spot; a size makes a rectangle. What is seen has the radiance of
/// its intensity, and only the light of discs and rectangles is that of their triangles.
#[test]
fn lamps_have_their_size() {
    let table = "[[light]]\nintensity = 6\nposition = [0, 3, 0]\n";
    for (keys, lights, area, is_light) in [
        ("radius = 0.5", 1, 4.0 * PI * 0.25, true),
        ("radius = 0.5\nvisible = false", 1, 0.0, true),
        ("direction = [0, -1, 0]\nradius = 0.5", 0, PI * 0.25, false),
        ("direction = [0, -1, 0]\nsize = [3, 0.5]\nup = [1, 0, 0]", 0, 1.5, false),
    ] {
        let scene = loaded(&format!("{table}{keys}")).scene;
        let balls = scene.lights.iter().filter(|light| light.kind == LightKind::Ball { radius: 0.5 });
        assert_eq!((scene.lights.len(), balls.count()), (lights, lights), "{keys}");
        let mut found = 0.0;
        for mesh in &scene.meshes {
            for triangle in 0..mesh.triangles.len() as u32 {
                let [a, b, c] = mesh.corners(triangle);
                let material = &scene.materials[mesh.materials.of(triangle) as usize];
                if material.emission == Vec3::ZERO {
                    continue;
                }
                found += 0.5 * (b - a).cross(c - a).length();
                let disc = if keys.contains("size") { 1.5 } else { PI * 0.25 };
                assert!((material.emission.x - 6.0 / disc).abs() < 1e-4, "{keys}: {}", material.emission);
                assert_eq!((material.lamp, material.diffuse), (is_light, Vec3::ZERO), "{keys}");
            }
        }
        assert!((found - area).abs() <= 0.02 * area, "{keys}: {found} for {area}");
    }
}

/// Each channel of each light gets a factor of its own in [1 − v, 1 + v).
#[test]
fn random_lights_vary_in_colour_within_the_range() {
    let lights = |variation: &str| {
        let table = "[[light_box]]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\ncount = 200\nintensity = 2\n";
        loaded(&format!("{table}{variation}")).scene.lights
    };
    assert!(lights("").iter().all(|light| light.intensity == Vec3::splat(2.0)));
    let varied = lights("color_variation = 0.25");
    let channels: Vec<f32> = varied.iter().flat_map(|light| light.intensity.to_array()).collect();
    assert!(channels.iter().all(|channel| (1.5..2.5).contains(channel)), "{channels:?}");
    let (least, most) = channels.iter().fold((f32::MAX, 0.0f32), |(a, b), &c| (a.min(c), b.max(c)));
    assert!(least < 1.6 && most > 2.4, "600 factors reach from {least} to {most}");
    assert!(varied.iter().any(|light| light.intensity.x != light.intensity.y), "channels vary on their own");
}

/// A light with a position and a direction is a spot light whose cone angles count from the direction.
#[test]
fn spot_lights_have_their_cones() {
    let table = "[[light]]\nposition = [0, 3, 0]\ndirection = [0, -2, 0]\ncone = [30, 60]\nintensity = 1";
    let LightKind::Spot { direction, inner_cosine, outer_cosine } = loaded(table).scene.lights[0].kind else {
        panic!("no spot light");
    };
    assert_eq!(direction, Vec3::NEG_Y);
    assert!((inner_cosine - 0.75f32.sqrt()).abs() < 1e-6 && (outer_cosine - 0.5).abs() < 1e-6);
}

#[test]
fn grid_lights_stand_in_the_cells_centres() {
    let scene = loaded("[[light_grid]]\nmin = [0, 5, 0]\nmax = [4, 5, 3]\ncounts = [2, 1, 3]\nintensity = 2");
    let positions: Vec<Vec3> = scene.scene.lights.iter().map(|light| light.position).collect();
    let expected = [[1.0, 0.5], [3.0, 0.5], [1.0, 1.5], [3.0, 1.5], [1.0, 2.5], [3.0, 2.5]];
    assert_eq!(positions, expected.map(|[x, z]| Vec3::new(x, 5.0, z)));
}

#[test]
fn geometry_is_scaled_then_turned_then_moved() {
    let scene = loaded(
        "[[geometry]]\nfile = \"model.obj\"\nscale = [2, 1, 1]\nrotate = [90, 90, 0]\ntranslate = [10, 0, 0]",
    );
    // (1, 0, 0) → (2, 0, 0), unmoved by the turn about x, → (0, 0, −2) about y → (10, 0, −2).
    let mesh = &scene.scene.meshes[0];
    let [_, corner, _] = mesh.corners(0);
    assert!(corner.distance(Vec3::new(10.0, 0.0, -2.0)) < 1e-5, "{corner}");
    assert!(scene.scene.instances[0].to_world.is_none(), "moved, as it stands in one place only");
}

/// A mirrored model keeps its front outside: the triangle's normal is the mirror image of what it was.
#[test]
fn mirroring_keeps_the_front() {
    let plain = loaded("");
    let mirrored = loaded("[[geometry]]\nfile = \"model.obj\"\nscale = [1, 1, -1]");
    let normal = |scene: &LoadedScene| {
        let [a, b, c] = scene.scene.meshes[0].corners(0);
        (b - a).cross(c - a)
    };
    assert_eq!(normal(&mirrored), normal(&plain) * Vec3::new(1.0, 1.0, -1.0));
}

#[test]
fn a_model_in_two_places_is_stored_once() {
    let scene = loaded(
        "[[geometry]]\nfile = \"model.obj\"\n[[geometry]]\nfile = \"./model.obj\"\ntranslate = [1, 0, 0]",
    );
    assert_eq!((scene.scene.meshes.len(), scene.scene.instances.len()), (1, 2));
}

#[test]
fn overrides_of_an_object_leave_others_with_the_same_material_alone() {
    let scene = loaded("[[material]]\nobject = \"lamp\"\nemission = 4");
    let mesh = &scene.scene.meshes[0];
    let material = |triangle| &scene.scene.materials[mesh.materials.of(triangle) as usize];
    assert_eq!((material(0).emission, material(1).emission), (Vec3::splat(4.0), Vec3::ZERO));
    assert_eq!(material(0).diffuse, Vec3::new(0.1, 0.2, 0.3), "what is not given stays");
    let by_name = loaded("[[material]]\nname = \"leaf\"\ntwo_sided = true\ncull = true");
    assert_eq!(by_name.scene.meshes[0].materials, TriangleMaterials::Uniform(0));
    assert!(by_name.scene.materials[0].two_sided && by_name.scene.materials[0].cull);
}
