//! Exported fields hold the values of the points, for VTK as for readers of PLY.

use std::fs;
use std::path::Path;
use std::process::Command;

use glam::{UVec3, Vec3};
use lightmesh::export::{
    GridError, GridField, ImageGrid, PointField, Values, encode_ply, encode_vti, encode_vtu,
};
use lightmesh::light_mesh::direct::KnownPoints;
use lightmesh::scene::Falloff;
use lightmesh::settings::{Integrator, PointLayout, Spacing};
use serde_json::Value;

use crate::common::data::missing;
use crate::common::{Builder, camera, grey, light, session, settings_at};

/// Prints what VTK reads of a file: points, arrays, and what cells there are.
const READ: &str = r#"
import json, sys
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader, vtkXMLImageDataReader
name = sys.argv[1]
reader = vtkXMLUnstructuredGridReader() if name.endswith(".vtu") else vtkXMLImageDataReader()
reader.SetFileName(name)
reader.Update()
data = reader.GetOutput()
count = data.GetNumberOfPoints()
arrays = data.GetPointData()
tuples = lambda array: [array.GetTuple(i) for i in range(array.GetNumberOfTuples())]
print(json.dumps({
    "error": reader.GetErrorCode(),
    "points": [data.GetPoint(i) for i in range(count)],
    "arrays": {arrays.GetArrayName(i): tuples(arrays.GetArray(i)) for i in range(arrays.GetNumberOfArrays())},
    "visible": [data.IsPointVisible(i) for i in range(count)] if name.endswith(".vti") else [],
    "cells": [data.GetCellType(i) for i in range(data.GetNumberOfCells())],
}))
"#;

/// What VTK reads of a file; `None`, and said so, where there is no VTK. `LIGHTMESH_PYTHON` names a Python that has it.
fn read(file: &Path) -> Option<Value> {
    let python = std::env::var_os("LIGHTMESH_PYTHON").unwrap_or_else(|| "python3".into());
    let has_vtk = Command::new(&python).args(["-c", "import vtkmodules.vtkIOXML"]).output();
    if !has_vtk.is_ok_and(|output| output.status.success()) {
        missing("no Python with the package vtk is named by LIGHTMESH_PYTHON, or installed");
        return None;
    }
    let output = Command::new(&python).args(["-c", READ]).arg(file).output().expect("Python runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && errors.is_empty(), "{errors}");
    let read: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(read["error"], 0);
    Some(read)
}

fn numbers(value: &Value) -> Vec<Vec<f32>> {
    let tuple = |value: &Value| -> Vec<f32> {
        value
            .as_array()
            .expect("a tuple")
            .iter()
            .map(|number| number.as_f64().expect("a number") as f32)
            .collect()
    };
    value.as_array().expect("a list").iter().map(tuple).collect()
}

/// The known points of a light mesh around a plate that hides one of two lights.
fn known() -> (PointField, Vec<Vec3>) {
    let (known, light) = known_of(&PointLayout::Regular, &[0.4]);
    (PointField::of_known(known), light)
}

/// Those of meshes of some spacings, one after the other.
fn known_of(layout: &PointLayout, spacings: &[f32]) -> (KnownPoints, Vec<Vec3>) {
    let mut builder = Builder::default();
    builder.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, 0);
    builder.quad(Vec3::new(-0.5, 1.0, -0.5), Vec3::Z, Vec3::X, 0);
    let lamps = vec![
        light(Vec3::new(0.0, 2.0, 0.0), Vec3::ONE),
        light(Vec3::new(1.9, 0.5, 0.0), Vec3::new(0.5, 1.0, 2.0)),
    ];
    let scene = builder.scene(vec![grey(0.5)], lamps, Falloff::InverseSquare);
    let mut session = session(&scene);
    let mut settings = settings_at((24, 18));
    settings.shading.integrator = Integrator::LightMesh;
    settings.mesh.direct.layout = layout.clone();
    let view = camera(Vec3::new(0.0, 4.0, 5.0), Vec3::ZERO, 45.0);
    for &spacing in spacings {
        settings.mesh.direct.spacing = Spacing::Units(Vec3::splat(spacing));
        session.render(&view, &settings).expect("a picture");
    }
    let known = session.known_points();
    let light = session.direct_light(&known.positions);
    (known, light)
}

/// Every known point is a vertex in VTK, with the direct light that is traced anew there.
#[test]
fn vtk_reads_the_known_points_of_a_light_mesh() {
    let (field, light) = known();
    assert!(field.positions.len() > 100);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("field.vtu");
    fs::write(&file, encode_vtu(&field)).expect("writable");
    let Some(read) = read(&file) else { return };
    let positions: Vec<Vec<f32>> =
        field.positions.iter().map(|position| position.to_array().to_vec()).collect();
    assert_eq!(numbers(&read["points"]), positions);
    // VTK_VERTEX is 1.
    assert_eq!(read["cells"], serde_json::json!(vec![1; positions.len()]));
    let arrays = &read["arrays"];
    let (found, unoccluded) = (numbers(&arrays["DirectLight"]), numbers(&arrays["Unoccluded"]));
    let (visible, layers) = (numbers(&arrays["VisibleLights"]), numbers(&arrays["Layer"]));
    let lamps = [(Vec3::new(0.0, 2.0, 0.0), 1.0), (Vec3::new(1.9, 0.5, 0.0), 0.5)];
    for (index, &x) in field.positions.iter().enumerate() {
        let found = Vec3::from_slice(&found[index]);
        assert!(
            found.abs_diff_eq(light[index], 1e-5 * light[index].length()),
            "{found} for {}",
            light[index]
        );
        let all: f32 = lamps.iter().map(|(at, red)| red / at.distance_squared(x)).sum();
        assert!((unoccluded[index][0] / all - 1.0).abs() < 1e-4, "{} for {all}", unoccluded[index][0]);
        let is_lit = found.x > 0.999 * all;
        assert_eq!(visible[index][0] == 2.0, is_lit, "{} lights at {x}", visible[index][0]);
    }
    assert!(visible.iter().any(|count| count[0] < 2.0), "the plate hides a light from something");
    assert!(layers.iter().all(|layer| layer[0] == 0.0), "one spacing is one layer");
}

/// In VTK every known point of a regular layer is a place of the grid, with the direct light that is traced anew there; all other places are hidden.
#[test]
fn vtk_reads_a_layer_of_mesh_points_as_a_grid() {
    let (known, light) = known_of(&PointLayout::Regular, &[0.4]);
    let field = GridField::of_known(&known, None).expect("a regular layer");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("layer.vti");
    fs::write(&file, encode_vti(&field.grid, &field.arrays)).expect("writable");
    let Some(read) = read(&file) else { return };
    let places = numbers(&read["points"]);
    let [found, unoccluded] = ["DirectLight", "Unoccluded"].map(|name| numbers(&read["arrays"][name]));
    let [visible, marks] = ["VisibleLights", "Known"].map(|name| numbers(&read["arrays"][name]).concat());
    let shown: Vec<bool> =
        read["visible"].as_array().expect("a list").iter().map(|shown| shown == 1 || shown == true).collect();
    let mut seen = 0;
    for (place, at) in places.iter().map(|place| Vec3::from_slice(place)).enumerate() {
        let near = |position: &Vec3| position.abs_diff_eq(at, 1e-4);
        let point = known.positions.iter().position(near);
        assert_eq!((shown[place], marks[place]), (point.is_some(), f32::from(point.is_some())), "{at}");
        let Some(point) = point else {
            assert!(
                found[place] == [0.0; 3] && unoccluded[place] == [0.0; 3] && visible[place] == 0.0,
                "{at}"
            );
            continue;
        };
        seen += 1;
        let (value, traced) = (Vec3::from_slice(&found[place]), light[point]);
        assert!(value.abs_diff_eq(traced, 1e-5 * traced.length()), "{value} for {traced} at {at}");
        assert_eq!(visible[place], known.visible[point] as f32);
    }
    assert_eq!((seen, field.known), (known.positions.len(), known.positions.len()));
    assert!(places.len() > seen, "the test shows nothing of hidden places");
}

/// Of several layers the one with most points is written, or the one that is asked for, whose points may be those of finer ones; what is no grid, or
/// not there, is said.
#[test]
fn a_grid_is_of_one_layer() {
    let (known, _) = known_of(&PointLayout::Regular, &[0.4, 0.8]);
    let step = |spacing| GridField::of_known(&known, spacing).map(|field| field.grid.step);
    assert_eq!(step(None), Ok(Vec3::splat(0.4)));
    // As it is typed.
    assert_eq!(step(Some(0.800_01)), Ok(Vec3::splat(0.8)));
    let coarse = GridField::of_known(&known, Some(0.8)).expect("a layer");
    assert!(coarse.known > 20, "{} points", coarse.known);
    assert_eq!(
        step(Some(0.3)),
        Err(GridError::NoSuchSpacing { asked: 0.3, spacings: "0.4, 0.8".to_owned() })
    );
    // Corners and centres of cells of 0.8 are places of a grid of 0.4.
    let (centred, _) = known_of(&PointLayout::BodyCentred, &[0.8]);
    let field = GridField::of_known(&centred, None).expect("they lie on a grid");
    assert_eq!((field.grid.step, field.known), (Vec3::splat(0.4), centred.positions.len()));
    let (jittered, _) = known_of(&PointLayout::Jittered { seed: 1 }, &[0.8]);
    let error = GridField::of_known(&jittered, None).expect_err("no grid");
    assert!(error.to_string().contains(".vtu"), "{error}");
}

/// The places of a regular grid follow from origin, step and counts, x first.
#[test]
fn vtk_reads_regular_grids() {
    let grid = ImageGrid {
        origin: Vec3::new(1.0, 2.0, -3.0),
        step: Vec3::new(0.5, 1.0, 2.0),
        counts: UVec3::new(3, 2, 2),
    };
    let values: Vec<f32> = (0..12).map(|index| index as f32 * 0.25).collect();
    let vectors: Vec<Vec3> = values.iter().map(|&value| Vec3::new(value, -value, 1.0)).collect();
    let arrays = [
        ("a & \"b\"".to_owned(), Values::Scalars(values.clone())),
        ("vector".to_owned(), Values::Vectors(vectors.clone())),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("grid.vti");
    fs::write(&file, encode_vti(&grid, &arrays)).expect("writable");
    let Some(read) = read(&file) else { return };
    let points = numbers(&read["points"]);
    assert_eq!((points.len(), &points[1], &points[11]), (12, &vec![1.5, 2.0, -3.0], &vec![2.0, 3.0, -1.0]));
    assert_eq!(numbers(&read["arrays"]["a & \"b\""]).concat(), values);
    let vectors: Vec<Vec<f32>> = vectors.iter().map(|vector| vector.to_array().to_vec()).collect();
    assert_eq!(numbers(&read["arrays"]["vector"]), vectors);
}

/// The header of a PLY file declares what follows: floats in its order, and a colour that is brighter where there is more light.
#[test]
fn ply_points_are_what_their_header_declares() {
    let (field, light) = known();
    let bytes = encode_ply(&field);
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|window| window == end).expect("a header") + end.len();
    let header = std::str::from_utf8(&bytes[..at]).expect("text");
    assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n"), "{header}");
    assert!(header.contains(&format!("\nelement vertex {}\n", field.positions.len())), "{header}");
    let properties: Vec<(&str, &str)> =
        header.lines().filter_map(|line| line.strip_prefix("property ")?.split_once(' ')).collect();
    let size = |kind: &str| if kind == "uchar" { 1 } else { 4 };
    let stride: usize = properties.iter().map(|(kind, _)| size(kind)).sum();
    assert_eq!(bytes.len() - at, stride * field.positions.len());
    let offset = |wanted: &str| {
        let before = properties.iter().take_while(|(_, name)| *name != wanted);
        before.map(|(kind, _)| size(kind)).sum::<usize>()
    };
    let vertices: Vec<&[u8]> = bytes[at..].chunks(stride).collect();
    let float = |vertex: &[u8], name: &str| {
        f32::from_le_bytes(vertex[offset(name)..][..4].try_into().expect("four bytes"))
    };
    let mut by_light: Vec<(f32, u8)> = Vec::new();
    for ((vertex, position), light) in vertices.iter().zip(&field.positions).zip(&light) {
        assert_eq!([float(vertex, "x"), float(vertex, "y"), float(vertex, "z")], position.to_array());
        assert!((float(vertex, "DirectLight_b") - light.z).abs() <= 1e-5 * light.z);
        by_light.push((float(vertex, "DirectLight_b"), vertex[offset("blue")]));
    }
    by_light.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(by_light.windows(2).all(|pair| pair[0].1 <= pair[1].1), "more light is no darker");
    assert!(by_light.first().map(|first| first.1) < by_light.last().map(|last| last.1));
}
