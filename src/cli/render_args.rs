//! The flags of `lightmesh render`.

use std::path::PathBuf;

use clap::Args;

use super::cameras::CameraArgs;
use super::frames::FrameArgs;
use super::layers::LayerArgs;
use super::light_mesh::LightMeshArgs;
use super::overrides::Overrides;
use super::region::RegionArgs;
use super::shared::{BackendArgs, MemoryArgs, QuietArgs, SceneArgs, ThreadArgs};

/// What `render` takes. Flags override the scene file.
#[derive(Debug, Default, Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Image to write, .exr or .png; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// Write what was counted and measured as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    #[command(flatten)]
    pub quiet: QuietArgs,
    #[command(flatten)]
    pub backend: BackendArgs,
    #[command(flatten)]
    pub memory: MemoryArgs,
    #[command(flatten)]
    pub threads: ThreadArgs,
    /// Store EXR files as 32-bit float instead of 16-bit half
    #[arg(long)]
    pub float: bool,
    #[command(flatten)]
    pub cameras: CameraArgs,
    /// Write the images after every step, not only after the last one
    #[arg(long)]
    pub write_partial: bool,
    /// Go on where an interrupted render of the same image ended, and leave an image alone that is finished
    #[arg(long)]
    pub resume: bool,
    #[command(flatten)]
    pub frames: FrameArgs,
    #[command(flatten)]
    pub region: RegionArgs,
    #[command(flatten)]
    pub light_mesh: LightMeshArgs,
    /// Show the image in the viewer tev while it is rendered; tev listens at port 14158
    #[arg(long, value_name = "HOST:PORT")]
    pub display_server: Option<String>,
    #[command(flatten)]
    pub layers: LayerArgs,
    #[command(flatten)]
    pub overrides: Overrides,
}
