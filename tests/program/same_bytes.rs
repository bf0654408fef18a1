//! An image file holds nothing that differs from run to run, so that files can be compared by their bytes.

use std::fs;
use std::process::Command;

const SCENE: &str = "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\n[render]\nresolution = [24, 16]\n\
                     [light_mesh]\nspacing = 0.5\n[[geometry]]\nfile = \"a.obj\"\n\
                     [[light]]\nposition = [0, 1, 2]\nintensity = 1\n";

/// Each run is a process of its own, with hash maps in an order of its own; times differ anyway, and here the threads do.
#[test]
fn two_renders_of_a_scene_give_the_same_files() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a.toml"), SCENE).expect("writable");
    fs::write(folder.path().join("a.obj"), "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n").expect("writable");
    let render = |threads: &str| {
        let paths = ["a.exr", "a.png"].map(|name| folder.path().join(name));
        let output = Command::new(env!("CARGO_BIN_EXE_lightmesh"))
            .args(["render", "--quiet", "--backend", "bvh", "--threads", threads])
            .arg(folder.path().join("a.toml"))
            .args(paths.iter().flat_map(|path| ["-o".as_ref(), path.as_os_str()]))
            .output()
            .expect("the program runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(output.stderr.is_empty(), "--quiet: {}", String::from_utf8_lossy(&output.stderr));
        paths.map(|path| fs::read(path).expect("written"))
    };
    let first = render("1");
    for _ in 0..3 {
        let [exr, png] = render("2");
        assert!(first[0] == exr, "the EXR files differ");
        assert!(first[1] == png, "the PNG files differ");
    }
}
