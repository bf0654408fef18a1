//! What a scene must be like to be rendered, checked where it is handed over.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{AlphaMask, Falloff, Light, LightKind, Material, Scene, TriangleMaterials, TriangleMesh};
use crate::Bounds;

/// A scene that contradicts itself, or holds numbers that no light can be computed from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// There is no material, not even one that nothing uses.
    #[error("the scene has no material")]
    NoMaterial,
    /// An instance of a mesh that the scene doesn't have.
    #[error("instance {instance} places mesh {mesh}, which does not exist")]
    NoSuchMesh {
        /// Index into [`Scene::instances`].
        instance: usize,
        /// Index that is out of range of [`Scene::meshes`].
        mesh: u32,
    },
    /// A mesh that contradicts itself or the list of materials.
    #[error("mesh {index} `{name}`: {error}")]
    Mesh {
        /// Index into [`Scene::meshes`].
        index: usize,
        /// Its name.
        name: String,
        /// What is wrong.
        error: MeshDataError,
    },
    /// A material with a value that it cannot have.
    #[error("material {index} `{name}`: {value}")]
    Material {
        /// Index into [`Scene::materials`].
        index: usize,
        /// Its name.
        name: String,
        /// What is wrong.
        value: BadValue,
    },
    /// A light with a value that it cannot have.
    #[error("light {index}: {value}")]
    Light {
        /// Index into [`Scene::lights`].
        index: usize,
        /// What is wrong.
        value: BadValue,
    },
    /// A value that all of the scene shares.
    #[error("{0}")]
    Value(BadValue),
}

/// What is wrong with a mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshDataError {
    /// A triangle names a vertex that the mesh doesn't have.
    #[error("triangle {triangle} has index {vertex} of {vertices} vertices")]
    Vertex {
        /// Index of the triangle.
        triangle: usize,
        /// Index of the vertex.
        vertex: u32,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// A triangle has a material that the scene doesn't have.
    #[error("triangle {triangle} has material {material} of {materials}")]
    Material {
        /// Index of the triangle.
        triangle: usize,
        /// Index of the material.
        material: u32,
        /// Materials of the scene.
        materials: usize,
    },
    /// An array has another length than it must.
    #[error("{count} {what} for {expected} {of}")]
    Length {
        /// What the array holds.
        what: &'static str,
        /// Its length.
        count: usize,
        /// What there is one value for.
        of: &'static str,
        /// How many of them there are.
        expected: usize,
    },
}

/// A value out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} must {rule}, found {found}")]
pub struct BadValue {
    /// Name of the field.
    pub field: &'static str,
    /// What holds for good values, in words.
    pub rule: &'static str,
    /// The value.
    pub found: String,
}

/// How far the length of a direction may be from 1.
const UNIT_TOLERANCE: f32 = 1e-3;

impl Light {
    /// Whether light can be computed from the light; `index` is its place in the scene, for the message.
    ///
    /// # Errors
    /// [`SceneError::Light`].
    pub fn validate(&self, index: usize) -> Result<(), SceneError> {
        validate_light(self).map_err(|value| SceneError::Light { index, value })
    }
}

impl Scene {
    /// Whether the scene can be rendered: all indices exist, arrays are as long as they must be, and lights, colours and
    /// masks are finite and not negative.
    ///
    /// Positions of vertices and placements may be anything: what is not finite is never hit.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place.
    pub fn validate(&self) -> Result<(), SceneError> {
        if self.materials.is_empty() {
            return Err(SceneError::NoMaterial);
        }
        for (index, material) in self.materials.iter().enumerate() {
            let error = |value| SceneError::Material { index, name: material.name.clone(), value };
            validate_material(material).map_err(error)?;
        }
        for (index, light) in self.lights.iter().enumerate() {
            light.validate(index)?;
        }
        if let Falloff::Linear { constant } = self.falloff {
            not_negative("falloff constant", constant).map_err(SceneError::Value)?;
        }
        color("background", self.background).map_err(SceneError::Value)?;
        let extent = self.extent;
        let rule = "be finite or empty";
        let holds = extent == Bounds::EMPTY || (extent.min.is_finite() && extent.max.is_finite());
        check("extent", rule, format!("{} to {}", extent.min, extent.max), holds)
            .map_err(SceneError::Value)?;
        for (index, mesh) in self.meshes.iter().enumerate() {
            let error = |error| SceneError::Mesh { index, name: mesh.name.clone(), error };
            validate_mesh(mesh, self.materials.len()).map_err(error)?;
        }
        let missing = |instance: &super::Instance| instance.mesh as usize >= self.meshes.len();
        match self.instances.par_iter().position_first(missing) {
            Some(instance) => Err(SceneError::NoSuchMesh { instance, mesh: self.instances[instance].mesh }),
            None => Ok(()),
        }
    }
}

fn validate_mesh(mesh: &TriangleMesh, materials: usize) -> Result<(), MeshDataError> {
    let vertices = mesh.positions.as_slice().len();
    let length = |what, count: Option<usize>, of, expected| match count {
        Some(count) if count != expected => Err(MeshDataError::Length { what, count, of, expected }),
        _ => Ok(()),
    };
    length("normals", mesh.normals.as_ref().map(Vec::len), "vertices", vertices)?;
    length("texture coordinates", mesh.uvs.as_ref().map(Vec::len), "vertices", vertices)?;
    length("colours", mesh.colors.as_ref().map(Vec::len), "vertices", vertices)?;
    let beyond = |corners: &[u32; 3]| corners.iter().any(|&vertex| vertex as usize >= vertices);
    if let Some(triangle) = mesh.triangles.par_iter().position_first(beyond) {
        let vertex = mesh.triangles[triangle].into_iter().max().unwrap_or_default();
        return Err(MeshDataError::Vertex { triangle, vertex, vertices });
    }
    let missing = |material: &u32| *material as usize >= materials;
    let bad = match &mesh.materials {
        TriangleMaterials::Uniform(material) => missing(material).then_some((0, *material)),
        TriangleMaterials::PerTriangle(list) => {
            length("materials", Some(list.len()), "triangles", mesh.triangles.len())?;
            list.par_iter().position_first(missing).map(|triangle| (triangle, list[triangle]))
        }
    };
    match bad {
        Some((triangle, material)) => Err(MeshDataError::Material { triangle, material, materials }),
        None => Ok(()),
    }
}

fn validate_material(material: &Material) -> Result<(), BadValue> {
    color("diffuse", material.diffuse)?;
    color("specular", material.specular)?;
    color("emission", material.emission)?;
    match &material.alpha_mask {
        Some(AlphaMask { alpha, cutoff, .. }) => {
            not_negative("alpha", *alpha)?;
            not_negative("alpha cutoff", *cutoff)
        }
        None => Ok(()),
    }
}

fn validate_light(light: &Light) -> Result<(), BadValue> {
    color("intensity", light.intensity)?;
    if !matches!(light.kind, LightKind::Directional { .. }) {
        check("position", "be finite", light.position, light.position.is_finite())?;
    }
    if let LightKind::Ball { radius } = light.kind {
        check("radius", "be finite and above 0", radius, radius.is_finite() && radius > 0.0)?;
    }
    let (LightKind::Spot { direction, .. } | LightKind::Directional { direction }) = light.kind else {
        return Ok(());
    };
    let unit = (direction.length() - 1.0).abs() <= UNIT_TOLERANCE;
    check("direction", "be of unit length", direction, unit)?;
    let LightKind::Spot { inner_cosine, outer_cosine, .. } = light.kind else { return Ok(()) };
    let ordered = outer_cosine <= inner_cosine && (-1.0..=1.0).contains(&outer_cosine) && inner_cosine <= 1.0;
    let rule = "be cosines of angles of which the outer one is at least the inner one";
    check("cone", rule, Vec2::new(inner_cosine, outer_cosine), ordered)
}

fn color(field: &'static str, value: Vec3) -> Result<(), BadValue> {
    check(field, "be finite and not negative", value, value.is_finite() && value.min_element() >= 0.0)
}

fn not_negative(field: &'static str, value: f32) -> Result<(), BadValue> {
    check(field, "be finite and not negative", value, value.is_finite() && value >= 0.0)
}

fn check(
    field: &'static str,
    rule: &'static str,
    value: impl std::fmt::Display,
    holds: bool,
) -> Result<(), BadValue> {
    if holds { Ok(()) } else { Err(BadValue { field, rule, found: value.to_string() }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Instance;
    use std::sync::Arc;

    /// Two triangles of four vertices.
    fn square() -> TriangleMesh {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        TriangleMesh { name: "square".to_owned(), ..TriangleMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]) }
    }

    fn with(mesh: TriangleMesh) -> Scene {
        let mut scene = Scene::new();
        scene.add(mesh);
        scene
    }

    fn message(scene: &Scene) -> String {
        scene.validate().unwrap_err().to_string()
    }

    /// Positions may be anything, since what is not finite is never hit; so may placements.
    #[test]
    fn what_is_never_hit_is_accepted() {
        let mut scene = with(TriangleMesh::new(vec![[f32::NAN; 3], [0.0; 3], [1e30; 3]], vec![[0, 1, 2]]));
        scene.place(0, glam::Affine3A::from_scale(Vec3::ZERO));
        scene.place(0, glam::Affine3A::from_scale(Vec3::INFINITY));
        assert_eq!(scene.validate(), Ok(()));
        assert_eq!(Scene::new().validate(), Ok(()), "an empty scene is black, and no error");
    }

    /// An index that is out of range would end the program in the middle of a render; the error says which it is.
    #[test]
    fn indices_must_exist() {
        assert_eq!(message(&Scene::default()), "the scene has no material");
        let mut scene = with(square());
        scene.instances.push(Instance { mesh: 7, to_world: None });
        assert_eq!(message(&scene), "instance 1 places mesh 7, which does not exist");
        let triangles = Arc::new(vec![[0, 1, 2], [0, 99, 3]]);
        let scene = with(TriangleMesh { triangles, ..square() });
        assert_eq!(message(&scene), "mesh 0 `square`: triangle 1 has index 99 of 4 vertices");
        let scene = with(TriangleMesh { materials: TriangleMaterials::PerTriangle(vec![0, 3]), ..square() });
        assert_eq!(message(&scene), "mesh 0 `square`: triangle 1 has material 3 of 1");
        assert_eq!(
            message(&with(square().with_material(1))),
            "mesh 0 `square`: triangle 0 has material 1 of 1"
        );
    }

    /// Arrays per vertex and per triangle are looked up by the same index as those.
    #[test]
    fn arrays_must_be_as_long_as_what_they_describe() {
        let scene = with(TriangleMesh { normals: Some(vec![[0.0; 3]; 3]), ..square() });
        assert_eq!(message(&scene), "mesh 0 `square`: 3 normals for 4 vertices");
        let scene = with(TriangleMesh { uvs: Some(vec![[0.0; 2]; 5]), ..square() });
        assert_eq!(message(&scene), "mesh 0 `square`: 5 texture coordinates for 4 vertices");
        let scene = with(TriangleMesh { colors: Some(Vec::new()), ..square() });
        assert_eq!(message(&scene), "mesh 0 `square`: 0 colours for 4 vertices");
        let scene = with(TriangleMesh { materials: TriangleMaterials::PerTriangle(vec![0]), ..square() });
        assert_eq!(message(&scene), "mesh 0 `square`: 1 materials for 2 triangles");
    }

    /// A colour that is not finite would spread over the image through every reflection of it.
    #[test]
    fn colours_must_be_finite_and_not_negative() {
        let mut scene = Scene::new();
        for (diffuse, found) in
            [(Vec3::NEG_ONE, "[-1, -1, -1]"), (Vec3::new(0.5, f32::INFINITY, 0.5), "[0.5, inf, 0.5]")]
        {
            scene.materials[0].diffuse = diffuse;
            let expected = format!("material 0 ``: diffuse must be finite and not negative, found {found}");
            assert_eq!(message(&scene), expected);
        }
        scene.materials[0] = Material {
            alpha_mask: Some(AlphaMask { map: None, alpha: 1.0, cutoff: f32::NAN }),
            ..Material::default()
        };
        assert_eq!(message(&scene), "material 0 ``: alpha cutoff must be finite and not negative, found NaN");
        let scene = Scene { background: Vec3::NAN, ..Scene::new() };
        assert_eq!(message(&scene), "background must be finite and not negative, found [NaN, NaN, NaN]");
        let scene = Scene { falloff: Falloff::Linear { constant: -1.0 }, ..Scene::new() };
        assert_eq!(message(&scene), "falloff constant must be finite and not negative, found -1");
    }

    /// The same of lights, whose directions must be of unit length since cosines are taken with them.
    #[test]
    fn lights_must_be_finite_and_their_directions_of_unit_length() {
        let good = Light::point(Vec3::ZERO, Vec3::ONE);
        let message = |light: Light| {
            let mut scene = Scene::new();
            scene.lights = vec![good, light];
            message(&scene)
        };
        let intensity = "light 1: intensity must be finite and not negative, found [-1, 0, 0]";
        assert_eq!(message(Light { intensity: Vec3::NEG_X, ..good }), intensity);
        let position = "light 1: position must be finite, found [NaN, NaN, NaN]";
        assert_eq!(message(Light { position: Vec3::NAN, ..good }), position);
        let kind = LightKind::Directional { direction: Vec3::Y * 2.0 };
        let direction = "light 1: direction must be of unit length, found [0, 2, 0]";
        assert_eq!(message(Light { kind, ..good }), direction);
        assert!(message(Light::directional(Vec3::ZERO, Vec3::ONE)).contains("unit length"));
        let spot = |inner, outer| Light::spot(Vec3::ZERO, Vec3::X * 3.0, [inner, outer], Vec3::ONE);
        assert!(message(spot(30.0, 20.0)).contains("cone must be"));
        let mut scene = Scene::new();
        scene.lights = vec![good, spot(20.0, 30.0), Light::directional(Vec3::splat(1e30), Vec3::ONE)];
        assert_eq!(scene.validate(), Ok(()));
    }
}
