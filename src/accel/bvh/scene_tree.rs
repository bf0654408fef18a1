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

/// Builds both levels.
pub fn build_scene(scene: &Scene) -> Result<(Blas, Instances), BvhError> {
    let mesh_of = |index: u32, instance: usize| {
        scene.meshes.get(index as usize).ok_or(BvhError::NoSuchMesh { instance, mesh: index })
    };
    let masks = AlphaMasks::of_scene(scene);
    let mut fixed: Vec<(u32, &Arc<TriangleMesh>)> = Vec::new();
    let mut instances = Instances::default();
    let mut tree_of_mesh = HashMap::new();
    let mut boxes = Vec::new();
    if scene.instances.len() >= LEAF as usize {
        return Err(BvhError::TooManyTriangles);
    }
    for (index, instance) in scene.instances.iter().enumerate() {
        let mesh = mesh_of(instance.mesh, index)?;
        let Some(to_world) = &instance.to_world else {
            fixed.push((index as u32, mesh));
            continue;
        };
        let Some(to_object) = WorldToObject::new(to_world) else { continue };
        let tree = match tree_of_mesh.get(&instance.mesh) {
            Some(&tree) => tree,
            None => {
                instances.trees.push(build_blas(&[(0, mesh)], &masks)?);
                let tree = instances.trees.len() - 1;
                tree_of_mesh.insert(instance.mesh, tree);
                tree
            }
        };
        let tree_bounds = &instances.trees[tree].tree;
        if tree_bounds.nodes.is_empty() {
            continue;
        }
        let Some([lower, upper]) = world_bounds(to_world, tree_bounds.bounds) else { continue };
        let number = instances.placed.len() as u32;
        boxes.push(Primitive::new(lower.into(), upper.into(), number));
        instances.placed.push(Placed { instance: index as u32, tree, to_object });
    }
    let collapsed = build_wide(boxes);
    instances.leaves = collapsed
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
    instances.tree = collapsed.tree;
    Ok((build_blas(&fixed, &masks)?, instances))
}
