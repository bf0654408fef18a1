//! Axis-aligned boxes.

use glam::Vec3;

/// Axis-aligned box; empty when any `min` exceeds `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl Bounds {
    /// The empty box.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Grows to hold a point; one with a coordinate that isn't finite is passed over.
    pub fn extend(&mut self, point: Vec3) {
        if point.is_finite() {
            self.min = self.min.min(point);
            self.max = self.max.max(point);
        }
    }

    /// Whether it holds no point.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Whether it holds a point; its faces belong to it.
    pub fn contains(&self, point: Vec3) -> bool {
        self.min.cmple(point).all() && point.cmple(self.max).all()
    }

    /// Edge lengths; 0 for the empty box.
    pub fn extent(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    /// Middle of the box; the origin for the empty box.
    pub fn center(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.min * 0.5 + self.max * 0.5 }
    }
}

impl super::TriangleMesh {
    /// Box around the vertices in object space.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        self.positions.as_slice().iter().for_each(|&position| bounds.extend(position.into()));
        bounds
    }
}

impl super::Scene {
    /// Box around all triangles in world space.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for instance in &self.instances {
            let mesh = &self.meshes[instance.mesh as usize];
            for &[x, y, z] in mesh.positions.as_slice() {
                let p = Vec3::new(x, y, z);
                bounds.extend(instance.to_world.map_or(p, |m| m.transform_point3(p)));
            }
        }
        bounds
    }

    /// Number of triangles with instances counted each time they are placed.
    pub fn triangle_count(&self) -> u64 {
        self.instances.iter().map(|i| self.meshes[i.mesh as usize].triangles.len() as u64).sum()
    }
}
