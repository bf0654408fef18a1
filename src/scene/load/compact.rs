//! Leaving out what no triangle uses.

use std::sync::Arc;

use crate::scene::{Positions, TriangleMesh};

/// A vertex without a triangle so far.
const UNUSED: u32 = u32::MAX;

/// Drops vertices that no triangle has a corner at: they would count in the scene's bounds.
pub fn drop_unused_vertices(mesh: &mut TriangleMesh) {
    let count = mesh.positions.as_slice().len();
    let mut number = vec![UNUSED; count];
    mesh.triangles.iter().flatten().for_each(|&vertex| number[vertex as usize] = 0);
    if number.iter().all(|&number| number != UNUSED) {
        return;
    }
    for (next, number) in (0..).zip(number.iter_mut().filter(|number| **number != UNUSED)) {
        *number = next;
    }
    fn kept<T: Copy>(list: &[T], number: &[u32]) -> Vec<T> {
        list.iter().zip(number).filter(|(_, number)| **number != UNUSED).map(|(&value, _)| value).collect()
    }
    mesh.positions = Positions::new(kept(mesh.positions.as_slice(), &number));
    mesh.normals = mesh.normals.as_ref().map(|list| kept(list, &number));
    mesh.uvs = mesh.uvs.as_ref().map(|list| kept(list, &number));
    mesh.colors = mesh.colors.as_ref().map(|list| kept(list, &number));
    let renumbered = mesh.triangles.iter().map(|triangle| triangle.map(|vertex| number[vertex as usize]));
    mesh.triangles = Arc::new(renumbered.collect());
}
