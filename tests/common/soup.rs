//! Vertices and triangles, written in each of the formats.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Vertices, and triangles that have an area.
#[derive(Clone, Debug)]
pub struct Soup {
    pub positions: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Soup {
    /// Corner positions of all triangles, in order.
    pub fn corners(&self) -> Vec<[[f32; 3]; 3]> {
        self.triangles.iter().map(|triangle| triangle.map(|i| self.positions[i as usize])).collect()
    }

    /// As OBJ.
    pub fn obj(&self) -> String {
        let mut text = String::new();
        self.positions.iter().for_each(|[x, y, z]| writeln!(text, "v {x:?} {y:?} {z:?}").unwrap());
        self.triangles
            .iter()
            .for_each(|t| writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).unwrap());
        text
    }

    /// As PLY of an encoding by its name in the format.
    pub fn ply(&self, encoding: &str) -> Vec<u8> {
        let (vertices, faces) = (self.positions.len(), self.triangles.len());
        let mut bytes = format!(
            "ply\nformat {encoding} 1.0\ncomment test\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
             property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        )
        .into_bytes();
        let big = encoding == "binary_big_endian";
        for position in &self.positions {
            for x in position {
                match encoding {
                    "ascii" => bytes.extend(format!("{x:?} ").bytes()),
                    _ => bytes.extend(if big { x.to_be_bytes() } else { x.to_le_bytes() }),
                }
            }
        }
        for triangle in &self.triangles {
            match encoding {
                "ascii" => bytes.extend(b"\n3 "),
                _ => bytes.push(3),
            }
            for i in triangle {
                match encoding {
                    "ascii" => bytes.extend(format!("{i} ").bytes()),
                    _ => bytes.extend(if big { i.to_be_bytes() } else { i.to_le_bytes() }),
                }
            }
        }
        bytes
    }

    /// As glTF with the buffer in the file; at most 65,536 vertices.
    pub fn gltf(&self) -> String {
        let mut bytes: Vec<u8> = self.positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let indices_at = bytes.len();
        bytes.extend(self.triangles.iter().flatten().flat_map(|i| (*i as u16).to_le_bytes()));
        let (length, count) = (bytes.len(), self.triangles.len() * 3);
        serde_json::json!({
            "asset": { "version": "2.0" },
            "buffers": [{
                "byteLength": length,
                "uri": format!("data:application/octet-stream;base64,{}", STANDARD.encode(&bytes)),
            }],
            "bufferViews": [
                { "buffer": 0, "byteLength": indices_at },
                { "buffer": 0, "byteOffset": indices_at, "byteLength": length - indices_at },
            ],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": self.positions.len() },
                { "bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": count },
            ],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
            "nodes": [{ "mesh": 0 }],
            "scenes": [{ "nodes": [0] }],
            "scene": 0,
        })
        .to_string()
    }
}
