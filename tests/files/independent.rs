//! Independent readers of OBJ and glTF find in every model what ours find: triangles, positions, texture coordinates
//! and normals.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DAffine3, DMat4, DVec3};
use lightmesh::scene::TriangleMesh;
use lightmesh::scene::load::{Model, ModelFormat, load_model};

use crate::common::data::{models_in, shared};

/// A triangle's corner as a reader of others gives it.
#[derive(Clone, Copy, Debug)]
struct Corner {
    position: DVec3,
    uv: Option<[f32; 2]>,
    normal: Option<DVec3>,
}

/// The same corner as ours gives it.
fn our_corner(mesh: &TriangleMesh, vertex: u32) -> Corner {
    let vertex = vertex as usize;
    Corner {
        position: DVec3::from_array(mesh.positions.as_slice()[vertex].map(f64::from)),
        uv: mesh.uvs.as_ref().map(|uvs| uvs[vertex]),
        normal: mesh.normals.as_ref().map(|normals| DVec3::from_array(normals[vertex].map(f64::from))),
    }
}

/// Whether two corners agree: positions within `tolerance`; texture coordinates and directions of normals where both
/// readers have one. Ours give the face's normal, or none, where a file has no usable one.
fn agree(ours: &Corner, theirs: &Corner, tolerance: f64) -> bool {
    let uvs = match (ours.uv, theirs.uv) {
        (Some(a), Some(b)) if b.iter().all(|x| x.is_finite()) => a == b,
        _ => true,
    };
    let direction = |normal: Option<DVec3>| normal.and_then(DVec3::try_normalize);
    let normals = match (direction(ours.normal), direction(theirs.normal)) {
        (Some(a), Some(b)) => a.distance(b) < 1e-5,
        _ => true,
    };
    uvs && normals && (ours.position - theirs.position).abs().max_element() <= tolerance
}

fn area_vector(corners: &[DVec3]) -> DVec3 {
    let fan = corners.windows(2).skip(1);
    fan.map(|pair| (pair[0] - corners[0]).cross(pair[1] - corners[0])).sum()
}

/// All models of a format beside the project and in it.
fn models(format: ModelFormat) -> Vec<PathBuf> {
    let mut models = models_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes"));
    models.extend(shared("scenes").iter().flat_map(|folder| models_in(folder)));
    models.retain(|model| ModelFormat::of(model) == Some(format));
    models
}

/// Holds every model that both readers accept against `check`, and returns how many that were.
fn compare(format: ModelFormat, check: impl Fn(&Path, &Model) -> Option<Result<(), String>>) -> usize {
    let (mut compared, mut wrong) = (0, Vec::new());
    for path in models(format) {
        // What ours reject, with a reason, is for the tests of malformed files.
        let Ok(model) = load_model(&path) else { continue };
        match check(&path, &model) {
            None => println!("{}: not accepted by the other reader", path.display()),
            Some(Ok(())) => compared += 1,
            Some(Err(problem)) => wrong.push(format!("{}: {problem}", path.display())),
        }
    }
    println!("{compared} files compared");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    compared
}

/// Whether all corners of an OBJ file's faces state a texture coordinate, and a normal.
fn stated_everywhere(text: &str) -> [bool; 2] {
    let faces = text.lines().filter_map(|line| line.trim_start().strip_prefix("f "));
    let corners: Vec<&str> = faces.flat_map(str::split_whitespace).collect();
    let all = |place: usize| {
        corners.iter().all(|corner| corner.split('/').nth(place).is_some_and(|part| !part.is_empty()))
    };
    [all(1), all(2)]
}

/// The faces of an OBJ file as tobj reads them, untriangulated; `None` if it doesn't accept the file, or takes a vertex's
/// fourth coordinate for a divisor. That is the weight of a rational curve's point, and says nothing about polygons.
fn tobj_faces(path: &Path) -> Option<Vec<Vec<Corner>>> {
    if path.ends_with("cube-vertex-w-component.obj") {
        return None;
    }
    // To corners that state none, tobj gives the texture coordinate or normal of the corner before.
    let stated = stated_everywhere(&std::fs::read_to_string(path).ok()?);
    let index = |list: &[u32], stated: bool, at: usize| list.get(at).filter(|_| stated).map(|&i| i as usize);
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options).ok()?;
    let mut faces = Vec::new();
    for tobj::Model { mesh, .. } in &models {
        let mut corners = (0..mesh.indices.len()).map(|at| {
            let position = mesh.indices[at] as usize;
            Corner {
                position: DVec3::from_array(
                    [0, 1, 2].map(|axis| f64::from(mesh.positions[3 * position + axis])),
                ),
                uv: index(&mesh.texcoord_indices, stated[0], at)
                    .map(|uv| [0, 1].map(|axis| mesh.texcoords[2 * uv + axis])),
                normal: index(&mesh.normal_indices, stated[1], at)
                    .map(|n| DVec3::from_array([0, 1, 2].map(|axis| f64::from(mesh.normals[3 * n + axis])))),
            }
        });
        if mesh.face_arities.is_empty() {
            faces.extend((0..mesh.indices.len() / 3).map(|_| corners.by_ref().take(3).collect::<Vec<_>>()));
        } else {
            faces.extend(mesh.face_arities.iter().map(|&n| corners.by_ref().take(n as usize).collect()));
        }
    }
    Some(faces)
}

/// Triangles are the same, corner by corner and in the file's order, positions to the last bit. Readers may divide
/// polygons as they like: our triangles of one have only its corners, and its area vector. Ours leave out triangles
/// without area.
fn check_obj(model: &Model, faces: &[Vec<Corner>]) -> Result<(), String> {
    let mesh = &model.meshes[0];
    let ours: Vec<[Corner; 3]> =
        mesh.triangles.iter().map(|triangle| triangle.map(|vertex| our_corner(mesh, vertex))).collect();
    let mut rest = &ours[..];
    for (number, face) in faces.iter().enumerate().filter(|(_, face)| face.len() >= 3) {
        let positions: Vec<DVec3> = face.iter().map(|corner| corner.position).collect();
        let of_face = |triangle: &[Corner; 3]| {
            triangle.iter().all(|ours| face.iter().any(|theirs| agree(ours, theirs, 0.0)))
        };
        if face.len() == 3 && area_vector(&positions) == DVec3::ZERO {
            continue;
        }
        let count = rest.iter().take(face.len() - 2).take_while(|triangle| of_face(triangle)).count();
        let (mine, others) = rest.split_at(count);
        rest = others;
        let area: DVec3 = mine.iter().map(|triangle| area_vector(&triangle.map(|c| c.position))).sum();
        let size = positions.iter().map(|p| p.distance_squared(positions[0])).fold(0.0, f64::max);
        if area.distance(area_vector(&positions)) > 1e-9 * size {
            return Err(format!(
                "face {number} is {face:?}, ours go on with {:?}",
                ours.get(ours.len() - rest.len())
            ));
        }
    }
    if rest.is_empty() { Ok(()) } else { Err(format!("ours have {} triangles more", rest.len())) }
}

#[test]
fn tobj_finds_the_same_triangles() {
    let compared = compare(ModelFormat::Obj, |path, model| Some(check_obj(model, &tobj_faces(path)?)));
    // The models of the repository at least.
    assert!(compared >= 6, "{compared}");
}

/// Bytes of the buffers; `None` if one is not to be had.
fn buffers(gltf: &gltf::Gltf, path: &Path) -> Option<Vec<Vec<u8>>> {
    let bytes = |buffer: gltf::Buffer| match buffer.source() {
        gltf::buffer::Source::Bin => gltf.blob.clone(),
        gltf::buffer::Source::Uri(uri) => match uri.split_once(";base64,") {
            Some((_, data)) => STANDARD.decode(data).ok(),
            None => std::fs::read(path.parent()?.join(uri)).ok(),
        },
    };
    gltf.buffers().map(bytes).collect()
}

/// Corner numbers of the triangles, as the specification orders those of strips and fans.
fn triangles(mode: gltf::mesh::Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    let at = |corners: [usize; 3]| corners.map(|i| indices[i]);
    let windows = 0..indices.len().saturating_sub(2);
    match mode {
        gltf::mesh::Mode::Triangles => indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        gltf::mesh::Mode::TriangleStrip => windows.map(|i| at([i, i + 1 + i % 2, i + 2 - i % 2])).collect(),
        gltf::mesh::Mode::TriangleFan => windows.map(|i| at([i + 1, i + 2, 0])).collect(),
        _ => Vec::new(),
    }
}

/// The triangles of a mesh in its own space; those without area, which ours leave out, are left out.
fn mesh_triangles(mesh: &gltf::Mesh, buffers: &[Vec<u8>]) -> Option<Vec<[Corner; 3]>> {
    let mut found = Vec::new();
    for primitive in mesh.primitives() {
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        let positions: Vec<[f32; 3]> = reader.read_positions()?.collect();
        let normals: Option<Vec<[f32; 3]>> = reader.read_normals().map(Iterator::collect);
        let base = primitive.material().pbr_metallic_roughness().base_color_texture();
        let set = base.map_or(0, |texture| texture.tex_coord());
        let uvs: Option<Vec<[f32; 2]>> = reader.read_tex_coords(set).map(|uvs| uvs.into_f32().collect());
        let all = || (0..positions.len() as u32).collect();
        let indices: Vec<u32> =
            reader.read_indices().map_or_else(all, |indices| indices.into_u32().collect());
        let corner = |index: u32| {
            let index = index as usize;
            let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
            Corner {
                position: vector(positions[index]),
                uv: uvs.as_ref().map(|uvs| uvs[index]),
                normal: normals.as_ref().map(|normals| vector(normals[index])),
            }
        };
        let corners = triangles(primitive.mode(), &indices).into_iter().map(|t| t.map(corner));
        found.extend(corners.filter(|t| area_vector(&t.map(|c| c.position)) != DVec3::ZERO));
    }
    Some(found)
}

/// The meshes of a scene with their places, in the order in which they are met first.
fn placed_meshes<'a>(gltf: &'a gltf::Gltf) -> Vec<(gltf::Mesh<'a>, Vec<DAffine3>)> {
    let Some(scene) = gltf.default_scene().or_else(|| gltf.scenes().next()) else { return Vec::new() };
    let mut pending: Vec<(gltf::Node, DAffine3)> =
        scene.nodes().map(|node| (node, DAffine3::IDENTITY)).collect();
    pending.reverse();
    let mut found: Vec<(gltf::Mesh, Vec<DAffine3>)> = Vec::new();
    let mut known: HashMap<usize, usize> = HashMap::new();
    while let Some((node, parent)) = pending.pop() {
        let columns = node.transform().matrix().map(|column| column.map(f64::from));
        let to_world = parent * DAffine3::from_mat4(DMat4::from_cols_array_2d(&columns));
        if let Some(mesh) = node.mesh() {
            let next = found.len();
            let index = *known.entry(mesh.index()).or_insert(next);
            if index == next {
                found.push((mesh, Vec::new()));
            }
            found[index].1.push(to_world);
        }
        let mut children: Vec<_> = node.children().map(|child| (child, to_world)).collect();
        children.reverse();
        pending.extend(children);
    }
    found
}

/// A corner moved into the scene.
fn moved(corner: Corner, to_world: &DAffine3) -> Corner {
    let normals = to_world.matrix3.inverse().transpose();
    Corner {
        position: to_world.transform_point3(corner.position),
        normal: corner.normal.map(|normal| normals * normal),
        ..corner
    }
}

/// The triangles of every mesh where it stands, in the order of the file. Positions are within the rounding of a
/// transform; a mirrored triangle may begin with any corner, and runs the other way round. `None` if the crate rejects
/// the file, or the file needs what the crate leaves to its users: skins, morph weights, or instances of an extension.
fn check_gltf(path: &Path, model: &Model) -> Option<Result<(), String>> {
    let gltf = gltf::Gltf::open(path).ok()?;
    let weighted = gltf.nodes().any(|node| node.weights().is_some())
        || gltf.meshes().any(|mesh| mesh.weights().is_some());
    let instanced = gltf.extensions_used().any(|name| name == "EXT_mesh_gpu_instancing");
    if gltf.skins().next().is_some() || weighted || instanced {
        return None;
    }
    let buffers = buffers(&gltf, path)?;
    let mut theirs = Vec::new();
    for (mesh, places) in placed_meshes(&gltf) {
        let local = mesh_triangles(&mesh, &buffers)?;
        for to_world in places.iter().filter(|place| place.matrix3.determinant() != 0.0) {
            let mirrored = to_world.matrix3.determinant() < 0.0;
            theirs.extend(local.iter().map(|t| (t.map(|corner| moved(corner, to_world)), mirrored)));
        }
    }
    let mut ours = Vec::new();
    for instance in &model.instances {
        let mesh = &model.meshes[instance.mesh as usize];
        let to_world = instance.to_world.map_or(DAffine3::IDENTITY, |to_world| {
            DAffine3::from_mat4(glam::Mat4::from(to_world).as_dmat4())
        });
        let corner = |vertex| moved(our_corner(mesh, vertex), &to_world);
        // The triangles of an instance are turned when it is hit, those of a mesh that was moved have been.
        let turned = instance.to_world.is_none();
        ours.extend(mesh.triangles.iter().map(|triangle| (triangle.map(corner), turned)));
    }
    if ours.len() != theirs.len() {
        return Some(Err(format!("{} triangles, ours are {}", theirs.len(), ours.len())));
    }
    let largest =
        theirs.iter().flat_map(|(t, _)| t).map(|c| c.position.abs().max_element()).fold(0.0, f64::max);
    for (number, ((ours, turned), (theirs, mirrored))) in ours.iter().zip(&theirs).enumerate() {
        let [a, b, c] = *theirs;
        let expected = if *mirrored && *turned { [a, c, b] } else { [a, b, c] };
        let same =
            (0..3).any(|first| (0..3).all(|i| agree(&ours[(first + i) % 3], &expected[i], 1e-6 * largest)));
        if !same {
            return Some(Err(format!("triangle {number} is {expected:?}, ours is {ours:?}")));
        }
    }
    Some(Ok(()))
}

#[test]
fn the_gltf_crate_finds_the_same_triangles() {
    let compared = compare(ModelFormat::Gltf, check_gltf);
    // The repository holds no glTF file: all are beside the project.
    assert!(compared >= 10 || shared("scenes").is_none(), "{compared}");
}
