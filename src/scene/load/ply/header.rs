//! The header: which elements there are, and what they are made of.

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Decimal, separated by white space.
    Ascii,
    /// Least significant byte first.
    LittleEndian,
    /// Most significant byte first.
    BigEndian,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Result<Self, String> {
        Ok(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return Err(format!("'{}' is not a type", name.escape_debug())),
        })
    }

    /// Bytes in binary files.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Value that stands for full intensity of a colour.
    pub fn full_intensity(self) -> f64 {
        match self {
            Self::F32 | Self::F64 => 1.0,
            Self::I8 | Self::U8 => 255.0,
            Self::I16 | Self::U16 => 65_535.0,
            Self::I32 | Self::U32 => 4_294_967_295.0,
        }
    }
}

/// A property of an element.
#[derive(Clone, Debug)]
pub struct Property {
    /// Its name.
    pub name: String,
    /// Type of its value, or of its values.
    pub scalar: Scalar,
    /// For lists, the type of the number of values.
    pub count: Option<Scalar>,
}

/// Rows of one kind.
#[derive(Clone, Debug)]
pub struct Element {
    /// Its name, such as `vertex`.
    pub name: String,
    /// Number of rows.
    pub count: u64,
    /// Columns.
    pub properties: Vec<Property>,
}

/// What stands before the data.
#[derive(Debug)]
pub struct Header {
    /// How the data is written.
    pub encoding: Encoding,
    /// Elements in the order of the data.
    pub elements: Vec<Element>,
    /// Where the data starts.
    pub length: usize,
}

/// Bytes that a header may have.
const MAX_HEADER: usize = 1 << 20;

impl Header {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// Line, from 1, and what is wrong there.
    pub fn parse(bytes: &[u8]) -> Result<Self, (usize, String)> {
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut at = 0;
        for number in 1.. {
            let rest = bytes.get(at..bytes.len().min(MAX_HEADER)).unwrap_or_default();
            let Some(end) = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')) else {
                return Err((number, "the header has no end_header line".to_owned()));
            };
            let line = String::from_utf8_lossy(&rest[..end]);
            at += end + if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let fail = |problem: String| Err((number, problem));
            match words[..] {
                ["ply"] if number == 1 => {}
                _ if number == 1 => return fail("does not start with 'ply'".to_owned()),
                [] | ["comment" | "obj_info", ..] => {}
                ["format", name, _version] => {
                    encoding = Some(match name {
                        "ascii" => Encoding::Ascii,
                        "binary_little_endian" => Encoding::LittleEndian,
                        "binary_big_endian" => Encoding::BigEndian,
                        _ => return fail(format!("format '{}' is unknown", name.escape_debug())),
                    });
                }
                ["element", name, count] => {
                    let Ok(count) = count.parse() else {
                        return fail(format!("'{}' is not a number of elements", count.escape_debug()));
                    };
                    elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                ["property", ref rest @ ..] => {
                    let property = property(rest).map_err(|problem| (number, problem))?;
                    match elements.last_mut() {
                        Some(element) => element.properties.push(property),
                        None => return fail("a property before the first element".to_owned()),
                    }
                }
                ["end_header"] => {
                    let Some(encoding) = encoding else {
                        return fail("the header states no format".to_owned());
                    };
                    return Ok(Self { encoding, elements, length: at });
                }
                _ => return fail(format!("'{}' is not understood", excerpt(&line))),
            }
        }
        Err((1, "the header does not end".to_owned()))
    }
}

fn property(words: &[&str]) -> Result<Property, String> {
    match *words {
        ["list", count, scalar, name] => {
            let count = Scalar::parse(count)?;
            if matches!(count, Scalar::F32 | Scalar::F64) {
                return Err("the length of a list must be an integer".to_owned());
            }
            Ok(Property { name: name.to_owned(), scalar: Scalar::parse(scalar)?, count: Some(count) })
        }
        [scalar, name] => Ok(Property { name: name.to_owned(), scalar: Scalar::parse(scalar)?, count: None }),
        _ => Err("a property needs a type and a name".to_owned()),
    }
}

fn excerpt(line: &str) -> String {
    line.chars().take(40).collect::<String>().escape_debug().to_string()
}
