//! Both levels: a tree of all triangles in world space, trees per instanced mesh, and a tree of instances.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3A;
use rayon::prelude::*;

use crate::accel::MAX_COORDINATE;
use crate::scene::{AlphaMasks, Scene, TriangleMesh};

use super::blas::{Blas, Part};
use super::build::Primitive;
use super::collapse::build_wide;
use super::error::BvhError;
use super::instance::{WorldToObject, world_bounds};
use super::node::{LEAF, TriangleBlock, WIDTH, WideTree};

/// A tree of instances.
#[derive(Default)]
pub struct Instances {
    pub tree: WideTree,
    /// Up to eight indices into `placed` per leaf, `u32::MAX` for none.
    pub leaves: Vec<[u32; WIDTH]>,
    pub placed: Vec<Placed>,
    /// Trees of the instanced meshes.
    pub trees: Vec<Blas>,
    /// From [`Scene::meshes`] to `trees`.
    pub tree_of_mesh: HashMap<u32, usize>,
}

/// An instance with a transform.
pub struct Placed {
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Index into [`Instances::trees`].
    pub tree: usize,
    pub to_object: WorldToObject,
}

/// Builds one tree over meshes in world space; `meshes` come with the index of their instance.
fn build_blas(meshes: &[(u32, &Arc<TriangleMesh>)], masks: &AlphaMasks) -> Result<Blas, BvhError> {
    let mut parts = Vec::with_capacity(meshes.len());
    let mut total = 0u32;
    for (instance, mesh) in meshes {
        parts.push(Part { first: total, instance: *instance, masked: masks.of_mesh(mesh) });
        // Numbers share their word with the leaf bit and the "none" mark of references.
        total = u32::try_from(mesh.triangles.len())
            .ok()
            .and_then(|count| total.checked_add(count))
            .filter(|&total| total < LEAF)
            .ok_or(BvhError::TooManyTriangles)?;
    }
    let has_masks = parts.iter().any(|part| part.masked.is_some());

    let mut primitives = Vec::with_capacity(total as usize);
    for ((_, mesh), part) in meshes.iter().zip(&parts) {
        let positions = mesh.positions.as_slice();
        primitives.par_extend(mesh.triangles.par_iter().enumerate().filter_map(|(index, corners)| {
            let [a, b, c] = corners_of(positions, corners)?.map(Vec3A::from_array);
            // NaN is not within either.
            let within = [a, b, c].iter().all(|p| p.abs().cmple(Vec3A::splat(MAX_COORDINATE)).all());
            within.then(|| Primitive::new(a.min(b).min(c), a.max(b).max(c), part.first + index as u32))
        }));
    }
    let collapsed = build_wide(primitives);
    let blocks = collapsed
        .groups
        .par_iter()
        .map(|group| {
            let mut block = TriangleBlock::EMPTY;
            let range = group.first as usize..(group.first + group.count) as usize;
            let mut ids = [u32::MAX; WIDTH];
            for (slot, &id) in ids.iter_mut().zip(&collapsed.order[range]) {
                *slot = id;
            }
            ids.sort_unstable();
            for (lane, &id) in ids.iter().enumerate().filter(|(_, id)| **id != u32::MAX) {
                let part = parts.partition_point(|part| part.first <= id) - 1;
                let mesh = meshes[part].1;
                let corners = &mesh.triangles[(id - parts[part].first) as usize];
                let Some(corners) = corners_of(mesh.positions.as_slice(), corners) else { continue };
                for (corner, position) in corners.into_iter().enumerate() {
                    for (axis, coordinate) in position.into_iter().enumerate() {
                        block.corners[corner][axis][lane] = coordinate;
                    }
                }
                block.ids[lane] = id;
            }
            block
        })
        .collect();
    Ok(Blas { tree: collapsed.tree, blocks, parts, has_masks })
}

fn corners_of(positions: &[[f32; 3]], corners: &[u32; 3]) -> Option<[[f32; 3]; 3]> {
    let [a, b, c] = corners.map(|index| positions.get(index as usize).copied());
    Some([a?, b?, c?])
}

/// The upper level: where instances stand.
pub struct Placements {
    tree: WideTree,
    leaves: Vec<[u32; WIDTH]>,
    placed: Vec<Placed>,
    /// Instances of meshes that are in world space already.
    pub fixed: Vec<u32>,
}

impl Instances {
    /// Finds where instances stand; trees of meshes that have none yet are added.
    pub fn place(&mut self, scene: &Scene, masks: &AlphaMasks) -> Result<Placements, BvhError> {
        if scene.instances.len() >= LEAF as usize {
            return Err(BvhError::TooManyTriangles);
        }
        let (mut fixed, mut placed, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
        for (index, instance) in scene.instances.iter().enumerate() {
            let mesh = mesh_of(scene, index)?;
            let Some(to_world) = &instance.to_world else {
                fixed.push(index as u32);
                continue;
            };
            let Some(to_object) = WorldToObject::new(to_world) else { continue };
            let tree = match self.tree_of_mesh.get(&instance.mesh) {
                Some(&tree) => tree,
                None => {
                    self.trees.push(build_blas(&[(0, mesh)], masks)?);
                    let tree = self.trees.len() - 1;
                    self.tree_of_mesh.insert(instance.mesh, tree);
                    tree
                }
            };
            let tree_bounds = &self.trees[tree].tree;
            if tree_bounds.nodes.is_empty() {
                continue;
            }
            let Some([lower, upper]) = world_bounds(to_world, tree_bounds.bounds) else { continue };
            let number = placed.len() as u32;
            boxes.push(Primitive::new(lower.into(), upper.into(), number));
            placed.push(Placed { instance: index as u32, tree, to_object });
        }
        let collapsed = build_wide(boxes);
        let leaves = collapsed
            .groups
            .iter()
            .map(|group| {
                let range = group.first as usize..(group.first + group.count) as usize;
                let mut leaf = [u32::MAX; WIDTH];
                for (slot, &number) in leaf.iter_mut().zip(&collapsed.order[range]) {
                    *slot = number;
                }
                leaf
            })
            .collect();
        Ok(Placements { tree: collapsed.tree, leaves, placed, fixed })
    }

    /// Entries that a traversal of either level keeps at most.
    pub fn stack_bound(&self, placements: &Placements, fixed: &Blas) -> usize {
        let of_meshes = self.trees.iter().chain([fixed]).map(|blas| blas.tree.stack_bound).max();
        of_meshes.unwrap_or(0).max(placements.tree.stack_bound)
    }

    /// Takes over where instances stand.
    pub fn set(&mut self, placements: Placements) {
        (self.tree, self.leaves, self.placed) = (placements.tree, placements.leaves, placements.placed);
    }
}

fn mesh_of(scene: &Scene, instance: usize) -> Result<&Arc<TriangleMesh>, BvhError> {
    let mesh = scene.instances[instance].mesh;
    scene.meshes.get(mesh as usize).ok_or(BvhError::NoSuchMesh { instance, mesh })
}

/// Builds the tree of all triangles that are in world space already.
pub fn build_fixed(scene: &Scene, fixed: &[u32], masks: &AlphaMasks) -> Result<Blas, BvhError> {
    let meshes = fixed.iter().map(|&instance| Ok((instance, mesh_of(scene, instance as usize)?)));
    build_blas(&meshes.collect::<Result<Vec<_>, _>>()?, masks)
}
