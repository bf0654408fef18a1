//! What is written in any of the formats is read back as it was: random small models, vertex by vertex.

use std::path::Path;

use lightmesh::scene::load::{Model, gltf, obj, ply};
use proptest::prelude::*;

use crate::common::soup::Soup;

fn area_is_positive(soup: &[[f32; 3]], [a, b, c]: [u32; 3]) -> bool {
    let at = |i: u32| glam::DVec3::from_array(soup[i as usize].map(f64::from));
    (at(b) - at(a)).cross(at(c) - at(a)) != glam::DVec3::ZERO
}

fn soups() -> impl Strategy<Value = Soup> {
    let coordinate = prop_oneof![-1.0f32..1.0, -1e6f32..1e6, Just(0.0), -1e-6f32..1e-6];
    let positions = prop::collection::vec(prop::array::uniform3(coordinate), 3..24);
    positions
        .prop_flat_map(|positions| {
            let corner = 0..positions.len() as u32;
            (Just(positions), prop::collection::vec(prop::array::uniform3(corner), 1..32))
        })
        .prop_map(|(positions, mut triangles)| {
            triangles.retain(|&triangle| area_is_positive(&positions, triangle));
            Soup { positions, triangles }
        })
        .prop_filter("some triangle has an area", |soup| !soup.triangles.is_empty())
}

/// Corner positions of all triangles, in order.
fn corners(model: &Model) -> Vec<[[f32; 3]; 3]> {
    let mesh = &model.meshes[0];
    (0..mesh.triangles.len() as u32).map(|i| mesh.corners(i).map(|corner| corner.to_array())).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_format_gives_back_the_triangles_that_were_written(soup in soups()) {
        let expected = soup.corners();
        let name = Path::new("test");
        let read = obj::read_obj(soup.obj().as_bytes(), name, obj::ChunkSizes::default()).unwrap();
        prop_assert_eq!(corners(&read), &*expected, "obj");
        for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
            let read = ply::read_ply(&soup.ply(encoding), name).unwrap();
            prop_assert_eq!(corners(&read), &*expected, "ply {}", encoding);
        }
        let read = gltf::read_gltf(soup.gltf().as_bytes(), name).unwrap();
        prop_assert_eq!(corners(&read), &*expected, "gltf");
    }

    /// A file that was cut off or changed anywhere is read or refused; it never ends the program.
    #[test]
    fn damaged_files_are_read_or_refused(
        soup in soups(),
        cut in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
    ) {
        let name = Path::new("test");
        let damage = |mut bytes: Vec<u8>| {
            bytes.truncate(cut.index(bytes.len()) + 1);
            changes.iter().for_each(|(at, value)| { let at = at.index(bytes.len()); bytes[at] = *value; });
            bytes
        };
        let _ = obj::read_obj(&*damage(soup.obj().into_bytes()), name, obj::ChunkSizes::default());
        let _ = ply::read_ply(&damage(soup.ply("ascii")), name);
        let _ = ply::read_ply(&damage(soup.ply("binary_little_endian")), name);
        let _ = gltf::read_gltf(&damage(soup.gltf().into_bytes()), name);
    }
}
