//! VTK's XML formats: unstructured points (`.vtu`) and regular grids (`.vti`), with the numbers behind the XML as they are in memory.
//!
//! Both are a few lines of XML around arrays of bytes; crate `vtkio`, which reads and writes all of VTK's formats, is many times as much.

use std::fmt::Write as _;

use glam::{UVec3, Vec3};

use super::field::{PointField, Values};

/// Places of the values of a regular grid: x changes fastest, z slowest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageGrid {
    /// The first place.
    pub origin: Vec3,
    /// From one to the next along each axis.
    pub step: Vec3,
    /// How many there are along each axis, at least 1.
    pub counts: UVec3,
}

/// Arrays that follow the XML, each with its length before it.
#[derive(Default)]
struct Appended {
    bytes: Vec<u8>,
}

impl Appended {
    /// Appends an array; returns the XML element that describes it.
    fn array(
        &mut self,
        name: &str,
        kind: &str,
        components: usize,
        bytes: impl Iterator<Item = u8>,
    ) -> String {
        let offset = self.bytes.len();
        self.bytes.extend([0; size_of::<u64>()]);
        self.bytes.extend(bytes);
        let length = (self.bytes.len() - offset - size_of::<u64>()) as u64;
        let head = self.bytes.iter_mut().skip(offset);
        head.zip(length.to_le_bytes()).for_each(|(byte, value)| *byte = value);
        format!(
            "<DataArray type=\"{kind}\" Name=\"{}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>\n",
            escape(name)
        )
    }

    fn values(&mut self, name: &str, count: usize, values: &Values) -> String {
        if let Values::Bytes(values) = values {
            let bytes = (0..count).map(|index| values.get(index).copied().unwrap_or_default());
            return self.array(name, "UInt8", 1, bytes);
        }
        let numbers = (0..count).flat_map(|index| values.of(index)).flat_map(f32::to_le_bytes);
        self.array(name, "Float32", values.components(), numbers)
    }

    fn point_data(&mut self, count: usize, arrays: &[(String, Values)]) -> String {
        let arrays: String = arrays.iter().map(|(name, values)| self.values(name, count, values)).collect();
        format!("<PointData>\n{arrays}</PointData>\n")
    }

    /// The file: XML with the arrays behind it.
    fn file(self, kind: &str, attributes: &str, contents: &str) -> Vec<u8> {
        let mut xml = String::from("<?xml version=\"1.0\"?>\n");
        // Writing to a string can't fail.
        let _ = write!(
            xml,
            "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
             <{kind}{attributes}>\n{contents}</{kind}>\n<AppendedData encoding=\"raw\">\n_"
        );
        [xml.as_bytes(), &self.bytes, b"\n</AppendedData>\n</VTKFile>\n"].concat()
    }
}

/// Points as an unstructured grid of vertices: the bytes of a `.vtu` file.
pub fn encode_vtu(field: &PointField) -> Vec<u8> {
    let count = field.positions.len();
    let numbers = |first: i64| (0..count as i64).flat_map(move |index| (first + index).to_le_bytes());
    let mut appended = Appended::default();
    let positions =
        field.positions.iter().flat_map(|position| position.to_array()).flat_map(f32::to_le_bytes);
    let points = appended.array("Points", "Float32", 3, positions);
    let cells = [
        appended.array("connectivity", "Int64", 1, numbers(0)),
        appended.array("offsets", "Int64", 1, numbers(1)),
        // VTK_VERTEX.
        appended.array("types", "UInt8", 1, std::iter::repeat_n(1, count)),
    ]
    .concat();
    let data = appended.point_data(count, &field.arrays);
    let contents = format!(
        "<Piece NumberOfPoints=\"{count}\" NumberOfCells=\"{count}\">\n<Points>\n{points}</Points>\n<Cells>\n{cells}</Cells>\n{data}</Piece>\n"
    );
    appended.file("UnstructuredGrid", "", &contents)
}

/// Values on a regular grid: the bytes of a `.vti` file.
pub fn encode_vti(grid: &ImageGrid, arrays: &[(String, Values)]) -> Vec<u8> {
    let ImageGrid { origin, step, counts } = *grid;
    let last = counts.max(UVec3::ONE) - 1;
    let extent = format!("0 {} 0 {} 0 {}", last.x, last.y, last.z);
    let attributes = format!(
        " WholeExtent=\"{extent}\" Origin=\"{} {} {}\" Spacing=\"{} {} {}\"",
        origin.x, origin.y, origin.z, step.x, step.y, step.z
    );
    let count = counts.to_array().map(|count| count as usize).iter().product();
    let mut appended = Appended::default();
    let data = appended.point_data(count, arrays);
    let contents = format!("<Piece Extent=\"{extent}\">\n{data}</Piece>\n");
    appended.file("ImageData", &attributes, &contents)
}

/// A name as the value of an attribute.
fn escape(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
