//! Memory is told before it is taken.

use std::process::Command;

use lightmesh::accel::{Accel, Backend, BackendChoice, Footprint, MemoryEstimate};
use lightmesh::scene::generate::forest::Forest;

/// An estimate is of use as long as it isn't exceeded and not far off: by no more than half for a structure of
/// 100,000 triangles, which is large enough that fixed costs don't count.
#[test]
fn estimates_are_near_what_the_structures_take() {
    let scene = crate::common::forest(100_000, 10).scene;
    let estimate = MemoryEstimate::of(&scene);
    for (choice, Footprint { built, building }) in
        [(BackendChoice::Embree, estimate.embree), (BackendChoice::Bvh, estimate.bvh)]
    {
        let Ok(chosen) = Backend::build(choice, &scene) else {
            println!("SKIPPED: no {choice:?} here");
            continue;
        };
        let bytes = chosen.backend.memory_bytes() as u64;
        assert!(bytes <= building, "{choice:?}: {bytes}, at most {building} while building");
        assert!(3 * bytes >= 2 * built && 2 * bytes <= 3 * built, "{choice:?}: {bytes}, estimated {built}");
    }
}

/// A scene that is too large is refused before it is built, with the estimate, and leaves no picture; with enough
/// memory the same command renders.
#[test]
fn a_scene_beyond_the_limit_is_refused_with_the_estimate() {
    let folder = tempfile::tempdir().unwrap();
    Forest { triangles: 20_000, lights: 3, seed: 1 }.write(folder.path()).unwrap();
    let picture = folder.path().join("picture.png");
    let render = |limit: &str| {
        Command::new(env!("CARGO_BIN_EXE_lightmesh"))
            .args(["render", "--backend", "bvh", "--resolution", "8x8", "--memory-limit", limit, "-o"])
            .arg(&picture)
            .arg(folder.path().join("forest.toml"))
            .output()
            .unwrap()
    };
    let refused = render("1M");
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1), "{message}");
    assert!(
        message.contains("forest.toml: needs about") && message.contains("the limit is 1 MiB"),
        "{message}"
    );
    assert!(!picture.exists());
    let rendered = render("1G");
    assert!(rendered.status.success(), "{}", String::from_utf8_lossy(&rendered.stderr));
    assert!(picture.exists());
    assert_eq!(render("much").status.code(), Some(2));
}
