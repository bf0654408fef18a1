//! Pictures survive the way to disk and back, and files of others are read for what they mean.

use exr::image::{AnyChannel as Channel, write::layers::WritableLayers};
use exr::meta::attribute::AttributeValue;
use exr::meta::header::LayerAttributes;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image as ExrImage, IntegerBounds, Layer, Layers,
    Vec2, WritableImage, f16,
};
use lightmesh::image::exr::SampleType;
use lightmesh::image::{self, DecodeError, Image};

/// A picture whose values half precision holds exactly: multiples of 1/8 below 256.
fn eighths(width: u32, height: u32) -> Image {
    let value = |i: u32, channel: u32| ((i * 7 + channel * 13) % 2048) as f32 / 8.0;
    let pixels = (0..width * height).map(|i| [value(i, 0), value(i, 1), value(i, 2)]).collect();
    Image::from_pixels(width, height, pixels).unwrap()
}

/// Encodes any layers with the crate's own writer, as another program would.
fn foreign<'a, L>(file: &'a ExrImage<L>) -> Vec<u8>
where
    L: WritableLayers<'a>,
{
    let mut bytes = std::io::Cursor::new(Vec::new());
    file.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// One channel whose samples are given in reading order.
fn channel(name: &str, samples: FlatSamples) -> Channel<FlatSamples> {
    AnyChannel::new(name, samples)
}

/// A layer of the given channels.
fn layer(
    size: (usize, usize),
    encoding: Encoding,
    channels: Vec<Channel<FlatSamples>>,
) -> Layer<AnyChannels<FlatSamples>> {
    let channels = AnyChannels::sort(channels.into_iter().collect());
    Layer::new(size, LayerAttributes::default(), encoding, channels)
}

#[test]
fn float_exr_returns_every_bit() {
    let awkward = [f32::MIN_POSITIVE, -0.0, 1e-42, f32::MAX, 0.1, 65_537.0, f32::INFINITY, -3.5, 1.0 / 3.0];
    let pixels = awkward.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    let picture = Image::from_pixels(3, 1, pixels).unwrap();
    let back = image::decode(&image::exr::encode(&picture, SampleType::Float, &[]).unwrap()).unwrap();
    let bits =
        |image: &Image| -> Vec<u32> { image.pixels().as_flattened().iter().map(|v| v.to_bits()).collect() };
    assert_eq!(bits(&picture), bits(&back));
}

#[test]
fn half_exr_returns_what_half_precision_holds() {
    // 37 rows end in an incomplete block of 16.
    let picture = eighths(53, 37);
    let back = image::decode(&image::exr::encode(&picture, SampleType::Half, &[]).unwrap()).unwrap();
    assert_eq!(picture, back);
}

/// The largest half is 65,504: a bright lamp must not become infinite, which would spoil every later mean.
#[test]
fn half_exr_keeps_bright_values_finite_and_infinite_ones_visible() {
    let picture = Image::from_pixels(1, 1, vec![[1e6, -1e6, f32::INFINITY]]).unwrap();
    let back = image::decode(&image::exr::encode(&picture, SampleType::Half, &[]).unwrap()).unwrap();
    assert_eq!(back.pixels(), [[65_504.0, -65_504.0, f32::INFINITY]]);
}

#[test]
fn exr_metadata_is_stored_as_string_attributes() {
    let metadata =
        [("lightmesh.backend", "embree 4.3.3"), ("a name longer than thirty-one characters", "größer")];
    let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let bytes = image::exr::encode(&eighths(4, 4), SampleType::Half, &metadata).unwrap();
    let read = exr::meta::MetaData::read_from_buffered(std::io::Cursor::new(&bytes), true).unwrap();
    let stored = &read.headers[0].own_attributes;
    for (key, value) in &metadata {
        match stored.other.iter().find(|(name, _)| name.as_slice() == key.as_bytes()) {
            Some((_, AttributeValue::Text(text))) => assert_eq!(text.as_slice(), value.as_bytes()),
            other => panic!("{key}: {other:?}"),
        }
    }
    assert_eq!(stored.software_name.as_ref().unwrap().to_string(), "lightmesh");
    assert_eq!(read.headers[0].compression, exr::prelude::Compression::ZIP16);
}

/// A renderer that writes only a crop stores a data window inside the display window; an overscan lies outside.
#[test]
fn the_display_window_is_the_picture_whatever_the_data_window() {
    let samples = |first: f32| FlatSamples::F32((0..6).map(|i| first + i as f32).collect());
    let mut crop = layer(
        (3, 2),
        Encoding::UNCOMPRESSED,
        vec![channel("R", samples(1.0)), channel("G", samples(11.0)), channel("B", samples(21.0))],
    );
    // Display window: columns 10 to 13, rows 20 to 22; data window: columns 12 to 14, rows 19 and 20.
    crop.attributes.layer_position = Vec2(12, 19);
    let mut file = ExrImage::from_layer(crop);
    file.attributes.display_window = IntegerBounds::new((10, 20), (4, 3));
    let read = image::decode(&foreign(&file)).unwrap();
    assert_eq!((read.width(), read.height()), (4, 3));
    let black = [0.0; 3];
    let row = [black, black, [4.0, 14.0, 24.0], [5.0, 15.0, 25.0]];
    assert_eq!(read.pixels()[..4], row);
    assert_eq!(read.pixels()[4..], [black; 8]);
}

#[test]
fn half_float_and_integer_channels_tiles_and_alpha_are_read() {
    let size = (70, 40);
    let count = size.0 * size.1;
    let channels = vec![
        channel("A", FlatSamples::F16(vec![f16::ONE; count])),
        channel("R", FlatSamples::F16((0..count).map(|i| f16::from_f32((i % 1000) as f32)).collect())),
        channel("G", FlatSamples::F32((0..count).map(|i| i as f32 / 3.0).collect())),
        channel("B", FlatSamples::U32((0..count as u32).collect())),
    ];
    let tiled = Encoding { blocks: Blocks::Tiles(Vec2(32, 16)), ..Encoding::SMALL_LOSSLESS };
    let read = image::decode(&foreign(&ExrImage::from_layer(layer(size, tiled, channels)))).unwrap();
    for (i, pixel) in read.pixels().iter().enumerate() {
        assert_eq!(*pixel, [(i % 1000) as f32, i as f32 / 3.0, i as f32]);
    }
}

#[test]
fn of_many_layers_the_first_with_colour_is_read() {
    let flat = |value: f32| FlatSamples::F32(vec![value; 4]);
    let named = |name: &str, channels| {
        let mut layer = layer((2, 2), Encoding::FAST_LOSSLESS, channels);
        layer.attributes.layer_name = Some(name.into());
        layer
    };
    let depth = named("depth", vec![channel("Z", flat(9.0))]);
    let rgb = |prefix: &str, value: f32| {
        ["R", "G", "B"].map(|c| channel(&format!("{prefix}{c}"), flat(value))).into_iter().collect::<Vec<_>>()
    };
    let beauty = named("beauty", rgb("combined.", 1.0));
    let other = named("other", rgb("", 2.0));
    let attributes = exr::meta::header::ImageAttributes::with_size((2, 2));
    let file = ExrImage::from_layers(attributes, Layers::from_vec(vec![depth, beauty, other]));
    assert_eq!(image::decode(&foreign(&file)).unwrap().pixels(), [[1.0; 3]; 4]);

    // Within one layer, plain names come before prefixed ones.
    let mut both = rgb("", 3.0);
    both.extend(rgb("albedo.", 4.0));
    let file = ExrImage::from_layer(layer((2, 2), Encoding::FAST_LOSSLESS, both));
    assert_eq!(image::decode(&foreign(&file)).unwrap().pixels(), [[3.0; 3]; 4]);
}

#[test]
fn luminance_alone_is_grey_and_anything_else_is_refused_by_name() {
    let flat = |value: f32| FlatSamples::F32(vec![value; 4]);
    let read = |channels| {
        image::decode(&foreign(&ExrImage::from_layer(layer((2, 2), Encoding::FAST_LOSSLESS, channels))))
    };
    assert_eq!(read(vec![channel("Y", flat(0.25))]).unwrap().pixels(), [[0.25; 3]; 4]);
    let chroma = read(vec![channel("Y", flat(0.25)), channel("RY", flat(0.0)), channel("BY", flat(0.0))]);
    assert!(matches!(chroma, Err(DecodeError::Unsupported { format: "EXR", .. })), "{chroma:?}");
    let message = read(vec![channel("Z", flat(1.0))]).unwrap_err().to_string();
    assert!(message.contains('Z'), "{message}");
}

#[test]
fn other_primaries_are_refused_because_their_numbers_mean_other_colours() {
    let mut file = ExrImage::from_layer(layer(
        (1, 1),
        Encoding::UNCOMPRESSED,
        ["R", "G", "B"].map(|name| channel(name, FlatSamples::F32(vec![1.0]))).into_iter().collect(),
    ));
    file.attributes.chromaticities = Some(exr::meta::attribute::Chromaticities {
        red: Vec2(0.7347, 0.2653),
        green: Vec2(0.0, 1.0),
        blue: Vec2(0.0001, -0.077),
        white: Vec2(0.32168, 0.33767),
    });
    let message = image::decode(&foreign(&file)).unwrap_err().to_string();
    assert!(message.contains("primaries"), "{message}");
}

/// sRGB codes by IEC 61966-2-1: 18 % grey is 118, half of the light 188; one stop up, 18 % shows as 36 %: 162.
#[test]
fn png_holds_srgb_codes_of_the_exposed_picture() {
    let picture = Image::from_pixels(2, 1, vec![[0.18, 0.5, 1.0], [0.0, 2.0, f32::NAN]]).unwrap();
    let codes = |exposure| {
        let bytes = image::png::encode(&picture, exposure, &[]).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        assert!(reader.info().srgb.is_some());
        let mut codes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut codes).unwrap();
        codes
    };
    assert_eq!(codes(0.0), [118, 188, 255, 0, 255, 0]);
    assert_eq!(codes(1.0), [162, 255, 255, 0, 255, 0]);
}

#[test]
fn png_metadata_is_stored_as_text_chunks() {
    let metadata = [("Backend".to_owned(), "bvh".to_owned()), ("Scene".to_owned(), "лес".to_owned())];
    let bytes = image::png::encode(&eighths(2, 2), 0.0, &metadata).unwrap();
    let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let info = reader.info();
    assert_eq!(
        (info.uncompressed_latin1_text[0].keyword.as_str(), info.uncompressed_latin1_text[0].text.as_str()),
        ("Backend", "bvh")
    );
    assert_eq!(info.utf8_text[0].get_text().unwrap(), "лес");
}

/// Encodes raw samples as a PNG, with a palette and transparency where given.
fn raw_png(color: png::ColorType, depth: png::BitDepth, size: (u32, u32), samples: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size.0, size.1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 255, 0, 255]);
        encoder.set_trns(vec![255, 255]);
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(samples).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn png_of_every_colour_type_is_read() {
    use png::{BitDepth, ColorType};
    let read = |color, depth, samples: &[u8]| {
        image::decode(&raw_png(color, depth, (1, 1), samples)).unwrap().pixels()[0]
    };
    assert_eq!(read(ColorType::Grayscale, BitDepth::Eight, &[255]), [1.0; 3]);
    assert_eq!(read(ColorType::Grayscale, BitDepth::One, &[0x80]), [1.0; 3]);
    assert_eq!(read(ColorType::Rgb, BitDepth::Sixteen, &[255, 255, 0, 0, 255, 255]), [1.0, 0.0, 1.0]);
    assert_eq!(read(ColorType::Indexed, BitDepth::Two, &[0b0100_0000]), [1.0, 0.0, 1.0]);
    // Alpha scales light, not codes: 51 of 255 is a fifth.
    assert_eq!(read(ColorType::GrayscaleAlpha, BitDepth::Eight, &[255, 51]), [0.2; 3]);
    assert_eq!(read(ColorType::Rgba, BitDepth::Eight, &[255, 0, 255, 51]), [0.2, 0.0, 0.2]);
    // sRGB code 188 of 255 is 0.5029 of the light.
    let half = read(ColorType::Grayscale, BitDepth::Eight, &[188])[0];
    assert!((half - 0.5029).abs() < 1e-4, "{half}");
}

/// Blocks are compressed in parallel, which must not show in the file.
#[test]
fn the_same_picture_gives_the_same_bytes() {
    let picture = eighths(64, 48);
    for sample_type in [SampleType::Half, SampleType::Float] {
        let encode = || image::exr::encode(&picture, sample_type, &[]).unwrap();
        assert_eq!(encode(), encode());
    }
}
