//! Nothing is freed too early, and nothing is kept for good.

mod common;

use std::{sync::Arc, thread};

use common::{device, down, floor, scene_of};
use embree_sys::{Geometry, SceneBuilder};

/// Shared buffers, filters and Embree's own memory go when the last scene that needs them goes, and not
/// before, in any order of dropping.
#[test]
fn everything_is_freed_with_its_last_user() {
    let Some(device) = device() else { return };
    let (vertices, triangles) = floor(50);
    let token = Arc::new(());
    let held = token.clone();
    let filter = Arc::new(move |_, _, _| Arc::strong_count(&held) > 0);
    let before = device.memory_bytes();

    let object = scene_of(&device, (vertices.clone(), triangles.clone()), Some(filter));
    let mut builder = SceneBuilder::new(&device).unwrap();
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
    builder.attach(0, Geometry::instance(&object, identity).unwrap()).unwrap();
    let scene = builder.commit().unwrap();
    assert!(device.memory_bytes() > before + 5000 * 4, "5,000 triangles take some memory");

    drop(object);
    assert_eq!(Arc::strong_count(&vertices), 2, "the instance keeps what it instances");
    assert!(scene.intersect1(&down(20.2, 30.2)).is_some());
    let clone = scene.clone();
    drop(scene);
    assert!(clone.intersect1(&down(20.2, 30.2)).is_some());
    drop(clone);
    assert_eq!((Arc::strong_count(&vertices), Arc::strong_count(&triangles)), (1, 1));
    assert_eq!(Arc::strong_count(&token), 1);
    assert_eq!(device.memory_bytes(), before, "Embree's own counter is back where it was");
}

/// A scene keeps its device, and the device its library.
#[test]
fn scenes_outlive_the_handles_they_were_made_with() {
    let Some(device) = device() else { return };
    let scene = scene_of(&device, floor(4), None);
    drop(device);
    assert!(scene.intersect1(&down(2.2, 2.2)).is_some());
}

/// What is never attached or never committed is freed as well.
#[test]
fn unfinished_scenes_are_freed() {
    let Some(device) = device() else { return };
    let (vertices, triangles) = floor(4);
    let before = device.memory_bytes();
    let make = || Geometry::triangles(&device, vertices.clone(), triangles.clone(), None).unwrap();
    drop(make());
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(0, make()).unwrap();
    drop(builder);
    assert_eq!(Arc::strong_count(&vertices), 1);
    assert_eq!(device.memory_bytes(), before);
}

/// Devices, scenes and queries on several threads at once, one of which drops what another made.
#[test]
fn threads_share_scenes() {
    let Some(device) = device() else { return };
    let scene = scene_of(&device, floor(16), Some(Arc::new(|prim, _, _| prim % 2 == 0)));
    let builders: Vec<_> = (0..4)
        .map(|k| {
            let (scene, device) = (scene.clone(), device.clone());
            thread::spawn(move || {
                for i in 0..200 {
                    let x = (i % 16) as f32 + 0.2;
                    assert_eq!(scene.intersect1(&down(x, 0.2)).map(|hit| hit.prim_id), Some(2 * (i % 16)));
                }
                scene_of(&device, floor(k + 1), None)
            })
        })
        .collect();
    let scenes: Vec<_> = builders.into_iter().map(|thread| thread.join().unwrap()).collect();
    drop((device, scene));
    for (k, scene) in scenes.iter().enumerate() {
        assert_eq!(scene.bounds().map(|(_, upper)| upper[0]), Some(k as f32 + 1.0));
    }
}
