//! The parts that the light of a tile's vertices is asked for in, where layers need them.

use glam::Vec3;

use crate::light_mesh::points::Neighbours;
use crate::lights::{PackedGroups, PackedLights, Visibility};
use crate::render::paths::PathVertex;

/// Parts of the light of a tile's vertices, by vertex.
pub struct LightParts<'a> {
    /// Light that came by way of surfaces; what an integrator gives beside is direct.
    pub(in crate::render) indirect: Vec<Vec3>,
    /// Direct light by group, if that is asked for.
    pub(in crate::render) groups: Option<GroupLight<'a>>,
    /// Mesh points in the neighbourhood, if they are to be counted; 0 where an integrator has none.
    pub(in crate::render) mesh_points: Option<Vec<u32>>,
    /// Estimated error of direct light, if that is asked for; 0 where an integrator makes none, or knows of none.
    pub(in crate::render) error: Option<Vec<Vec3>>,
}

impl<'a> LightParts<'a> {
    /// Of so many vertices, dark as yet.
    pub(super) fn new(
        vertices: usize,
        groups: Option<&'a PackedGroups>,
        count_points: bool,
        estimate_error: bool,
    ) -> Self {
        Self {
            indirect: vec![Vec3::ZERO; vertices],
            groups: groups.map(|groups| GroupLight::new(groups, vertices)),
            mesh_points: count_points.then(|| vec![0; vertices]),
            error: estimate_error.then(|| vec![Vec3::ZERO; vertices]),
        }
    }

    /// Of so many vertices, of which nothing is asked but how wrong their direct light is.
    pub(in crate::render) fn of_error(vertices: usize) -> Self {
        Self::new(vertices, None, false, true)
    }

    /// What is asked for beside the sum of direct light: that of each group, and its error by vertex.
    pub(in crate::render) fn of_direct(&mut self) -> (Option<&mut GroupLight<'a>>, Option<&mut [Vec3]>) {
        (self.groups.as_mut(), self.error.as_deref_mut())
    }

    /// Counts the mesh points around each vertex.
    pub(in crate::render) fn count_points(
        &mut self,
        vertices: &[PathVertex],
        find: impl Fn(&PathVertex, &mut Neighbours),
    ) {
        let mut found = Neighbours::default();
        for (count, vertex) in self.mesh_points.iter_mut().flatten().zip(vertices) {
            find(vertex, &mut found);
            *count = found.ids().len() as u32;
        }
    }
}

/// Direct light of vertices by group of lights.
///
/// Only the ratios count: each group gets its share of what the integrator's estimator gives.
pub(in crate::render) struct GroupLight<'a> {
    groups: &'a PackedGroups,
    /// By vertex and group.
    light: Vec<Vec3>,
}

impl<'a> GroupLight<'a> {
    fn new(groups: &'a PackedGroups, vertices: usize) -> Self {
        Self { groups, light: vec![Vec3::ZERO; vertices * groups.names().len()] }
    }

    /// Adds the light of all lights to a vertex, by what it sees of them.
    #[inline(always)]
    pub fn add(
        &mut self,
        lights: &PackedLights,
        number: usize,
        vertex: &PathVertex,
        visibility: impl Visibility,
    ) {
        let (groups, sums) = self.of_vertex(number);
        groups.add_irradiance(lights, &vertex.surface, visibility, sums);
    }

    /// The groups, and a vertex's light of each.
    #[inline(always)]
    pub fn of_vertex(&mut self, number: usize) -> (&'a PackedGroups, &mut [Vec3]) {
        let count = self.groups.names().len();
        (self.groups, &mut self.light[number * count..][..count])
    }

    /// Adds to a vertex's light of one light, given by the index of its chunk and its number there.
    #[inline(always)]
    pub fn change(&mut self, lights: &PackedLights, vertex: usize, of: (usize, usize), by: Vec3) {
        let count = self.groups.names().len();
        self.light[vertex * count + lights.group(of.0, of.1)] += by;
    }

    /// Number of groups.
    pub fn count(&self) -> usize {
        self.groups.names().len()
    }

    /// Passes each group's share of a vertex's light on, the colours apart. Light that no group has is the default group's: what an
    /// estimator smears over normals may be where no light is.
    pub(super) fn share(&self, vertex: usize, light: Vec3, mut each: impl FnMut(usize, Vec3)) {
        let count = self.count();
        let own = &self.light[vertex * count..][..count];
        let total: Vec3 = own.iter().map(|part| part.max(Vec3::ZERO)).sum();
        let known = total.cmpgt(Vec3::ZERO);
        for (group, part) in own.iter().enumerate() {
            let rest = if group == 0 { Vec3::ONE } else { Vec3::ZERO };
            each(group, light * Vec3::select(known, part.max(Vec3::ZERO) / total, rest));
        }
    }
}
