//! Files of any set of channels: what is written comes back, to the last bit, and what can't be written is refused.

use lightmesh::image::exr::{
    Channel, ChannelImage, DataWindow, SampleType, Samples, decode_channels, encode, encode_channels, f16,
};
use lightmesh::image::{self, Image};

use crate::common::data::run;

/// Width and height of the pictures here: more than one block of 16 rows.
const WINDOW: DataWindow = DataWindow { x: 3, y: 5, width: 7, height: 19 };

/// Bits from a fixed sequence: all kinds of numbers, not-a-numbers among them.
fn bits(seed: u32) -> impl Iterator<Item = u32> {
    (0..WINDOW.pixels() as u32).map(move |i| (i + 1).wrapping_mul(seed).wrapping_mul(0x9e37_79b9))
}

/// A crop with channels of each type, in the order of their names.
fn crop() -> ChannelImage {
    let mut image = ChannelImage::new((20, 30), WINDOW);
    image.channels = vec![
        Channel::new("B", Samples::Float(bits(3).map(f32::from_bits).collect())),
        Channel::new("Z", Samples::Half(bits(5).map(|bits| f16::from_bits(bits as u16)).collect())),
        Channel::new("größe.R", Samples::Float(bits(7).map(f32::from_bits).collect())),
        Channel::new("id", Samples::Whole(bits(11).collect())),
    ];
    image.metadata = [("comments", "none"), ("größe", "größer"), ("scene", "a.toml")]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .to_vec();
    image
}

/// Bits of all samples, of which not-a-numbers are equal to nothing.
fn sample_bits(channel: &Channel) -> Vec<u32> {
    match &channel.samples {
        Samples::Half(values) => values.iter().map(|value| u32::from(value.to_bits())).collect(),
        Samples::Float(values) => values.iter().map(|value| value.to_bits()).collect(),
        Samples::Whole(values) => values.clone(),
    }
}

/// Whoever puts tiles together must not change them.
#[test]
fn channels_come_back_to_the_last_bit() {
    let written = crop();
    let bytes = encode_channels(written.clone()).unwrap();
    let read = decode_channels(&bytes).unwrap();
    assert_eq!((read.display, read.window), (written.display, written.window));
    assert_eq!(read.metadata, written.metadata);
    assert_eq!(read.channels.len(), written.channels.len());
    for (read, written) in read.channels.iter().zip(&written.channels) {
        assert_eq!((&read.name, read.samples.type_name()), (&written.name, written.samples.type_name()));
        assert_eq!(sample_bits(read), sample_bits(written), "{}", read.name);
    }
    // The same again, in another order, is the same file.
    let mut turned = written;
    turned.channels.reverse();
    turned.metadata.reverse();
    assert_eq!(encode_channels(turned).unwrap(), bytes);
}

#[test]
fn an_image_is_the_channels_r_g_b_of_its_whole_window() {
    let picture = Image::from_pixels(3, 1, vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 1e9]]).unwrap();
    let read = decode_channels(&encode(&picture, SampleType::Half, &[]).unwrap()).unwrap();
    assert_eq!((read.display, read.window), ((3, 1), DataWindow { x: 0, y: 0, width: 3, height: 1 }));
    let values = |name| {
        let samples = &read.channel(name).unwrap().samples;
        (0..samples.len()).map(|i| samples.get(i).unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(values("R"), [1.0, 4.0, 7.0]);
    assert_eq!(values("G"), [2.0, 5.0, 8.0]);
    // The largest half.
    assert_eq!(values("B"), [3.0, 6.0, 65504.0]);
}

/// The reader of images sees a crop in its place, and nothing around it.
#[test]
fn a_crop_is_read_as_an_image_with_black_around_it() {
    let mut file = ChannelImage::new((20, 30), WINDOW);
    let ones = || Samples::Float(vec![1.0; WINDOW.pixels() as usize]);
    file.channels =
        ["R", "G", "B", "extra.R", "extra.G", "extra.B"].map(|name| Channel::new(name, ones())).to_vec();
    let image = image::decode(&encode_channels(file).unwrap()).unwrap();
    assert_eq!((image.width(), image.height()), (20, 30));
    for (index, pixel) in image.pixels().iter().enumerate() {
        let (x, y) = (index % 20, index / 20);
        let inside = (3..10).contains(&x) && (5..24).contains(&y);
        assert_eq!(*pixel, if inside { [1.0; 3] } else { [0.0; 3] }, "({x}, {y})");
    }
}

#[test]
fn openexr_sees_the_windows_and_types_of_a_crop() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("crop.exr");
    std::fs::write(&file, encode_channels(crop()).unwrap()).unwrap();
    let Some(header) = run("exrheader", "openexr", &[&file]) else { return };
    for expected in [
        "dataWindow (type box2i): (3 5) - (9 23)",
        "displayWindow (type box2i): (0 0) - (19 29)",
        "B, 32-bit floating-point, sampling 1 1",
        "Z, 16-bit floating-point, sampling 1 1",
        "id, 32-bit unsigned integer, sampling 1 1",
        "scene (type string): \"a.toml\"",
    ] {
        assert!(header.contains(expected), "{expected}: {header}");
    }
}

#[test]
fn what_no_file_can_hold_is_refused() {
    let refuse = |change: fn(&mut ChannelImage), expected: &str| {
        let mut image = crop();
        change(&mut image);
        let message = encode_channels(image).unwrap_err().to_string();
        assert!(message.contains(expected), "{expected}: {message}");
    };
    refuse(|image| image.channels.clear(), "no channels");
    refuse(|image| image.channels[1].name = "B".to_owned(), "two channels named `B`");
    refuse(|image| image.channels[1].name.clear(), "without a name");
    refuse(|image| image.channels[1].samples = Samples::Whole(vec![0; 3]), "channel `Z`: 3 samples");
    refuse(|image| image.window.x = -1, "7 by 19 pixels at (-1, 5) in a picture of 20 by 30");
    refuse(|image| image.display.1 = 23, "picture of 20 by 23");
    refuse(|image| image.window.width = 0, "0 by 19 pixels");
    refuse(|image| image.metadata[0].0.clear(), "");
}

/// One part, and its own samples: of anything else a part would be lost.
#[test]
fn files_of_several_parts_are_refused() {
    use exr::image::{AnyChannel as Part, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
    use exr::meta::header::{ImageAttributes, LayerAttributes};
    use exr::prelude::{Vec2, WritableImage as _};
    let layer = |name: &str| {
        let channel = Part::new("Z", FlatSamples::F32(vec![0.0; 4]));
        let channels = AnyChannels::sort([channel].into_iter().collect());
        Layer::new((2, 2), LayerAttributes::named(name), Encoding::UNCOMPRESSED, channels)
    };
    let attributes = ImageAttributes::with_size(Vec2(2, 2));
    let file = ExrImage::empty(attributes).with_layer(layer("one")).with_layer(layer("two"));
    let mut bytes = std::io::Cursor::new(Vec::new());
    file.write().to_buffered(&mut bytes).unwrap();
    let message = decode_channels(&bytes.into_inner()).unwrap_err().to_string();
    assert!(message.contains("2 parts"), "{message}");
}
