//! `lightmesh generate`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::error::{CommandError, Outcome};
use super::shared::QuietArgs;
use crate::scene::generate::forest::Forest;
use crate::scene::generate::interior::Interior;
use crate::scene::generate::still_life;

/// What `generate` takes.
#[derive(Args, Clone, Debug)]
pub struct GenerateArgs {
    /// What to generate.
    #[command(subcommand)]
    scene: GeneratedScene,
    #[command(flatten)]
    quiet: QuietArgs,
}

/// What can be generated.
#[derive(Subcommand, Clone, Debug)]
pub enum GeneratedScene {
    /// Trees with separate small leaves under point lights: forest.obj, forest.mtl and forest.toml
    Forest(ForestArgs),
    /// A hall with columns and benches under many lamps: interior.obj, interior.mtl and interior.toml
    Interior(InteriorArgs),
    /// Balls, boxes and columns before a wall: still-life.obj and still-life.mtl
    StillLife(StillLifeArgs),
}

/// Arguments of `lightmesh generate forest`.
#[derive(Args, Clone, Debug)]
pub struct ForestArgs {
    /// Number of triangles, exactly
    #[arg(long, value_name = "N", default_value_t = 23_542,
          value_parser = clap::value_parser!(u32).range(i64::from(Forest::TRIANGLES.0)..=i64::from(Forest::TRIANGLES.1)))]
    triangles: u32,
    /// Number of point lights
    #[arg(long, value_name = "N", default_value_t = 100,
          value_parser = clap::value_parser!(u32).range(i64::from(Forest::LIGHTS.0)..=i64::from(Forest::LIGHTS.1)))]
    lights: u32,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Folder to write into, created if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Arguments of `lightmesh generate interior`.
#[derive(Args, Clone, Debug)]
pub struct InteriorArgs {
    /// Number of pairs of columns along the hall
    #[arg(long, value_name = "N", default_value_t = 6,
          value_parser = clap::value_parser!(u32).range(i64::from(Interior::BAYS.0)..=i64::from(Interior::BAYS.1)))]
    bays: u32,
    /// Number of lamps per pair of columns
    #[arg(long, value_name = "N", default_value_t = 40,
          value_parser = clap::value_parser!(u32).range(i64::from(Interior::LAMPS.0)..=i64::from(Interior::LAMPS.1)))]
    lamps: u32,
    /// Folder to write into, created if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Arguments of `lightmesh generate still-life`.
#[derive(Args, Clone, Debug)]
pub struct StillLifeArgs {
    /// Folder to write into, created if need be
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Runs the subcommand.
///
/// # Errors
/// [`CommandError::Generate`]; then nothing is written.
pub fn run(args: &GenerateArgs) -> Result<Outcome, CommandError> {
    let reporter = args.quiet.reporter();
    let spinner = reporter.spinner("generating");
    let folder = match &args.scene {
        GeneratedScene::Forest(ForestArgs { triangles, lights, seed, output }) => {
            Forest { triangles: *triangles, lights: *lights, seed: *seed }.write(output)?;
            output
        }
        GeneratedScene::Interior(InteriorArgs { bays, lamps, output }) => {
            Interior { bays: *bays, lamps: *lamps }.write(output)?;
            output
        }
        GeneratedScene::StillLife(StillLifeArgs { output }) => {
            still_life::write(output)?;
            output
        }
    };
    spinner.finish_and_clear();
    reporter.detail(&format!("wrote into {}", folder.display()));
    Ok(Outcome::Passed)
}
