//! Geometry: what is accepted, what is refused, filters and instances.

mod common;

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use common::{device, down, floor, scene_of};
use embree_sys::{
    BuildQuality, Device, Error, Geometry, Ray, Scene, SceneBuilder,
    packet::{INVALID_ID, MAX_COORDINATE, RayHitPacket},
};

/// Nearest hits, straight down at (0.25, 0.25) + cell, by a packet of N; (geom_id, prim_id).
fn packet_down<const N: usize>(scene: &Scene, cells: &[(f32, f32)]) -> Vec<Option<(u32, u32)>> {
    let mut packet = RayHitPacket::<N>::empty();
    for (lane, (x, y)) in cells.iter().enumerate() {
        packet.ray.org_x[lane] = x + 0.25;
        packet.ray.org_y[lane] = y + 0.25;
        packet.ray.org_z[lane] = 2.0;
        packet.ray.dir_z[lane] = -1.0;
        packet.ray.tfar[lane] = f32::INFINITY;
    }
    let mut shadow = packet.ray;
    let active = (1u32 << cells.len()) - 1;
    scene.intersect_packet(active, &mut packet, true);
    let mask = scene.occluded_packet(active, &mut shadow, true);
    (0..cells.len())
        .map(|lane| {
            let hit = packet.hit.geom_id[lane] != INVALID_ID;
            assert_eq!(mask >> lane & 1 == 1, hit, "nearest hit and occlusion agree");
            hit.then(|| (packet.hit.geom_id[lane], packet.hit.prim_id[lane]))
        })
        .collect()
}

fn triangle(device: &Device, corners: [[f32; 3]; 3]) -> Geometry {
    let vertices = corners.into_iter().chain([[0.0; 3]]).collect();
    Geometry::triangles(device, Arc::new(vertices), Arc::new(vec![[0, 1, 2]]), None).unwrap()
}

/// Without the padding vertex Embree would read past the buffer; with an index out of range anywhere.
#[test]
fn buffers_that_embree_would_overrun_are_refused() {
    let Some(device) = device() else { return };
    let make = |vertices: usize, triangles: Vec<[u32; 3]>| {
        Geometry::triangles(&device, Arc::new(vec![[0.0; 3]; vertices]), Arc::new(triangles), None).err()
    };
    assert_eq!(make(0, vec![]), Some(Error::VertexBuffer));
    assert_eq!(
        make(3, vec![[0, 1, 1], [0, 1, 2]]),
        Some(Error::IndexOutOfRange { triangle: 1, index: 2, vertices: 2 }),
        "the padding is not a vertex"
    );
    assert_eq!(
        make(4, vec![[0, u32::MAX, 2]]),
        Some(Error::IndexOutOfRange { triangle: 0, index: u32::MAX, vertices: 3 })
    );
    assert_eq!(make(4, vec![[0, 1, 2]]), None);
    assert_eq!(make(1, vec![]), None, "no triangles are no error");
}

/// A geometry without triangles, beside one with some, is never hit and does no harm.
#[test]
fn geometry_without_triangles_is_missed() {
    let Some(device) = device() else { return };
    let mut builder = SceneBuilder::new(&device).unwrap();
    let none = Geometry::triangles(&device, Arc::new(vec![[0.0; 3]]), Arc::new(vec![]), None).unwrap();
    builder.attach(0, none).unwrap();
    let (vertices, triangles) = floor(2);
    builder.attach(1, Geometry::triangles(&device, vertices, triangles, None).unwrap()).unwrap();
    let scene = builder.commit().unwrap();
    assert_eq!(scene.intersect1(&down(0.2, 0.2)).map(|hit| hit.geom_id), Some(1));
}

/// Ids come back as given, and one id cannot be used twice.
#[test]
fn geometry_ids_are_the_callers() {
    let Some(device) = device() else { return };
    let make = |x: f32| triangle(&device, [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]]);
    let mut builder = SceneBuilder::new(&device).unwrap();
    // 900 small geometries, ids in falling order and with gaps.
    for i in (0..900).rev() {
        builder.attach(3 * i, make(2.0 * i as f32)).unwrap();
    }
    assert_eq!(builder.attach(6, make(0.0)), Err(Error::GeometryId { id: 6 }));
    assert_eq!(builder.attach(INVALID_ID, make(0.0)), Err(Error::GeometryId { id: INVALID_ID }));
    let scene = builder.commit().unwrap();
    for i in 0..900u32 {
        let hit = scene.intersect1(&down(2.0 * i as f32 + 0.2, 0.2)).expect("a triangle is there");
        assert_eq!((hit.geom_id, hit.prim_id), (3 * i, 0));
        assert_eq!(scene.intersect1(&down(2.0 * i as f32 + 1.5, 0.2)), None);
    }
}

/// Triangles of NaN, infinite or enormous coordinates, and those without area, leave the others as they are.
#[test]
fn garbage_geometry_does_no_harm() {
    let Some(device) = device() else { return };
    let (good, good_triangles) = floor(4);
    let mut vertices = good[..good.len() - 1].to_vec();
    let mut triangles = (*good_triangles).clone();
    let values = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -f32::MAX, 2.0 * MAX_COORDINATE];
    for value in values {
        for axis in 0..3 {
            let first = vertices.len() as u32;
            vertices.extend([[1.0, 1.0, 1.0], [3.0, 1.0, 1.0], [1.0, 3.0, 1.0]]);
            vertices[first as usize][axis] = value;
            triangles.push([first, first + 1, first + 2]);
        }
    }
    // Without area: one point, two equal corners, three on a line, all denormal.
    let first = vertices.len() as u32;
    vertices.extend([
        [2.0, 2.0, 1.0],
        [3.0, 2.0, 1.0],
        [4.0, 2.0, 1.0],
        [1e-42, 0.0, 0.0],
        [0.0, 1e-42, 0.0],
    ]);
    triangles.extend([
        [first; 3],
        [first, first, first + 1],
        [first, first + 1, first + 2],
        [first + 3, first + 4, first + 3],
    ]);
    vertices.push([0.0; 3]);
    for quality in [BuildQuality::Low, BuildQuality::Medium, BuildQuality::High] {
        for robust in [true, false] {
            let mut builder =
                SceneBuilder::new(&device).unwrap().quality(quality).unwrap().robust(robust).unwrap();
            let (vertices, triangles) = (Arc::new(vertices.clone()), Arc::new(triangles.clone()));
            builder.attach(0, Geometry::triangles(&device, vertices, triangles, None).unwrap()).unwrap();
            let scene = builder.commit().unwrap();
            for cell in 0..16 {
                let (x, y) = ((cell % 4) as f32, (cell / 4) as f32);
                let hit = scene.intersect1(&down(x + 0.2, y + 0.3)).expect("the floor is there");
                assert_eq!(hit.prim_id, 2 * cell);
                assert_eq!(packet_down::<8>(&scene, &[(x, y)]), [Some((0, 2 * cell))]);
            }
        }
    }
}

/// A filter that cuts every other triangle away is obeyed by all forms of query.
#[test]
fn opacity_filters_decide() {
    let Some(device) = device() else { return };
    let scene = scene_of(&device, floor(4), Some(Arc::new(|prim, _, _| prim % 4 == 0)));
    let cells: Vec<(f32, f32)> = (0..4).map(|x| (x as f32, 1.0)).collect();
    let expected = vec![Some((0, 8)), None, Some((0, 12)), None];
    assert_eq!(packet_down::<4>(&scene, &cells), expected);
    assert_eq!(packet_down::<8>(&scene, &cells), expected);
    assert_eq!(packet_down::<16>(&scene, &cells), expected);
    for ((x, y), expected) in cells.iter().zip(expected) {
        let ray = down(x + 0.25, y + 0.25);
        assert_eq!(scene.intersect1(&ray).map(|hit| (hit.geom_id, hit.prim_id)), expected);
        assert_eq!(scene.occluded1(&ray), expected.is_some());
    }
}

/// A filter sees the barycentric coordinates of the hit: here it opens a hole of the shape u + v < 0.6.
#[test]
fn opacity_filters_see_where_the_hit_is() {
    let Some(device) = device() else { return };
    let scene = scene_of(&device, floor(1), Some(Arc::new(|prim, u, v| prim == 0 && u + v >= 0.6)));
    assert_eq!(scene.intersect1(&down(0.25, 0.25)), None);
    assert!(!scene.occluded1(&down(0.5, 0.05)));
    assert!(scene.intersect1(&down(0.35, 0.35)).is_some());
    assert!(scene.occluded1(&down(0.65, 0.05)));
}

/// A panic must not unwind through Embree: the triangle counts as opaque, and the panic is counted.
#[test]
fn a_panicking_filter_is_opaque_and_counted() {
    let Some(device) = device() else { return };
    let calls = Arc::new(AtomicUsize::new(0));
    let seen = calls.clone();
    let filter = move |_, _, _| -> bool {
        seen.fetch_add(1, Ordering::Relaxed);
        panic!("the filter's own fault")
    };
    let scene = scene_of(&device, floor(1), Some(Arc::new(filter)));
    std::panic::set_hook(Box::new(|_| {}));
    let hit = scene.intersect1(&down(0.2, 0.2));
    let blocked = scene.occluded1(&down(0.2, 0.2));
    let packet = packet_down::<8>(&scene, &[(0.0, 0.0)]);
    let _ = std::panic::take_hook();
    assert_eq!(hit.map(|hit| hit.prim_id), Some(0));
    assert!(blocked);
    assert_eq!(packet, [Some((0, 0))]);
    assert!(device.filter_panics() >= 4);
    assert_eq!(device.filter_panics(), calls.load(Ordering::Relaxed));
}

/// Instances: the hit names the instance and the geometry inside it, t is the same in both spaces,
/// also for maps that mirror, shear and scale unevenly.
#[test]
fn instances_are_placed() {
    let Some(device) = device() else { return };
    let object = scene_of(&device, floor(2), None);
    let maps: [[[f32; 3]; 4]; 4] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [10.0, 0.0, 0.0]],
        [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [22.0, 0.0, 0.5]],
        [[3.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 7.0], [30.0, 0.0, -1.0]],
        [[1.0, 0.0, 0.25], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0], [40.0, 0.0, 0.0]],
    ];
    let mut builder = SceneBuilder::new(&device).unwrap();
    for (id, map) in (5..).zip(maps) {
        builder.attach(id, Geometry::instance(&object, map).unwrap()).unwrap();
    }
    let (vertices, triangles) = floor(1);
    builder.attach(0, Geometry::triangles(&device, vertices, triangles, None).unwrap()).unwrap();
    let scene = builder.commit().unwrap();
    for (id, map) in (5..).zip(maps) {
        // The point (1.2, 0.3, 0) of the floor: cell 1, its first triangle.
        let p: [f32; 3] = std::array::from_fn(|k| 1.2 * map[0][k] + 0.3 * map[1][k] + map[3][k]);
        let ray =
            Ray { origin: [p[0], p[1], 4.0], direction: [0.0, 0.0, -2.0], tnear: 0.0, tfar: f32::INFINITY };
        let hit = scene.intersect1(&ray).expect("the instance is there");
        assert_eq!((hit.inst_id, hit.geom_id, hit.prim_id), (id, 0, 2));
        assert!((hit.t - (4.0 - p[2]) / 2.0).abs() < 1e-5, "{hit:?}");
        assert!((hit.u - 0.2).abs() < 1e-5 && (hit.v - 0.3).abs() < 1e-5, "{hit:?}");
        assert!(scene.occluded1(&ray));
    }
    let hit = scene.intersect1(&down(0.2, 0.2)).expect("the floor that is not instanced");
    assert_eq!((hit.inst_id, hit.geom_id), (INVALID_ID, 0));
    assert_eq!(Geometry::instance(&scene, maps[0]).err(), Some(Error::NestedInstance));
}

/// Filters and packets work through instances too.
#[test]
fn instances_keep_their_filters() {
    let Some(device) = device() else { return };
    let object = scene_of(&device, floor(2), Some(Arc::new(|prim, _, _| prim == 2)));
    let mut builder = SceneBuilder::new(&device).unwrap();
    let map = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [4.0, 0.0, 0.0]];
    builder.attach(9, Geometry::instance(&object, map).unwrap()).unwrap();
    let scene = builder.commit().unwrap();
    let cells = [(4.0, 0.0), (5.0, 0.0), (4.0, 1.0)];
    assert_eq!(packet_down::<4>(&scene, &cells), [None, Some((0, 2)), None]);
    assert_eq!(packet_down::<16>(&scene, &cells), [None, Some((0, 2)), None]);
    assert!(scene.occluded1(&down(5.25, 0.25)) && !scene.occluded1(&down(4.25, 0.25)));
}

/// A placement that flattens, explodes or is no number has no space to bring rays into.
#[test]
fn placements_without_inverse_are_refused() {
    let Some(device) = device() else { return };
    let object = scene_of(&device, floor(1), None);
    let scaled =
        |x: f32, y: f32, z: f32, t: f32| [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z], [t, 0.0, 0.0]];
    for map in [
        scaled(1.0, 1.0, 0.0, 0.0),
        scaled(f32::NAN, 1.0, 1.0, 0.0),
        scaled(f32::INFINITY, 1.0, 1.0, 0.0),
        scaled(1.0, 1.0, 1.0, f32::NAN),
        scaled(1.0, 1.0, 1.0, 1e30),
        scaled(1e-12, 1e-12, 1e-12, 0.0),
        [[1.0, 2.0, 3.0], [2.0, 4.0, 6.000_001], [0.0, 1.0, 0.0], [0.0; 3]],
    ] {
        assert_eq!(Geometry::instance(&object, map).err(), Some(Error::Transform), "{map:?}");
    }
    // Small and large, but of use: rays up to the limit are answered.
    for map in [scaled(1e-6, 1e-6, 1e-6, 0.0), scaled(1e6, 1e6, 1e6, 1e6)] {
        let mut builder = SceneBuilder::new(&device).unwrap();
        builder.attach(0, Geometry::instance(&object, map).unwrap()).unwrap();
        let scene = builder.commit().unwrap();
        let far = scene.largest_coordinate();
        assert!((1e9..=MAX_COORDINATE).contains(&far));
        for (x, y) in [(far, far), (-far, 0.0), (0.0, 0.0), (f32::INFINITY, 0.0)] {
            let ray =
                Ray { origin: [x, y, far], direction: [far, -far, -far], tnear: 0.0, tfar: f32::INFINITY };
            scene.intersect1(&ray);
            scene.occluded1(&ray);
        }
    }
}

/// Geometry of one device in a scene of another would mix handles of possibly different libraries.
#[test]
fn devices_do_not_mix() {
    let Some(first) = device() else { return };
    let Some(second) = device() else { return };
    let (vertices, triangles) = floor(1);
    let foreign = Geometry::triangles(&first, vertices, triangles, None).unwrap();
    let mut builder = SceneBuilder::new(&second).unwrap();
    assert_eq!(builder.attach(0, foreign), Err(Error::ForeignDevice));
}
