//! Outputs appear whole or not at all, and what cannot be written is known before rendering starts.

use std::fs;
use std::path::{Path, PathBuf};

use lightmesh::image::{Image, ImageFormat, ImageOptions, OutputFile, OutputTarget};

/// A directory that is removed in the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lightmesh-output-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// Names of all files, hidden ones too.
    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn refusal(path: &Path) -> String {
    OutputTarget::new(path).unwrap_err().to_string()
}

#[test]
fn the_format_follows_the_extension_whatever_its_case() {
    let scratch = Scratch::new("format");
    let format = |name: &str| OutputTarget::new(&scratch.0.join(name)).unwrap().format();
    assert_eq!(format("a.exr"), ImageFormat::Exr);
    assert_eq!(format("a.b.PNG"), ImageFormat::Png);
    for wrong in ["a.jpg", "a", "exr", ".exr"] {
        let message = refusal(&scratch.0.join(wrong));
        assert!(message.contains(".exr or .png") && message.contains(wrong), "{message}");
    }
}

#[test]
fn checking_a_destination_leaves_no_trace() {
    let scratch = Scratch::new("check");
    OutputTarget::new(&scratch.0.join("a.exr")).unwrap();
    assert!(scratch.files().is_empty(), "{:?}", scratch.files());
    fs::write(scratch.0.join("old.png"), "old").unwrap();
    OutputTarget::new(&scratch.0.join("old.png")).unwrap();
    assert_eq!(fs::read(scratch.0.join("old.png")).unwrap(), b"old");
}

#[test]
fn impossible_destinations_are_refused_with_the_cause() {
    let scratch = Scratch::new("refuse");
    let missing = refusal(&scratch.0.join("nowhere/a.exr"));
    assert!(missing.contains("nowhere") && missing.contains("directory"), "{missing}");
    fs::create_dir(scratch.0.join("folder.exr")).unwrap();
    assert!(refusal(&scratch.0.join("folder.exr")).contains("is a directory"));
    fs::write(scratch.0.join("file"), "").unwrap();
    assert!(refusal(&scratch.0.join("file/a.exr")).contains("not a directory"));
    assert!(OutputFile::new(Path::new("/")).is_err());
    assert!(OutputFile::new(Path::new("")).is_err());
    #[cfg(target_os = "linux")]
    assert!(OutputFile::new(Path::new("/dev/null")).unwrap_err().to_string().contains("not a regular file"));
}

/// Permissions mean nothing to the superuser, so the check looks first whether they do here.
#[cfg(unix)]
#[test]
fn missing_write_permission_is_noticed_beforehand() {
    use std::os::unix::fs::PermissionsExt;
    let scratch = Scratch::new("permission");
    let file = scratch.0.join("protected.png");
    fs::write(&file, "old").unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o444)).unwrap();
    let locked = scratch.0.join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(locked.join("probe"), "").is_ok() {
        eprintln!("skipped: this user may write everywhere");
        return;
    }
    assert!(refusal(&file).contains("protected.png"));
    assert!(refusal(&locked.join("a.exr")).contains("a.exr"));
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn a_file_is_replaced_as_a_whole_and_nothing_else_is_left() {
    let scratch = Scratch::new("replace");
    let path = scratch.0.join("stats.json");
    fs::write(&path, "a longer text than the new one").unwrap();
    OutputFile::new(&path).unwrap().write(b"new").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    assert_eq!(scratch.files(), ["stats.json"]);
}

/// The destination becomes a directory after the check, so the last step, renaming, fails.
#[test]
fn a_failed_write_leaves_neither_file_nor_temporary() {
    let scratch = Scratch::new("fail");
    let path = scratch.0.join("a.png");
    let target = OutputTarget::new(&path).unwrap();
    fs::create_dir(&path).unwrap();
    fs::write(path.join("inside"), "").unwrap();
    let image = Image::new(4, 4).unwrap();
    let message = target.write(&image, &ImageOptions::default()).unwrap_err().to_string();
    assert!(message.contains("a.png"), "{message}");
    assert_eq!(scratch.files(), ["a.png"]);
    assert!(path.is_dir());
}

/// The same for a metadata key that the format cannot hold: the old picture stays.
#[test]
fn a_picture_that_cannot_be_encoded_leaves_the_old_file() {
    let scratch = Scratch::new("encode");
    let path = scratch.0.join("a.png");
    fs::write(&path, "old").unwrap();
    let options = ImageOptions { metadata: vec![("k".repeat(80), String::new())], ..ImageOptions::default() };
    assert!(OutputTarget::new(&path).unwrap().write(&Image::new(1, 1).unwrap(), &options).is_err());
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(scratch.files(), ["a.png"]);
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_stays_and_the_file_behind_it_is_replaced() {
    let scratch = Scratch::new("link");
    let (file, link) = (scratch.0.join("file.json"), scratch.0.join("link.json"));
    fs::write(&file, "old").unwrap();
    std::os::unix::fs::symlink(&file, &link).unwrap();
    OutputFile::new(&link).unwrap().write(b"new").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::read(&file).unwrap(), b"new");
}
