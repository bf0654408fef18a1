//! Files of probes: what may stand in them, and what is said about what may not.

use std::fs;

use glam::Vec3;
use lightmesh::probe::{Probe, Unit, load_probes, write_table};

/// Reads a file of this text; of an error what follows the path.
fn load(text: &str) -> Result<Vec<Probe>, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("points.csv");
    fs::write(&path, text).expect("writable");
    load_probes(&path).map_err(|error| {
        let text = error.to_string();
        let place = format!("{}:", path.display());
        text.strip_prefix(&place).unwrap_or_else(|| panic!("{text} names the file")).to_owned()
    })
}

/// Commas, semicolons, spaces and tabs separate; headings, comments and empty lines are passed over; normals get unit length, however long they are.
#[test]
fn points_and_normals_are_read() {
    let text = "\u{feff}x,y,z,nx,ny,nz\n\n# desks\n1, 2 , 3, 0, 2, 0\r\n-1e2;0;.5;0\t0\t-1e-30 # the last\n";
    let expected = [
        Probe { position: Vec3::new(1.0, 2.0, 3.0), normal: Some(Vec3::Y) },
        Probe { position: Vec3::new(-100.0, 0.0, 0.5), normal: Some(Vec3::NEG_Z) },
    ];
    assert_eq!(load(text), Ok(expected.to_vec()));
    let bare = load("0 0 1\n0 0 2");
    assert_eq!(bare.map(|probes| probes[1]), Ok(Probe { position: Vec3::Z * 2.0, normal: None }));
}

/// Errors name line and field.
#[test]
fn mistakes_are_named() {
    for (text, expected) in [
        ("1 2 3\n1 2\n", "2: three numbers or six expected (x y z nx ny nz), found 2"),
        ("1 2 3\n1 2 3 0 0 1\n", "2: 3 numbers expected as in the lines before, found 6"),
        ("# a\n1 2 3 0 up 1\n", "2: ny: 'up' is not a finite number"),
        ("1 inf 3\n", "1: y: 'inf' is not a finite number"),
        ("1 2 1e39\n", "1: z: '1e39' is not a finite number"),
        ("x y z\n1 2 3\nx y z\n", "3: x: 'x' is not a finite number"),
        ("1 2 3 0 0 0\n", "1: nx ny nz: a normal has a length above 0"),
        ("x y z\n# nothing\n", "1: holds no points"),
        ("", "1: holds no points"),
    ] {
        assert_eq!(load(text), Err(expected.to_owned()), "{text:?}");
    }
}

/// What is written is a file of numbers again, without a loss; lux are the lumens of the standard's weights.
#[test]
fn tables_lose_nothing() {
    let probes = [Probe { position: Vec3::new(0.1, -2e-9, 3e7), normal: Some(Vec3::X) }];
    let text = write_table(&probes, &[Vec3::new(1.0, 0.5, 0.1)], Unit::WATT);
    let (heading, line) = text.split_once('\n').expect("two lines");
    assert_eq!(heading, "x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b,lux");
    let numbers: Vec<f32> = line.trim().split(',').map(|word| word.parse().expect("a number")).collect();
    assert_eq!(numbers[..9], [0.1, -2e-9, 3e7, 1.0, 0.0, 0.0, 1.0, 0.5, 0.1]);
    // 0.2126 + 0.3576 + 0.00722 = 0.57742.
    assert!((numbers[9] / (683.0 * 0.57742) - 1.0).abs() < 1e-5, "{}", numbers[9]);
    let fluence = write_table(&[Probe { normal: None, ..probes[0] }], &[Vec3::ONE], Unit::LUMEN);
    assert!(fluence.starts_with("x,y,z,fluence_r,fluence_g,fluence_b,scalar_lux\n"), "{fluence}");
}
