//! The cameras that a command looks through, and what the files of several pictures are called.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use clap::Args;

use super::error::CommandError;
use super::frames::path_in_frame;
use super::ready::camera_of;
use super::shared::SceneArgs;
use crate::image::output::{OutputFile, OutputTarget};
use crate::scene::Camera;

/// The word for all cameras.
const ALL: &str = "all";

/// What stands for a camera's name in names of files.
const PLACE: &str = "{camera}";

/// What takes the place of a name that is empty.
const NAMELESS: &str = "camera";

/// Which cameras a command looks through.
#[derive(Args, Clone, Debug, Default)]
pub struct CameraArgs {
    /// Camera to look through, by name; may be given several times; `all` for each that there is: names of files need a {camera} for several
    #[arg(long = "camera", value_name = "NAME")]
    pub names: Vec<String>,
}

/// A camera that a command looks through.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenCamera {
    /// Its number in the scene.
    pub index: usize,
    /// The camera where it stands in a still image.
    pub camera: Camera,
    /// Its name in names of files; `None` if no camera was named.
    pub file_name: Option<String>,
}

impl CameraArgs {
    /// The names that were given; `None` for all cameras.
    fn named(&self) -> Option<&[String]> {
        (!self.names.iter().any(|name| name == ALL)).then_some(&self.names)
    }

    /// Checks the cameras' names, and those of files: with several cameras each needs a place for their name.
    ///
    /// # Errors
    /// [`CommandError::CameraTwice`] and [`CommandError::CameraFileName`].
    pub fn check<'p>(&self, mut paths: impl Iterator<Item = &'p Path>) -> Result<(), CommandError> {
        let named = self.named();
        let mut seen = HashSet::new();
        if let Some(twice) = named.unwrap_or_default().iter().find(|name| !seen.insert(*name)) {
            return Err(CommandError::CameraTwice(twice.clone()));
        }
        let are_several = named.is_none_or(|names| names.len() > 1);
        let lacks = |path: &&Path| are_several && camera_path(path, NAMELESS).is_none();
        paths.find(lacks).map_or(Ok(()), |path| Err(CommandError::CameraFileName(path.to_owned())))
    }

    /// The first camera in names of files, as far as it is known before the scene is.
    pub fn first(&self) -> Option<String> {
        self.names.first().map(|name| file_name(name))
    }

    /// The cameras among those of a scene: the first one if none is named.
    ///
    /// # Errors
    /// [`CommandError::NoSuchCamera`], and [`CommandError::SameFileName`] if files of two cameras would have one name.
    pub fn choose(&self, scene: &SceneArgs, cameras: &[Camera]) -> Result<Vec<ChosenCamera>, CommandError> {
        let chosen: Vec<(usize, &Camera)> = match self.named() {
            None => cameras.iter().enumerate().collect(),
            Some([]) => vec![camera_of(scene, cameras, None)?],
            Some(names) => {
                names.iter().map(|name| camera_of(scene, cameras, Some(name))).collect::<Result<_, _>>()?
            }
        };
        let is_named = !self.names.is_empty();
        let of_camera = |&(index, camera): &(usize, &Camera)| ChosenCamera {
            index,
            camera: camera.clone(),
            file_name: is_named.then(|| file_name(&camera.name)),
        };
        let chosen: Vec<ChosenCamera> = chosen.iter().map(of_camera).collect();
        for (number, second) in chosen.iter().enumerate() {
            let same = chosen.iter().take(number).find(|first| first.file_name == second.file_name);
            if let (Some(first), Some(file_name)) = (same, &second.file_name) {
                return Err(CommandError::SameFileName {
                    scene: scene.path.clone(),
                    first: first.camera.name.clone(),
                    second: second.camera.name.clone(),
                    file_name: file_name.clone(),
                });
            }
        }
        Ok(chosen)
    }
}

/// Which of several pictures a file is of.
#[derive(Clone, Copy, Debug, Default)]
pub struct PictureName<'a> {
    /// The camera in names of files, if any was named.
    pub camera: Option<&'a str>,
    /// Number of the frame, if there are any.
    pub frame: Option<i64>,
}

impl PictureName<'_> {
    /// The name of a file of the picture; what has no place for frame or camera stays as it is.
    fn path(self, path: &Path) -> PathBuf {
        // The frame first: a camera's name may look like the place of a number.
        let path = path_in_frame(path, self.frame);
        self.camera.and_then(|camera| camera_path(&path, camera)).unwrap_or(path)
    }

    /// Its images, checked.
    ///
    /// # Errors
    /// [`CommandError::Image`].
    pub fn targets(self, outputs: &[PathBuf]) -> Result<Vec<OutputTarget>, CommandError> {
        let target = |path: &PathBuf| Ok(OutputTarget::new(&self.path(path))?);
        outputs.iter().map(target).collect()
    }

    /// A file of it that is no image, checked.
    ///
    /// # Errors
    /// [`CommandError::Image`].
    pub fn file(self, path: Option<&Path>) -> Result<Option<OutputFile>, CommandError> {
        path.map(|path| Ok(OutputFile::new(&self.path(path))?)).transpose()
    }
}

/// The name of a file of a camera; `None` without a place for it.
fn camera_path(path: &Path, camera: &str) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    name.contains(PLACE).then(|| path.with_file_name(name.replace(PLACE, camera)))
}

/// A camera's name in names of files: what no file system, or not every one, has in names is replaced by `_`.
fn file_name(name: &str) -> String {
    let allowed = |letter: char| {
        let is_special = matches!(letter, '/' | '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|');
        if is_special || letter.is_control() { '_' } else { letter }
    };
    if name.is_empty() { NAMELESS.to_owned() } else { name.chars().map(allowed).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn args(names: &[&str]) -> CameraArgs {
        CameraArgs { names: names.iter().map(|name| (*name).to_owned()).collect() }
    }

    fn cameras(names: &[&str]) -> Vec<Camera> {
        let camera = |name: &&str| Camera {
            name: (*name).to_owned(),
            position: Vec3::Z,
            look_at: Vec3::ZERO,
            up: Vec3::Y,
            vertical_fov: 45.0,
        };
        names.iter().map(camera).collect()
    }

    /// Frame and camera each take their place, whatever the camera is called; without them a name is a name.
    #[test]
    fn names_of_files_have_places_for_camera_and_frame() {
        let path = |camera, frame, name: &str| {
            PictureName { camera, frame }.path(Path::new(name)).display().to_string()
        };
        assert_eq!(path(Some("door"), None, "out/{camera}.exr"), "out/door.exr");
        assert_eq!(path(Some("a#b"), Some(7), "{camera}.####.exr"), "a#b.0007.exr");
        assert_eq!(path(Some("%d"), Some(7), "%02d_{camera}.exr"), "07_%d.exr");
        assert_eq!(path(Some("door"), None, "{camera}/a.exr"), "{camera}/a.exr");
        assert_eq!(path(None, None, "{camera}#.exr"), "{camera}#.exr");
    }

    /// A name must not lead to another folder, nor be one that some file system refuses.
    #[test]
    fn cameras_have_names_that_files_can_have() {
        assert_eq!(file_name("../a:b\\c\n"), ".._a_b_c_");
        assert_eq!(file_name("Kamera 1, außen"), "Kamera 1, außen");
        assert_eq!(file_name(""), "camera");
    }

    /// Pictures of two cameras in one file would leave only the last one.
    #[test]
    fn several_cameras_need_files_of_their_own() {
        let check = |names: &[&str], file: &str| args(names).check([Path::new(file)].into_iter());
        assert!(check(&[], "f.exr").is_ok() && check(&["a"], "f.exr").is_ok());
        assert!(check(&["a", "b"], "{camera}.exr").is_ok() && check(&["all"], "{camera}.exr").is_ok());
        for several in [&["a", "b"][..], &["all"]] {
            assert!(matches!(check(several, "f.exr"), Err(CommandError::CameraFileName(_))));
        }
        assert!(matches!(check(&["a", "a"], "{camera}.exr"), Err(CommandError::CameraTwice(_))));

        let scene = SceneArgs::default();
        let cameras = cameras(&["a:b", "a?b", "c"]);
        let chosen = args(&["c", "a:b"]).choose(&scene, &cameras).expect("two cameras");
        let indices: Vec<usize> = chosen.iter().map(|camera| camera.index).collect();
        assert_eq!(indices, [2, 0], "in the order of the command line");
        let same = args(&["all"]).choose(&scene, &cameras);
        assert!(matches!(same, Err(CommandError::SameFileName { .. })), "{same:?}");
        // Nobody asked for names.
        assert_eq!(args(&[]).choose(&scene, &cameras).expect("the first one")[0].file_name, None);
    }
}
