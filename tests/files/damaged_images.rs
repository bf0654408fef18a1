//! Damaged and hostile picture files end in an error: no panic, no endless loop, no huge allocation.

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
use exr::meta::header::LayerAttributes;
use exr::prelude::{Blocks, Compression, Vec2, WritableImage};
use lightmesh::image::exr::SampleType;
use lightmesh::image::{self, Image};

fn picture() -> Image {
    let pixels = (0..40 * 37).map(|i| [i as f32, (i * i % 97) as f32 / 7.0, 0.5]).collect();
    Image::from_pixels(40, 37, pixels).unwrap()
}

/// EXR files in every compression that the decoder knows, as scan lines and as tiles.
fn exr_files() -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let compressions = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
    ];
    let source = picture();
    for compression in compressions {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 16))] {
            let encoding = Encoding { compression, blocks, ..Encoding::UNCOMPRESSED };
            let plane = |channel: usize| {
                let values = source.pixels().iter().map(|pixel| exr::prelude::f16::from_f32(pixel[channel]));
                FlatSamples::F16(values.collect())
            };
            let channels = ["R", "G", "B"].into_iter().enumerate();
            let channels = channels.map(|(index, name)| AnyChannel::new(name, plane(index))).collect();
            let layer =
                Layer::new((40, 37), LayerAttributes::default(), encoding, AnyChannels::sort(channels));
            let mut bytes = std::io::Cursor::new(Vec::new());
            ExrImage::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
            files.push((format!("{compression:?} {blocks:?}"), bytes.into_inner()));
        }
    }
    files
}

fn png_file() -> Vec<u8> {
    image::png::encode(&picture(), 0.0, &[("Key".to_owned(), "value".to_owned())]).unwrap()
}

/// Decodes and, if that succeeds, checks that the result is an image at all.
fn must_not_panic(bytes: &[u8]) {
    if let Ok(image) = image::decode(bytes) {
        assert_eq!(image.pixels().len(), image.width() as usize * image.height() as usize);
    }
    if let Ok(image) = image::exr::decode_channels(bytes) {
        assert!(image.channels.iter().all(|channel| channel.samples.len() as u64 == image.window.pixels()));
    }
}

/// Every prefix of a file lacks something.
#[test]
fn truncated_files_are_errors() {
    let exr = image::exr::encode(&picture(), SampleType::Half, &[]).unwrap();
    for bytes in [exr, png_file()] {
        for length in (0..bytes.len()).step_by(bytes.len() / 300 + 1) {
            // The last 12 bytes of a PNG are an empty chunk that says that it ends there.
            if length < bytes.len() - 12 {
                assert!(image::decode(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
                assert!(image::exr::decode_channels(&bytes[..length]).is_err(), "{length}: all channels");
            }
        }
    }
}

/// Flips bits at positions from a fixed sequence, and sets header bytes to extreme values: sizes, counts, offsets.
#[test]
fn files_with_wrong_bytes_never_panic() {
    let mut files = exr_files();
    files.push(("PNG".to_owned(), png_file()));
    let mut state = 0x9e37_79b9_u32;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as usize
    };
    for (name, bytes) in files {
        eprintln!("{name}");
        assert!(image::decode(&bytes).is_ok(), "{name} is readable as it is");
        let header = bytes.len().min(700);
        for position in 0..header {
            for value in [0, 0x7f, 0x80, 0xff, bytes[position] ^ 1] {
                let mut damaged = bytes.clone();
                damaged[position] = value;
                must_not_panic(&damaged);
            }
        }
        for _ in 0..500 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random() % 4 {
                let position = random() % damaged.len();
                damaged[position] = random() as u8;
            }
            must_not_panic(&damaged);
        }
    }
}

/// 16,000 by 16,000 pixels would take 3 GB.
#[test]
fn a_small_png_that_claims_a_huge_picture_is_refused_before_anything_is_allocated() {
    let mut bytes = png_file();
    bytes[16..20].copy_from_slice(&16_000_u32.to_be_bytes());
    bytes[20..24].copy_from_slice(&16_000_u32.to_be_bytes());
    let crc = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    let message = image::decode(&bytes).unwrap_err().to_string();
    assert!(message.contains("16000 by 16000"), "{message}");
}

#[test]
fn a_small_exr_that_claims_a_huge_picture_is_refused_before_anything_is_allocated() {
    let mut bytes = image::exr::encode(&picture(), SampleType::Half, &[]).unwrap();
    for name in [b"dataWindow\0box2i\0".as_slice(), b"displayWindow\0box2i\0"] {
        let start = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 4;
        bytes[start + 8..start + 12].copy_from_slice(&15_999_i32.to_le_bytes());
        bytes[start + 12..start + 16].copy_from_slice(&15_999_i32.to_le_bytes());
    }
    let name = b"chunkCount\0int\0";
    let start = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 4;
    bytes[start..start + 4].copy_from_slice(&1000_i32.to_le_bytes());
    let message = image::decode(&bytes).unwrap_err().to_string();
    assert!(message.contains("16000 by 16000"), "{message}");
}

/// CRC-32 as of ISO 3309, which PNG chunks end with.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 * (crc & 1)))
    })
}
