//! `lightmesh compare`: how far an image is from a reference.

use std::io::Write;
use std::path::PathBuf;
use std::str::FromStr;

use serde_json::{Map, Value, json};

use super::error::{CommandError, Outcome};
use super::parse::{self, non_negative, positive};
use super::shared::QuietArgs;
use crate::image::error_image::error_image;
use crate::image::metrics::{self, Metrics, MetricsOptions};
use crate::image::{self, Image, ImageError, ImageFormat, OutputTarget, png};
use crate::suggestion::hint;

/// What `compare` takes.
///
/// Both images may be EXR or PNG. Prints one line per number, or JSON. Ends with 0, or with 1 if a number is above a
/// limit, a pixel is not finite, or something failed.
#[derive(Clone, Debug, clap::Args)]
pub struct CompareArgs {
    /// The image
    #[arg(value_name = "A")]
    image: PathBuf,

    /// The reference
    #[arg(value_name = "B")]
    reference: PathBuf,

    /// Write a PNG of the errors in false colours: black for none, light yellow for full scale, green for pixels
    /// that are not finite
    #[arg(long, alias = "error-picture", value_name = "F.png")]
    error_image: Option<PathBuf>,

    /// Error at full scale of the error image, as a share of the reference's mean
    #[arg(long, value_name = "SHARE", default_value_t = 0.25, value_parser = positive::<f64>)]
    error_scale: f64,

    /// Fail if a number is above a limit: a number for relative_rmse, or METRIC=NUMBER with rmse, relative_rmse,
    /// mean_relative_error, block_mean_relative_error, flip, max_abs or differing_pixels; may be repeated
    #[arg(long, value_name = "[METRIC=]NUMBER")]
    fail_above: Vec<Limit>,

    /// Count a pixel as differing only if a channel differs by more than this share of the reference's mean
    /// [default: any bit]
    #[arg(long, value_name = "SHARE", value_parser = non_negative::<f64>)]
    differ_above: Option<f64>,

    /// Exposure in stops of the tone mapping before PSNR and FLIP
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse::exposure)]
    exposure: f32,

    /// Print JSON; numbers that are not defined, such as the PSNR of equal images, are null
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    quiet: QuietArgs,
}

/// A number whose exceeding fails the comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Limit {
    metric: Metric,
    limit: f64,
}

/// The numbers that are the worse the larger they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Metric {
    Rmse,
    RelativeRmse,
    MeanRelativeError,
    BlockMeanRelativeError,
    Flip,
    MaxAbs,
    DifferingPixels,
}

impl Metric {
    const ALL: [Self; 7] = [
        Self::Rmse,
        Self::RelativeRmse,
        Self::MeanRelativeError,
        Self::BlockMeanRelativeError,
        Self::Flip,
        Self::MaxAbs,
        Self::DifferingPixels,
    ];

    /// The name in JSON and on the command line.
    fn name(self) -> &'static str {
        match self {
            Self::Rmse => "rmse",
            Self::RelativeRmse => "relative_rmse",
            Self::MeanRelativeError => "mean_relative_error",
            Self::BlockMeanRelativeError => "block_mean_relative_error",
            Self::Flip => "flip",
            Self::MaxAbs => "max_abs",
            Self::DifferingPixels => "differing_pixels",
        }
    }

    fn of(self, metrics: &Metrics) -> Option<f64> {
        match self {
            Self::Rmse => metrics.rmse,
            Self::RelativeRmse => metrics.relative_rmse,
            Self::MeanRelativeError => metrics.mean_relative_error,
            Self::BlockMeanRelativeError => metrics.block_mean_relative_error,
            Self::Flip => metrics.flip,
            Self::MaxAbs => metrics.max.map(|max| max.value),
            Self::DifferingPixels => Some(metrics.differing_pixels as f64),
        }
    }
}

impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, number) = text.split_once('=').unwrap_or((Metric::RelativeRmse.name(), text));
        let name = name.trim().replace('-', "_");
        let metric = Metric::ALL.into_iter().find(|metric| metric.name() == name).ok_or_else(|| {
            let names = Metric::ALL.map(Metric::name);
            format!("no metric {name}{}; there are {}", hint(&name, names), names.join(", "))
        })?;
        Ok(Self { metric, limit: non_negative(number.trim())? })
    }
}

/// Compares two images and prints the result to `out`.
///
/// # Errors
///
/// If a file cannot be read or written, or the images differ in size; then nothing is printed.
pub fn run(args: &CompareArgs, out: &mut dyn Write) -> Result<Outcome, CommandError> {
    let error_target = match &args.error_image {
        Some(path) => {
            let target = OutputTarget::new(path)?;
            if target.format() != ImageFormat::Png {
                return Err(CommandError::ErrorImageFormat(path.clone()));
            }
            Some(target)
        }
        None => None,
    };
    let reporter = args.quiet.reporter();
    let spinner = reporter.spinner("reading");
    let image = image::read(&args.image)?;
    let reference = image::read(&args.reference)?;
    spinner.finish_and_clear();
    let incomparable = |source| CommandError::Incomparable {
        image: args.image.clone(),
        reference: args.reference.clone(),
        source,
    };
    let options = MetricsOptions { exposure: args.exposure, threshold: args.differ_above };
    let spinner = reporter.spinner("comparing");
    let metrics = metrics::compare(&image, &reference, options).map_err(incomparable)?;
    spinner.finish_and_clear();

    if let Some(target) = error_target {
        let colours = error_image(&image, &reference, args.error_scale).map_err(incomparable)?;
        let scale =
            format!("mean of |A - B| over the channels; magma from 0 to {} of B's mean", args.error_scale);
        let metadata = [("Description".to_owned(), scale)];
        let bytes =
            png::encode_rgb8(image.width(), image.height(), &colours, &metadata).map_err(|error| {
                ImageError::Encode { path: target.path().to_path_buf(), cause: error.to_string() }
            })?;
        target.file().write(&bytes)?;
    }

    let exceeded: Vec<&Limit> = args.fail_above.iter().filter(|limit| limit.exceeded_by(&metrics)).collect();
    let not_finite = metrics.non_finite_pixels + metrics.reference_non_finite_pixels;
    let outcome = Outcome::of(exceeded.is_empty() && not_finite == 0);

    let fields = fields(&image, &metrics);
    if args.json {
        let object: Map<String, Value> =
            fields.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        writeln!(out, "{:#}", Value::Object(object))?;
    } else {
        for (name, value) in &fields {
            let value = if value.is_null() { "undefined".to_owned() } else { value.to_string() };
            writeln!(out, "{name:<28} {value}")?;
        }
        for Limit { metric, limit } in exceeded {
            writeln!(out, "{} is not within {limit}", metric.name())?;
        }
        if not_finite > 0 {
            writeln!(out, "pixels that are not finite were left out of the numbers above")?;
        }
    }
    Ok(outcome)
}

impl Limit {
    /// Whether the number is above the limit; one that is not defined cannot be said to be within.
    fn exceeded_by(&self, metrics: &Metrics) -> bool {
        self.metric.of(metrics).is_none_or(|value| value > self.limit)
    }
}

/// What is printed, by name.
fn fields(image: &Image, metrics: &Metrics) -> Vec<(&'static str, Value)> {
    let max = metrics.max;
    let number = |metric: Metric| (metric.name(), json!(metric.of(metrics)));
    vec![
        number(Metric::Rmse),
        number(Metric::RelativeRmse),
        number(Metric::MeanRelativeError),
        number(Metric::BlockMeanRelativeError),
        ("psnr", json!(metrics.psnr)),
        number(Metric::Flip),
        number(Metric::MaxAbs),
        ("max_abs_pixel", json!(max.map(|max| [max.pixel.0, max.pixel.1]))),
        ("max_abs_channel", json!(max.and_then(|max| ["R", "G", "B"].get(max.channel)))),
        (Metric::DifferingPixels.name(), json!(metrics.differing_pixels)),
        ("non_finite_pixels", json!(metrics.non_finite_pixels)),
        ("reference_non_finite_pixels", json!(metrics.reference_non_finite_pixels)),
        ("mean", json!(metrics.mean)),
        ("reference_mean", json!(metrics.reference_mean)),
        ("width", json!(image.width())),
        ("height", json!(image.height())),
    ]
}
