//! An image test that fails leaves what there is to look at, and says where.

use std::panic::catch_unwind;
use std::path::Path;

use lightmesh::image::{self, Image};

use crate::common::failed::assert_images;

#[test]
fn a_failed_comparison_leaves_image_reference_and_difference() {
    let flat = |value: f32| Image::from_pixels(3, 2, vec![[value; 3]; 6]).unwrap();
    assert_images(true, &flat(0.25), &flat(1.0), "nothing is wrong");
    let failure = catch_unwind(|| assert_images(false, &flat(0.25), &flat(1.0), "too dark")).unwrap_err();
    let message = failure.downcast_ref::<String>().unwrap();
    assert!(message.starts_with("too dark\n"), "{message}");
    let folder = Path::new(message.rsplit_once(": ").unwrap().1);
    assert!(
        folder.ends_with("failed/failed_images.a_failed_comparison_leaves_image_reference_and_difference")
    );
    for (name, value) in [("image", 0.25), ("reference", 1.0), ("difference", 0.75)] {
        let left = image::read(&folder.join(name).with_extension("exr")).unwrap();
        assert_eq!(left.pixels(), flat(value).pixels(), "{name}");
        assert!(folder.join(name).with_extension("png").exists(), "{name}");
    }
    // Nothing failed.
    std::fs::remove_dir_all(folder).unwrap();
}
