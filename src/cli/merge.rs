//! `lightmesh merge`: parts of an image to the whole.

use std::path::PathBuf;

use clap::Args;

use super::error::{CommandError, Outcome};
use super::shared::QuietArgs;
use crate::image::exr::{MergeError, decode_channels, encode_channels, merge};
use crate::image::{DecodeError, ImageError, OutputFile};

/// Attributes that are the same in all parts of a picture.
const IDENTITY: [&str; 3] = ["Software", "lightmesh:scene", "lightmesh:settings"];

/// What `merge` takes.
#[derive(Args, Debug)]
pub struct MergeArgs {
    /// Parts of one image that `render --tile` or `render --crop` wrote (.exr)
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,
    /// Image to write (.exr)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    quiet: QuietArgs,
}

/// Puts the parts together.
///
/// # Errors
/// See [`CommandError`]; then the file is as it was.
pub fn run(args: &MergeArgs) -> Result<Outcome, CommandError> {
    if args.output.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("exr")) {
        let cause = "the name of a merged image ends in .exr".to_owned();
        return Err(ImageError::Write { path: args.output.clone(), cause }.into());
    }
    let target = OutputFile::new(&args.output)?;
    let read = |path: &PathBuf| {
        let bytes =
            std::fs::read(path).map_err(|source| CommandError::Read { file: path.clone(), source })?;
        let contents = |source: DecodeError| ImageError::Contents { path: path.clone(), source };
        Ok(decode_channels(&bytes).map_err(contents)?)
    };
    let parts = args.parts.iter().map(read).collect::<Result<Vec<_>, CommandError>>()?;
    let whole = merge(&parts, &IDENTITY).map_err(|source| {
        let part = match source {
            MergeError::Different { part, .. } | MergeError::Disagree { part, .. } => args.parts.get(part),
            MergeError::Missing { .. } | MergeError::Empty => None,
        };
        CommandError::Merge { file: part.unwrap_or(&args.output).clone(), source }
    })?;
    let refuse =
        |error: exr::error::Error| ImageError::Encode { path: args.output.clone(), cause: error.to_string() };
    let (width, height) = whole.display;
    target.write(&encode_channels(whole).map_err(refuse)?)?;
    args.quiet.reporter().line(&format!(
        "{}: {width}×{height} of {} parts",
        args.output.display(),
        parts.len()
    ));
    Ok(Outcome::Passed)
}
