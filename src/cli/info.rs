//! `lightmesh info`: what a file holds.

use std::io::{self, Write};

use clap::Args;
use serde::Serialize;

use super::error::{CommandError, Outcome};
use super::image_info::ImageInfo;
use super::mesh_info::MeshInfo;
use super::shared::{QuietArgs, SceneArgs};
use crate::accel::{Footprint, MemoryEstimate};
use crate::scene::LightKind;
use crate::scene::load::OpenedScene;

/// What `info` takes.
#[derive(Args, Debug)]
pub struct InfoArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    quiet: QuietArgs,
}

#[derive(Serialize)]
struct Info {
    triangles: u64,
    unique_triangles: u64,
    meshes: usize,
    instances: usize,
    materials: usize,
    lights: Lights,
    cameras: Vec<String>,
    bounds: Option<[[f32; 3]; 2]>,
    memory_estimate_bytes: MemoryEstimate,
    skipped: Vec<(&'static str, u64)>,
    warnings: Vec<String>,
    chosen: Vec<String>,
}

#[derive(Default, Serialize)]
struct Lights {
    point: usize,
    ball: usize,
    spot: usize,
    directional: usize,
}

impl Info {
    fn new(opened: &OpenedScene) -> Self {
        let OpenedScene { loaded, choices, .. } = opened;
        let scene = &loaded.scene;
        let mut lights = Lights::default();
        for light in &scene.lights {
            match light.kind {
                LightKind::Point => lights.point += 1,
                LightKind::Ball { .. } => lights.ball += 1,
                LightKind::Spot { .. } => lights.spot += 1,
                LightKind::Directional { .. } => lights.directional += 1,
            }
        }
        let unique_triangles = scene.meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum();
        let bounds = scene.bounds();
        Self {
            triangles: scene.triangle_count(),
            unique_triangles,
            meshes: scene.meshes.len(),
            instances: scene.instances.len(),
            materials: scene.materials.len(),
            lights,
            cameras: loaded.cameras.iter().map(|camera| camera.name.clone()).collect(),
            bounds: (!bounds.is_empty()).then(|| [bounds.min.to_array(), bounds.max.to_array()]),
            memory_estimate_bytes: MemoryEstimate::of(scene),
            skipped: loaded.skipped.named().into_iter().filter(|(_, count)| *count > 0).collect(),
            warnings: loaded.warnings.iter().map(ToString::to_string).collect(),
            chosen: choices.clone(),
        }
    }

    fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        let mega = |bytes: u64| bytes as f64 / 1e6;
        writeln!(out, "triangles  {} ({} unique)", self.triangles, self.unique_triangles)?;
        writeln!(out, "meshes     {}, placed {} times", self.meshes, self.instances)?;
        writeln!(out, "materials  {}", self.materials)?;
        let Lights { point, ball, spot, directional } = self.lights;
        writeln!(out, "lights     {point} point, {ball} ball, {spot} spot, {directional} directional")?;
        writeln!(out, "cameras    {}", self.cameras.join(", "))?;
        if let Some([min, max]) = self.bounds {
            writeln!(out, "bounds     {min:?} to {max:?}")?;
        }
        let MemoryEstimate { scene, embree, bvh } = self.memory_estimate_bytes;
        let tree = |tree: Footprint| {
            format!("{:.1} MB ({:.1} while it is built)", mega(tree.built), mega(tree.building))
        };
        let (scene, embree, bvh) = (mega(scene), tree(embree), tree(bvh));
        writeln!(out, "memory     about {scene:.1} MB, and {embree} in Embree or {bvh} in the built-in BVH")?;
        for (name, count) in &self.skipped {
            writeln!(out, "left out   {count} {name}")?;
        }
        for warning in &self.warnings {
            writeln!(out, "warning    {warning}")?;
        }
        for choice in &self.chosen {
            writeln!(out, "note       {choice}")?;
        }
        Ok(())
    }
}

/// Prints what a file holds.
///
/// # Errors
/// See [`CommandError`].
pub fn run(args: &InfoArgs, out: &mut dyn Write) -> Result<Outcome, CommandError> {
    let path = &args.scene.path;
    if MeshInfo::is_for(path) {
        show(args, out, &MeshInfo::read(path)?, MeshInfo::print)
    } else if ImageInfo::is_for(path) {
        show(args, out, &ImageInfo::read(path)?, ImageInfo::print)
    } else {
        show(args, out, &Info::new(&args.scene.read(&args.quiet.reporter())?), Info::print)
    }
}

/// Prints what was found for people, or for programs.
fn show<T: Serialize>(
    args: &InfoArgs,
    out: &mut dyn Write,
    info: &T,
    print: impl Fn(&T, &mut dyn Write) -> io::Result<()>,
) -> Result<Outcome, CommandError> {
    if args.json {
        writeln!(out, "{}", serde_json::json!(info))?;
    } else {
        print(info, out)?;
    }
    Ok(Outcome::Passed)
}
