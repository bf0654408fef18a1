//! Statements to one triangle mesh.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::chunk::NameKind;
use super::materials::MaterialTable;
use super::statements::{ABSENT, Statements};
use crate::color::linear_from_srgb;
use crate::scene::load::triangulate::{Triangulator, has_no_area};
use crate::scene::load::{LoadError, Model, Part, Warning};
use crate::scene::{Instance, Positions, TriangleMaterials, TriangleMesh};

/// Faces that one task triangulates.
const FACES_PER_TASK: usize = 16 << 10;
/// Vertices at one position that are compared before a corner gets a vertex of its own: a limit on the
/// time spent on files in which very many different normals meet at a point.
const LONGEST_CHAIN: usize = 32;

/// Builds the model; `path` names the file in messages.
pub fn assemble(
    mut statements: Statements,
    mut table: MaterialTable,
    path: &Path,
) -> Result<Model, LoadError> {
    let mut skipped = statements.skipped;
    let mut warnings = std::mem::take(&mut statements.warnings);
    skipped.bad_normals = normalize(&mut statements.normals);
    let colors_told = colors_to_linear(&mut statements.colors);
    if colors_told {
        let message = "vertex colours above 1 are read as 0 to 255".to_owned();
        warnings.push(Warning { file: path.to_owned(), line: None, message });
    }

    let tasks = triangulate(&statements);
    let mut builder = MeshBuilder::new(&statements);
    let mut runs = Runs::new(&statements);
    for task in tasks {
        skipped.zero_area_triangles += task.without_area;
        for (corners, face) in task.triangles.into_iter().zip(task.faces) {
            runs.advance(face, builder.triangles.len() as u32, &mut table, path);
            builder.triangle(corners);
            builder.materials.push(runs.material);
        }
    }
    let parts = runs.finish(builder.triangles.len() as u32);
    if builder.triangles.is_empty() {
        return Err(LoadError::Empty { file: path.to_owned(), skipped });
    }
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let mesh = builder.finish(name);
    let (materials, more) = table.into_used();
    warnings.extend(more);
    let instances = vec![Instance { mesh: 0, to_world: None }];
    Ok(Model { meshes: vec![mesh], instances, materials, parts, skipped, warnings, ..Model::default() })
}

/// Makes normals unit length, those without a direction zero; returns how many those are.
fn normalize(normals: &mut [[f32; 3]]) -> u64 {
    normals
        .par_iter_mut()
        .map(|normal| {
            // In double precision no length of finite components over- or underflows.
            let direction = glam::DVec3::from_array(normal.map(f64::from)).try_normalize();
            *normal = direction.map_or([0.0; 3], |d| d.as_vec3().to_array());
            u64::from(direction.is_none())
        })
        .sum()
}

/// Decodes vertex colours from sRGB, as modelling programs write them; returns whether they run to 255 instead of 1.
fn colors_to_linear(colors: &mut [[f32; 3]]) -> bool {
    let bytes = colors.par_iter().any(|color| color.iter().any(|&c| c > 1.0));
    let scale = if bytes { 1.0 / 255.0 } else { 1.0 };
    let linear = |c: f32| linear_from_srgb((c * scale).min(1.0));
    colors.par_iter_mut().for_each(|color| *color = color.map(linear));
    bytes
}

/// Triangles of some consecutive faces.
#[derive(Default)]
struct Triangulated {
    /// Corner numbers.
    triangles: Vec<[u32; 3]>,
    /// Face of every triangle.
    faces: Vec<u32>,
    without_area: u64,
}

fn triangulate(statements: &Statements) -> Vec<Triangulated> {
    let faces = &statements.faces;
    let tasks = faces.par_chunks(FACES_PER_TASK).enumerate().map(|(task, chunk)| {
        let first_face = task * FACES_PER_TASK;
        let mut start = first_face.checked_sub(1).map_or(0, |before| faces[before].corner_end);
        let mut result = Triangulated::default();
        result.triangles.reserve(chunk.len());
        result.faces.reserve(chunk.len());
        let mut triangulator = Triangulator::default();
        let mut corners = Vec::new();
        for (face, end) in (first_face as u32..).zip(chunk.iter().map(|face| face.corner_end)) {
            let indices = &statements.corner_positions[start as usize..end as usize];
            corners.clear();
            corners.extend(indices.iter().map(|&i| statements.positions[i as usize]));
            triangulator.split(&corners, |triangle| {
                if has_no_area(triangle.map(|i| corners[i])) {
                    result.without_area += 1;
                } else {
                    result.triangles.push(triangle.map(|i| start + i as u32));
                    result.faces.push(face);
                }
            });
            start = end;
        }
        result
    });
    tasks.collect()
}

/// Follows the names that are in force from face to face.
struct Runs<'a> {
    statements: &'a Statements,
    next: usize,
    object: &'a str,
    group: &'a str,
    material_name: (&'a str, u32),
    material: u32,
    part_start: u32,
    parts: Vec<Part>,
    started: bool,
}

impl<'a> Runs<'a> {
    fn new(statements: &'a Statements) -> Self {
        Self {
            statements,
            next: 0,
            object: "",
            group: "",
            material_name: ("", 0),
            material: 0,
            part_start: 0,
            parts: Vec::new(),
            started: false,
        }
    }

    /// Applies the statements before `face`, whose first triangle is `triangle`.
    #[inline]
    fn advance(&mut self, face: u32, triangle: u32, table: &mut MaterialTable, path: &Path) {
        let pending = self.statements.names.get(self.next).is_some_and(|name| name.face <= face);
        if !pending && self.started {
            return;
        }
        self.started = true;
        while let Some(statement) = self.statements.names.get(self.next).filter(|name| name.face <= face) {
            self.next += 1;
            match statement.kind {
                NameKind::Object => {
                    self.close_part(triangle);
                    self.object = &statement.name;
                }
                NameKind::Group => {
                    self.close_part(triangle);
                    self.group = &statement.name;
                }
                NameKind::Material => self.material_name = (&statement.name, statement.line),
                NameKind::Library => {}
            }
        }
        let (name, line) = self.material_name;
        self.material = table.index(name, path, line);
    }

    fn close_part(&mut self, end: u32) {
        let triangles = std::mem::replace(&mut self.part_start, end)..end;
        if triangles.is_empty() || (self.object.is_empty() && self.group.is_empty()) {
            return;
        }
        let (object, group) = (self.object.to_owned(), self.group.to_owned());
        self.parts.push(Part { mesh: 0, object, group, triangles });
    }

    fn finish(mut self, triangles: u32) -> Vec<Part> {
        self.close_part(triangles);
        self.parts
    }
}

/// Makes one vertex of every different combination of position, texture coordinate and normal, in the
/// order of first use; what no triangle uses is left out.
struct MeshBuilder<'a> {
    statements: &'a Statements,
    /// First vertex at every position of the file.
    first_at: Vec<u32>,
    /// Next vertex at the same position; empty where positions alone make vertices.
    next_at: Vec<u32>,
    position_of: Vec<u32>,
    uv_of: Vec<u32>,
    normal_of: Vec<u32>,
    /// Normals of faces that have none of their own, numbered after the file's.
    face_normals: Vec<[f32; 3]>,
    has_uvs: bool,
    has_normals: bool,
    triangles: Vec<[u32; 3]>,
    materials: Vec<u32>,
}

impl<'a> MeshBuilder<'a> {
    fn new(statements: &'a Statements) -> Self {
        let present = |indices: &[u32], good: &(dyn Fn(u32) -> bool + Sync)| {
            indices.par_iter().any(|&index| index != ABSENT && good(index))
        };
        let good_normal = |index: u32| statements.normals[index as usize] != [0.0; 3];
        Self {
            first_at: vec![ABSENT; statements.positions.len()],
            next_at: Vec::new(),
            position_of: Vec::new(),
            uv_of: Vec::new(),
            normal_of: Vec::new(),
            face_normals: Vec::new(),
            has_uvs: present(&statements.corner_uvs, &|_| true),
            has_normals: present(&statements.corner_normals, &good_normal),
            triangles: Vec::with_capacity(statements.faces.len()),
            materials: Vec::with_capacity(statements.faces.len()),
            statements,
        }
    }

    /// Adds a triangle by its corner numbers.
    #[inline]
    fn triangle(&mut self, corners: [u32; 3]) {
        let statements = self.statements;
        if !self.has_uvs && !self.has_normals {
            let vertices =
                corners.map(|corner| self.plain_vertex(statements.corner_positions[corner as usize]));
            self.triangles.push(vertices);
            return;
        }
        let mut face_normal = ABSENT;
        let vertices = corners.map(|corner| {
            let corner = corner as usize;
            let uv = if self.has_uvs { statements.corner_uvs[corner] } else { ABSENT };
            let normal = match statements.corner_normals.get(corner) {
                _ if !self.has_normals => ABSENT,
                Some(&index) if index != ABSENT && statements.normals[index as usize] != [0.0; 3] => index,
                _ => {
                    if face_normal == ABSENT {
                        face_normal = (statements.normals.len() + self.face_normals.len()) as u32;
                        self.face_normals.push(self.normal_of_face(corners));
                    }
                    face_normal
                }
            };
            self.vertex(statements.corner_positions[corner], uv, normal)
        });
        self.triangles.push(vertices);
    }

    #[inline]
    fn plain_vertex(&mut self, position: u32) -> u32 {
        let vertex = &mut self.first_at[position as usize];
        if *vertex == ABSENT {
            *vertex = self.position_of.len() as u32;
            self.position_of.push(position);
        }
        *vertex
    }

    #[inline]
    fn vertex(&mut self, position: u32, uv: u32, normal: u32) -> u32 {
        let first = self.first_at[position as usize];
        let mut vertex = first;
        for _ in 0..LONGEST_CHAIN {
            if vertex == ABSENT {
                break;
            }
            let at = vertex as usize;
            if self.same_uv(self.uv_of[at], uv) && self.same_normal(self.normal_of[at], normal) {
                return vertex;
            }
            vertex = self.next_at[at];
        }
        let new = self.position_of.len() as u32;
        self.position_of.push(position);
        self.uv_of.push(uv);
        self.normal_of.push(normal);
        self.next_at.push(first);
        self.first_at[position as usize] = new;
        new
    }

    /// Many files state the same value again for every face, so values count, not indices.
    #[inline]
    fn same_uv(&self, a: u32, b: u32) -> bool {
        let uvs = &self.statements.uvs;
        a == b || (a != ABSENT && b != ABSENT && uvs[a as usize] == uvs[b as usize])
    }

    #[inline]
    fn same_normal(&self, a: u32, b: u32) -> bool {
        a == b || (a != ABSENT && b != ABSENT && self.normal(a) == self.normal(b))
    }

    /// A normal of the file, or of a face that has none.
    #[inline]
    fn normal(&self, index: u32) -> [f32; 3] {
        match (index as usize).checked_sub(self.statements.normals.len()) {
            None => self.statements.normals[index as usize],
            Some(of_face) => self.face_normals[of_face],
        }
    }

    fn normal_of_face(&self, corners: [u32; 3]) -> [f32; 3] {
        let point = |corner: u32| {
            let position = self.statements.corner_positions[corner as usize];
            glam::DVec3::from_array(self.statements.positions[position as usize].map(f64::from))
        };
        let [a, b, c] = corners.map(point);
        (b - a).cross(c - a).try_normalize().map_or(Vec3::Z, |n| n.as_vec3()).to_array()
    }

    fn finish(self, name: String) -> TriangleMesh {
        let statements = self.statements;
        let gather = |index: u32, list: &[[f32; 3]]| list.get(index as usize).copied();
        // One more than needed, for the padding.
        let mut positions = Vec::with_capacity(self.position_of.len() + 1);
        positions.extend(self.position_of.iter().filter_map(|&i| gather(i, &statements.positions)));
        let colors = (!statements.colors.is_empty())
            .then(|| self.position_of.iter().filter_map(|&i| gather(i, &statements.colors)).collect());
        let uvs = self.has_uvs.then(|| {
            let uv = |&i: &u32| statements.uvs.get(i as usize).copied().unwrap_or_default();
            self.uv_of.iter().map(uv).collect()
        });
        let normals =
            self.has_normals.then(|| self.normal_of.iter().map(|&index| self.normal(index)).collect());
        let first = self.materials.first().copied().unwrap_or(0);
        let materials = if self.materials.iter().all(|&material| material == first) {
            TriangleMaterials::Uniform(first)
        } else {
            TriangleMaterials::PerTriangle(self.materials)
        };
        let positions = Positions::new(positions);
        let triangles = Arc::new(self.triangles);
        TriangleMesh { name, positions, triangles, normals, uvs, colors, materials }
    }
}
