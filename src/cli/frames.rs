//! The frames of an animation: which ones, what their files are called, and the way from one to the next.

use std::path::{Path, PathBuf};

use clap::Args;

use super::error::CommandError;
use super::interrupt::Interrupt;
use super::progress::Reporter;
use crate::render::{Moved, RenderError, Session, SessionError};
use crate::scene::{Animation, Camera, Scene};
use crate::settings::Settings;

/// Frames that one command may name.
const MOST_FRAMES: usize = 1_000_000;

/// Which frames of an animation a command renders.
#[derive(Args, Clone, Debug, Default)]
pub struct FrameArgs {
    /// Frames to render: 1-48, every other one 1-48x2, some 1,7,20-30, or `all` of the animation; names of files need a #### for the number
    #[arg(long, value_name = "FRAMES", value_parser = frames, allow_hyphen_values = true)]
    pub frames: Option<Frames>,
}

/// Some frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Frames {
    /// From the first keyframe to the last.
    All,
    /// Those of these numbers, in this order.
    Numbers(Vec<i64>),
}

/// Reads frames: numbers and ranges a-b or a-bxstep, as Open Job Description has it a-b:step, separated by commas.
pub fn frames(text: &str) -> Result<Frames, String> {
    if text == "all" {
        return Ok(Frames::All);
    }
    let mut numbers = Vec::new();
    for part in text.split(',') {
        let (first, last, step) = range(part.trim())
            .ok_or_else(|| format!("`{part}` is neither a number nor a range such as 1-48 or 1-48x2"))?;
        if last < first {
            return Err(format!("`{part}` ends before it begins"));
        }
        if (last - first) / step >= (MOST_FRAMES - numbers.len()) as i64 {
            return Err(format!("more than {MOST_FRAMES} frames"));
        }
        numbers.extend((0..=(last - first) / step).map(|at| first + at * step));
    }
    let mut sorted = numbers.clone();
    sorted.sort_unstable();
    match sorted.iter().zip(sorted.iter().skip(1)).find(|(a, b)| a == b) {
        Some((twice, _)) => Err(format!("frame {twice} is named twice")),
        None => Ok(Frames::Numbers(numbers)),
    }
}

/// First frame, last frame and step of a part.
fn range(part: &str) -> Option<(i64, i64, i64)> {
    // Not for arithmetic that could overflow.
    let number = |text: &str| text.parse::<i32>().ok().map(i64::from);
    if let Some(only) = number(part) {
        return Some((only, only, 1));
    }
    // A minus may stand in front of either number.
    let dash = part.char_indices().skip(1).find(|(_, letter)| *letter == '-')?.0;
    let (first, rest) = (part.get(..dash)?, part.get(dash + 1..)?);
    let (last, step) = rest.split_once(['x', ':']).unwrap_or((rest, "1"));
    Some((number(first)?, number(last)?, number(step).filter(|&step| step > 0)?))
}

impl FrameArgs {
    /// The frames to render; `None` for a still image.
    ///
    /// # Errors
    /// [`CommandError::NoFrames`] for all frames of a scene in which nothing moves.
    pub fn numbers(&self, animation: &Animation, scene: &Path) -> Result<Option<Vec<i64>>, CommandError> {
        match &self.frames {
            None => Ok(None),
            Some(Frames::Numbers(numbers)) => Ok(Some(numbers.clone())),
            Some(Frames::All) => {
                let no_frames = || CommandError::NoFrames { scene: scene.to_owned() };
                let (first, last) = animation.range().ok_or_else(no_frames)?;
                let count = last.saturating_sub(first).saturating_add(1);
                if count > MOST_FRAMES as i64 {
                    return Err(CommandError::TooManyFrames { scene: scene.to_owned(), count });
                }
                Ok(Some((first..=last).collect()))
            }
        }
    }

    /// The first frame, as far as it is known before the scene is; 0 for all of an animation.
    pub fn first(&self) -> Option<i64> {
        self.frames.as_ref().map(|frames| match frames {
            Frames::All => 0,
            Frames::Numbers(numbers) => numbers.first().copied().unwrap_or_default(),
        })
    }

    /// Whether there may be several frames, whose files then need names of their own.
    fn are_several(&self) -> bool {
        match &self.frames {
            None => false,
            Some(Frames::All) => true,
            Some(Frames::Numbers(numbers)) => numbers.len() > 1,
        }
    }

    /// Checks the names of files: with several frames each needs a place for the number.
    ///
    /// # Errors
    /// [`CommandError::FrameName`].
    pub fn check<'p>(&self, mut paths: impl Iterator<Item = &'p Path>) -> Result<(), CommandError> {
        let lacks = |path: &&Path| self.are_several() && frame_path(path, 0).is_none();
        paths.find(lacks).map_or(Ok(()), |path| Err(CommandError::FrameName(path.to_owned())))
    }

    /// Makes a scene ready for all frames of its animation, before anything is built from it.
    pub fn prepare(&self, scene: &mut Scene, animation: &Animation, reporter: &Reporter) {
        if self.frames.is_none() {
            return;
        }
        scene.extent = animation.extent(scene);
        animation.notes().iter().for_each(|note| reporter.line(&format!("note: {note}")));
        if animation.is_empty() {
            reporter.line("note: nothing moves in this scene");
        }
    }
}

/// Moves a session to a frame, says what was kept, and returns the camera as it is there; without a frame nothing moves.
///
/// # Errors
/// See [`SessionError`].
pub fn move_to(
    session: &mut Session,
    animation: &Animation,
    number: Option<i64>,
    camera: (usize, &Camera),
    reporter: &Reporter,
) -> Result<Camera, SessionError> {
    let (index, still) = camera;
    let Some(number) = number else { return Ok(still.clone()) };
    let frame = animation.frame(number);
    let moved = session.move_to(&frame)?;
    reporter.line(&format!("frame {number}: {}", in_words(&moved)));
    Ok(frame.camera(index, still))
}

/// Frames by which a light mesh is chosen for all of an animation: from one to the next the error of one mesh differs by half of it.
const SETTLED_BY: i64 = 8;

/// Chooses once for all frames what the settings leave open of averaged shadows: by frames all over the animation, whichever of them are rendered, so that each
/// frame is the same alone and among others. Returns the shadow rays that took.
///
/// # Errors
/// See [`CommandError`].
pub fn settle(
    session: &mut Session,
    animation: &Animation,
    (index, still): (usize, &Camera),
    settings: &Settings,
    scene: &Path,
    reporter: &Reporter,
) -> Result<u64, CommandError> {
    session.unsettle();
    let Some((first, last)) = animation.range() else { return Ok(0) };
    let interrupt = Interrupt::catch().map_err(CommandError::Signals)?;
    let at = |part: i64| first + (last - first) * (2 * part + 1) / (2 * SETTLED_BY);
    let mut numbers: Vec<i64> = (0..SETTLED_BY).map(at).collect();
    numbers.dedup();
    let mut rays = 0;
    for &number in &numbers {
        let frame = animation.frame(number);
        let moved = session.move_to(&frame);
        moved.map_err(|source| CommandError::Session { scene: scene.to_owned(), source })?;
        let settled = session.settle(&frame.camera(index, still), settings, &interrupt.stop);
        rays += match (settled, interrupt.exit_code()) {
            (Ok(stats), _) => stats.rays.shadow,
            (Err(RenderError::Stopped), Some(exit_code)) => {
                return Err(CommandError::Interrupted { exit_code, kept: "nothing was kept".to_owned() });
            }
            (Err(source), _) => return Err(CommandError::Render { scene: scene.to_owned(), source }),
        };
    }
    if rays > 0 {
        let numbers: Vec<String> = numbers.iter().map(i64::to_string).collect();
        reporter.line(&format!(
            "note: one light mesh for all frames, chosen by frames {} with {rays} shadow rays",
            numbers.join(", ")
        ));
    }
    Ok(rays)
}

fn in_words(moved: &Moved) -> String {
    let Moved { instances, lights, known } = moved;
    let points = known.points_kept + known.points_changed;
    let kept = if points == 0 {
        "nothing is known yet".to_owned()
    } else if known.bits_forgotten == 0 {
        format!("kept: all that {points} mesh points see of lights")
    } else {
        let share = 100.0 * known.bits_kept as f64 / (known.bits_kept + known.bits_forgotten) as f64;
        format!(
            "kept: {share:.1} % of what mesh points see of lights, all at {} of {points}",
            known.points_kept
        )
    };
    if *instances == 0 && *lights == 0 {
        return kept;
    }
    format!("moved: {}, {}; {kept}", counted(*instances, "instance"), counted(*lights, "light"))
}

fn counted(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// The name of a file in a frame; without a frame, or a place for its number, it is as given.
pub fn path_in_frame(path: &Path, number: Option<i64>) -> PathBuf {
    number.and_then(|number| frame_path(path, number)).unwrap_or_else(|| path.to_owned())
}

/// The name of a file in a frame: the number in place of #### in the file's name, with as many digits at least, or of %04d as in C; `None` without
/// such a place, or with several.
fn frame_path(path: &Path, number: i64) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let (before, digits, after) = place(name)?;
    if place(before).is_some() || place(after).is_some() {
        return None;
    }
    let sign = if number < 0 { "-" } else { "" };
    let digits = digits.saturating_sub(sign.len());
    let number = number.unsigned_abs();
    Some(path.with_file_name(format!("{before}{sign}{number:0digits$}{after}")))
}

/// What comes before the place of the number, how many digits it has, and what comes after it.
fn place(name: &str) -> Option<(&str, usize, &str)> {
    if let Some(begin) = name.find('#') {
        let rest = name.get(begin..)?;
        let after = rest.trim_start_matches('#');
        return Some((name.get(..begin)?, rest.len() - after.len(), after));
    }
    for (begin, _) in name.match_indices('%') {
        let (before, rest) = (name.get(..begin)?, name.get(begin + 1..)?);
        let width = rest.trim_start_matches(|letter: char| letter.is_ascii_digit());
        let digits = rest.get(..rest.len() - width.len())?;
        if let Some(after) = width.strip_prefix('d')
            && (digits.is_empty() || digits.starts_with('0'))
        {
            let digits = if digits.is_empty() { Some(1) } else { digits.parse().ok() };
            return Some((before, digits.filter(|&digits: &usize| digits <= 20)?, after));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(text: &str) -> Vec<i64> {
        match frames(text) {
            Ok(Frames::Numbers(numbers)) => numbers,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn frames_are_numbers_ranges_and_lists() {
        assert_eq!(frames("all"), Ok(Frames::All));
        assert_eq!(numbers("7"), [7]);
        assert_eq!(numbers("1-4"), [1, 2, 3, 4]);
        assert_eq!(numbers("1-8x3"), [1, 4, 7]);
        assert_eq!(numbers("1-8:3"), [1, 4, 7]);
        assert_eq!(numbers("9, 1-2,20-30x10"), [9, 1, 2, 20, 30]);
        assert_eq!(numbers("-3--1"), [-3, -2, -1]);
        assert_eq!(numbers("-1-1"), [-1, 0, 1]);
        assert_eq!(numbers("5-5"), [5]);
    }

    /// What is no range, runs backwards, is named twice or would never end is refused, and the message says which part it is.
    #[test]
    fn what_names_no_frames_is_refused() {
        for (wrong, part) in [
            ("", "``"),
            ("1-", "`1-`"),
            ("a", "`a`"),
            ("1,,2", "``"),
            ("1-4x0", "`1-4x0`"),
            ("1-4x-1", "`1-4x-1`"),
            ("1-2-3", "`1-2-3`"),
            ("1.5", "`1.5`"),
            ("99999999999", "`99999999999`"),
            ("8-1", "`8-1` ends before"),
            ("1-5,4", "frame 4 is named twice"),
            ("1-2000000", "more than"),
            ("-2000000000-2000000000", "more than"),
        ] {
            let error = frames(wrong).expect_err(wrong);
            assert!(error.contains(part), "{wrong}: {error}");
        }
    }

    #[test]
    fn numbers_take_the_place_that_the_name_has_for_them() {
        let path =
            |name: &str, number| frame_path(Path::new(name), number).map(|path| path.display().to_string());
        for (name, number, expected) in [
            ("out/f.####.exr", 7, "out/f.0007.exr"),
            ("f.#.exr", 123, "f.123.exr"),
            ("f##.png", 12345, "f12345.png"),
            ("####.png", -7, "-007.png"),
            ("f_%04d.exr", 7, "f_0007.exr"),
            ("f_%d.exr", 7, "f_7.exr"),
            ("100%_%03d.exr", 7, "100%_007.exr"),
            ("##/f#.exr", 7, "##/f7.exr"),
        ] {
            assert_eq!(path(name, number).as_deref(), Some(expected));
        }
        for wrong in
            ["f.exr", "##/f.exr", "f#_#.exr", "#%d.exr", "%d%d.exr", "f%4d.exr", "%099d.exr", "f%x.exr"]
        {
            assert_eq!(path(wrong, 7), None, "{wrong}");
        }
    }

    /// Several frames in one file would leave only the last one.
    #[test]
    fn several_frames_need_names_of_their_own() {
        let check = |frames_text: &str, name: &str| {
            let args = FrameArgs { frames: Some(frames(frames_text).expect("frames")) };
            args.check([Path::new(name)].into_iter())
        };
        assert!(check("1-2", "f.####.exr").is_ok() && check("3", "f.exr").is_ok());
        for several in ["1-2", "all"] {
            assert!(matches!(check(several, "f.exr"), Err(CommandError::FrameName(_))));
        }
        // Without frames a name is a name.
        let (still, name) = (FrameArgs::default(), Path::new("f#.exr"));
        assert!(still.check([name].into_iter()).is_ok());
        assert_eq!(path_in_frame(name, None), name);
    }
}
