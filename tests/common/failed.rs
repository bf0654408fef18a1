//! What an image test that fails leaves to look at.

use std::fmt::Display;
use std::path::Path;

use lightmesh::image::exr::SampleType;
use lightmesh::image::{Image, ImageOptions, OutputTarget};

use super::bits;

/// Asserts what was found out about an image and its reference. If it isn't so, both and their absolute difference are
/// left in `target/failed/<name of the test>/` as EXR, with all digits, and as PNG.
#[track_caller]
pub fn assert_images(holds: bool, image: &Image, reference: &Image, problem: impl Display) {
    if holds {
        return;
    }
    let place = keep(image, reference);
    panic!("{problem}\nimage, reference and difference: {place}");
}

/// The same for images that must have the same bits in all channels.
#[track_caller]
pub fn assert_same_bits(image: &Image, reference: &Image, problem: impl Display) {
    assert_images(bits(image) == bits(reference), image, reference, problem);
}

/// Writes the images and says where.
fn keep(image: &Image, reference: &Image) -> String {
    // Beside the folder for temporary files that cargo makes in the target folder.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("a target folder");
    let thread = std::thread::current();
    let name = thread.name().unwrap_or("unnamed").replace("::", ".");
    let folder = target.join("failed").join(name);
    std::fs::create_dir_all(&folder).expect("the target folder is writable");
    let pairs = image.pixels().iter().zip(reference.pixels());
    let difference = pairs.map(|(a, b)| [0, 1, 2].map(|channel| (a[channel] - b[channel]).abs())).collect();
    let options = ImageOptions { sample_type: SampleType::Float, ..ImageOptions::default() };
    // Images of unlike size have no difference.
    let difference = Image::from_pixels(image.width(), image.height(), difference).ok();
    let images =
        [("image", Some(image)), ("reference", Some(reference)), ("difference", difference.as_ref())];
    for (name, image) in images.into_iter().filter_map(|(name, image)| Some((name, image?))) {
        for extension in ["exr", "png"] {
            let file = folder.join(format!("{name}.{extension}"));
            OutputTarget::new(&file).and_then(|target| target.write(image, &options)).expect("writable");
        }
    }
    folder.display().to_string()
}
