//! `compare` says how far two pictures are apart, in numbers that scripts can rely on.

use std::path::{Path, PathBuf};

use clap::Parser;
use lightmesh::cli::compare::{CompareArgs, run};
use lightmesh::cli::{CommandError, Outcome as Verdict, describe};
use lightmesh::image::{Image, ImageOptions, OutputTarget, exr::SampleType};

/// The command line, without the program's own part.
#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: CompareArgs,
}

/// A directory that is removed in the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lightmesh-compare-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn save(&self, name: &str, width: u32, pixels: &[[f32; 3]]) -> PathBuf {
        let path = self.0.join(name);
        let height = pixels.len() as u32 / width;
        let image = Image::from_pixels(width, height, pixels.to_vec()).unwrap();
        let options = ImageOptions { sample_type: SampleType::Float, ..ImageOptions::default() };
        OutputTarget::new(&path).unwrap().write(&image, &options).unwrap();
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn compare(a: &Path, b: &Path, flags: &[&str]) -> (Result<Verdict, CommandError>, String) {
    let paths = [Path::new("compare"), a, b].map(|path| path.to_str().unwrap().to_owned());
    let line = paths.into_iter().chain(flags.iter().map(|flag| (*flag).to_owned()));
    let mut out = Vec::new();
    let verdict = run(&Line::try_parse_from(line).unwrap().args, &mut out);
    (verdict, String::from_utf8(out).unwrap())
}

fn json(a: &Path, b: &Path, flags: &[&str]) -> serde_json::Value {
    let flags: Vec<&str> = flags.iter().copied().chain(["--json"]).collect();
    let (verdict, out) = compare(a, b, &flags);
    verdict.unwrap();
    serde_json::from_str(&out).unwrap()
}

/// One of six samples is 0.5 off: rmse = 0.5/√6; the reference's mean is 1, so relative_rmse is the same; relative
/// errors per pixel are 1/6 and 0.
#[test]
fn json_has_the_documented_keys_with_the_right_numbers() {
    let scratch = Scratch::new("keys");
    let reference = scratch.save("b.exr", 2, &[[1.0; 3]; 2]);
    let picture = scratch.save("a.exr", 2, &[[1.0; 3], [1.0, 0.5, 1.0]]);
    let result = json(&picture, &reference, &[]);
    let number = |key: &str| result[key].as_f64().unwrap_or_else(|| panic!("{key} in {result}"));
    let rmse = 0.5 / 6.0_f64.sqrt();
    for (key, expected) in
        [("rmse", rmse), ("relative_rmse", rmse), ("mean_relative_error", 1.0 / 12.0), ("max_abs", 0.5)]
    {
        assert!((number(key) - expected).abs() < 1e-9, "{key} {} is not {expected}", number(key));
    }
    assert_eq!(result["max_abs_pixel"], serde_json::json!([1, 0]));
    assert_eq!(result["differing_pixels"], 1);
    assert!(number("psnr") > 0.0);
    if cfg!(feature = "flip") {
        assert!(number("flip") > 0.0);
    } else {
        assert!(result["flip"].is_null());
    }
}

#[test]
fn equal_pictures_pass_every_limit_and_their_psnr_is_null() {
    let scratch = Scratch::new("equal");
    let picture = scratch.save("a.exr", 3, &[[0.25, 0.5, 1.0]; 9]);
    let result = json(&picture, &picture, &[]);
    assert!(result["psnr"].is_null());
    assert_eq!(result["differing_pixels"], 0);
    let (verdict, _) = compare(&picture, &picture, &["--fail-above", "0", "--fail-above", "max-abs=0"]);
    assert_eq!(verdict.unwrap(), Verdict::Passed);
}

/// As above: relative_rmse is 0.204.
#[test]
fn a_number_above_its_limit_fails_and_names_the_number() {
    let scratch = Scratch::new("limit");
    let reference = scratch.save("b.exr", 2, &[[1.0; 3]; 2]);
    let picture = scratch.save("a.exr", 2, &[[1.0; 3], [1.0, 0.5, 1.0]]);
    let verdict = |limit: &str| compare(&picture, &reference, &["--fail-above", limit]).0.unwrap();
    assert_eq!(verdict("0.21"), Verdict::Passed);
    assert_eq!(verdict("0.20"), Verdict::Failed);
    assert_eq!(verdict("relative_rmse=0.20"), Verdict::Failed);
    assert_eq!(verdict("differing-pixels=1"), Verdict::Passed);
    assert_eq!(verdict("max_abs=0.4"), Verdict::Failed);
    let (_, out) = compare(&picture, &reference, &["--fail-above", "max_abs=0.4"]);
    assert!(out.contains("max_abs is not within 0.4"), "{out}");
    for wrong in ["psnr=3", "nonsense=1", "-1", "rmse=NaN", "rmse="] {
        assert!(
            Line::try_parse_from(["compare", "a", "b", &format!("--fail-above={wrong}")]).is_err(),
            "{wrong}"
        );
    }
}

/// A picture with a NaN must never pass for right because the NaN was left out of the means.
#[test]
fn a_pixel_that_is_not_finite_fails_the_comparison() {
    let scratch = Scratch::new("nan");
    let reference = scratch.save("b.exr", 2, &[[1.0; 3]; 2]);
    let picture = scratch.save("a.exr", 2, &[[1.0; 3], [1.0, f32::NAN, 1.0]]);
    let (verdict, out) = compare(&picture, &reference, &["--json"]);
    assert_eq!(verdict.unwrap(), Verdict::Failed);
    let result: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&result["non_finite_pixels"], &result["rmse"]), (&1.into(), &0.0.into()));
}

#[test]
fn the_error_image_is_a_png_with_one_colour_per_pixel() {
    let scratch = Scratch::new("picture");
    let reference = scratch.save("b.exr", 2, &[[1.0; 3]; 4]);
    let picture = scratch.save("a.exr", 2, &[[1.0; 3], [1.0; 3], [1.0; 3], [2.0; 3]]);
    let target = scratch.0.join("error.png");
    json(&picture, &reference, &["--error-image", target.to_str().unwrap()]);
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&target).unwrap()))
        .read_info()
        .unwrap();
    assert_eq!(reader.info().size(), (2, 2));
    let mut codes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut codes).unwrap();
    let bright = |pixel: &[u8]| pixel.iter().all(|&code| code > 150);
    let pixels: Vec<bool> = codes.chunks_exact(3).map(bright).collect();
    assert_eq!(pixels, [false, false, false, true]);
}

#[test]
fn what_cannot_be_compared_is_an_error_that_names_the_file() {
    let scratch = Scratch::new("errors");
    let picture = scratch.save("a.exr", 2, &[[1.0; 3]; 2]);
    let tall = scratch.save("tall.exr", 1, &[[1.0; 3]; 2]);
    let text = scratch.0.join("text.exr");
    std::fs::write(&text, "no picture").unwrap();
    for (other, word) in [
        (tall, "2x1"),
        (text, "text.exr: not an image"),
        (scratch.0.join("missing.exr"), "missing.exr"),
        (scratch.0.clone(), "cannot read"),
    ] {
        let (verdict, out) = compare(&picture, &other, &[]);
        let message = describe(&verdict.unwrap_err());
        assert!(message.contains(word), "{message}");
        assert_eq!(out, "");
    }
    let (verdict, _) = compare(&picture, &picture, &["--error-image", "error.exr"]);
    assert!(verdict.is_err());
    assert!(!Path::new("error.exr").exists());
}

/// A PNG holds 8-bit codes: values come back within half a code, at most 0.0046 of the light near white.
#[test]
fn a_png_can_be_compared_with_the_exr_it_was_made_from() {
    let scratch = Scratch::new("png");
    let pixels: Vec<[f32; 3]> = (0..64).map(|i| [i as f32 / 63.0; 3]).collect();
    let (exr, png) = (scratch.save("a.exr", 8, &pixels), scratch.save("a.png", 8, &pixels));
    let result = json(&png, &exr, &[]);
    assert!(result["max_abs"].as_f64().unwrap() < 0.0046, "{result}");
    assert_eq!(result["differing_pixels"].as_u64().map(|count| count > 0), Some(true));
    if cfg!(feature = "flip") {
        assert_eq!(result["flip"], 0.0, "the same 8-bit codes look the same");
    }
}
