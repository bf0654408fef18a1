//! OpenEXR's own tools read in our EXR files what was written.

use std::path::Path;

use lightmesh::image::exr::{SampleType, encode};
use lightmesh::image::{self, Image};

use crate::common::data::run;

const SIZE: (u32, u32) = (37, 21);

/// Values of all magnitudes, exact in half precision; no two neighbours and no two channels are alike, and there is more
/// than one block of 16 rows.
fn picture() -> Image {
    let value = |i: u32, channel: u32| {
        let mantissa = 1.0 + ((i * 7 + channel * 13) % 1024) as f32 / 1024.0;
        let sign = if i.is_multiple_of(5) { -1.0 } else { 1.0 };
        sign * mantissa * 2f32.powi((i % 29) as i32 - 14)
    };
    let pixels = (0..SIZE.0 * SIZE.1).map(|i| [0, 1, 2].map(|channel| value(i, channel))).collect();
    Image::from_pixels(SIZE.0, SIZE.1, pixels).unwrap()
}

#[test]
fn its_tools_read_our_headers() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ours.exr");
    let metadata = [("backend".to_owned(), "bvh, ² and all".to_owned())];
    for (sample_type, name) in
        [(SampleType::Half, "16-bit floating-point"), (SampleType::Float, "32-bit floating-point")]
    {
        std::fs::write(&file, encode(&picture(), sample_type, &metadata).unwrap()).unwrap();
        let Some(header) = run("exrheader", "openexr", &[&file]) else { return };
        for channel in ["R", "G", "B"] {
            assert!(header.contains(&format!("{channel}, {name}, sampling 1 1")), "{header}");
        }
        for window in ["dataWindow", "displayWindow"] {
            assert!(header.contains(&format!("{window} (type box2i): (0 0) - (36 20)")), "{header}");
        }
        assert!(header.contains("compression (type compression): zip, multi-scanline blocks"), "{header}");
        assert!(header.contains("backend (type string): \"bvh, ² and all\""), "{header}");
        // BT.709, as its recommendation states it.
        for primary in ["(0.64 0.33)", "(0.3 0.6)", "(0.15 0.06)", "(0.3127 0.329)"] {
            assert!(header.contains(primary), "{primary}: {header}");
        }
    }
}

/// `exrmaketiled` decodes our file and writes the samples, without compression, as the one tile that ends its file: row
/// by row, in each the channels in alphabetical order.
fn as_openexr_reads(ours: &Path, theirs: &Path, bytes_per_sample: usize) -> Option<Vec<u8>> {
    let size = [SIZE.0.to_string(), SIZE.1.to_string()];
    let [width, height] = size.each_ref().map(Path::new);
    let arguments = ["-z", "none", "-t"].map(Path::new).into_iter().chain([width, height, ours, theirs]);
    run("exrmaketiled", "openexr", &arguments.collect::<Vec<_>>())?;
    let file = std::fs::read(theirs).unwrap();
    let length = (3 * SIZE.0 * SIZE.1) as usize * bytes_per_sample;
    Some(file[file.len() - length..].to_vec())
}

#[test]
fn its_library_decodes_our_samples_to_the_last_bit() {
    let folder = tempfile::tempdir().unwrap();
    let [ours, theirs] = ["ours.exr", "theirs.exr"].map(|name| folder.path().join(name));
    let picture = picture();
    let row = SIZE.0 as usize;
    for (sample_type, bytes_per_sample) in [(SampleType::Half, 2), (SampleType::Float, 4)] {
        std::fs::write(&ours, encode(&picture, sample_type, &[]).unwrap()).unwrap();
        let Some(decoded) = as_openexr_reads(&ours, &theirs, bytes_per_sample) else { return };
        for (at, sample) in decoded.chunks_exact(bytes_per_sample).enumerate() {
            let (y, channel, x) = (at / (3 * row), 2 - at / row % 3, at % row);
            let value = match *sample {
                [a, b] => exr::prelude::f16::from_le_bytes([a, b]).to_f32(),
                [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
                _ => unreachable!("samples of two or four bytes"),
            };
            let expected = picture.pixels()[y * row + x][channel];
            assert!(value.to_bits() == expected.to_bits(), "({x}, {y})[{channel}]: {value}, {expected}");
        }
        // What OpenEXR wrote, our reader reads.
        assert_eq!(image::read(&theirs).unwrap().pixels(), picture.pixels());
    }
}
