//! What the camera rays of a tile meet first, and what of their radiance came by a mirror: recorded while paths are traced, where layers
//! are asked for.

use glam::Vec3;

use crate::scene::{CameraRays, Hit, Interaction, Scene};

/// The first hits of a tile's camera rays, by pixel.
#[derive(Default)]
pub struct FirstHits {
    eye: Vec3,
    forward: Vec3,
    /// By pixel.
    pub(super) pixels: Vec<FirstHit>,
    /// What samples hit, in the order in which they were traced.
    pub(super) ids: Vec<IdSamples>,
    /// Radiance without light and without mirrors, summed over the samples: of emission and background.
    pub(super) emission: Vec<Vec3>,
    /// The same of what was seen by way of mirrors.
    pub(super) reflected: Vec<Vec3>,
    /// Number of the vertices that were not seen by way of mirrors: the first ones.
    pub(super) vertices: usize,
}

/// The first hits of one pixel.
#[derive(Clone, Copy)]
pub(super) struct FirstHit {
    /// Samples, whether they hit something or not.
    pub samples: u32,
    /// k_d + k_s, summed over the samples.
    pub albedo: Vec3,
    /// Shading normals, summed over the samples.
    pub normal: Vec3,
    /// Of the nearest sample, along the view direction; infinite if none hit anything.
    pub depth: f32,
    /// Its position.
    pub position: Vec3,
}

/// Samples of a pixel that hit the same.
pub(super) struct IdSamples {
    pub pixel: u32,
    pub instance: u32,
    pub material: u32,
    pub samples: u32,
}

impl FirstHit {
    const NONE: Self = Self {
        samples: 0,
        albedo: Vec3::ZERO,
        normal: Vec3::ZERO,
        depth: f32::INFINITY,
        position: Vec3::ZERO,
    };
}

impl FirstHits {
    /// Forgets everything, for another tile of so many pixels.
    pub fn start(&mut self, camera: &CameraRays, pixels: usize) {
        (self.eye, self.forward) = (camera.origin(), camera.forward());
        self.pixels.clear();
        self.pixels.resize(pixels, FirstHit::NONE);
        self.ids.clear();
        self.emission.clear();
        self.reflected.clear();
        self.reflected.resize(pixels, Vec3::ZERO);
        self.vertices = 0;
    }

    /// Samples of a pixel hit a surface of a scene.
    #[inline(never)]
    pub fn add(&mut self, scene: &Scene, pixel: u32, hit: &Hit, seen: &Interaction, samples: u32) {
        let surface = &seen.point;
        let first = &mut self.pixels[pixel as usize];
        first.samples += samples;
        first.albedo += (seen.diffuse + seen.specular) * samples as f32;
        first.normal += surface.shading_normal * samples as f32;
        let depth = (surface.position - self.eye).dot(self.forward);
        if depth < first.depth {
            (first.depth, first.position) = (depth, surface.position);
        }
        let mesh = scene.instances.get(hit.instance as usize);
        let mesh = mesh.and_then(|instance| scene.meshes.get(instance.mesh as usize));
        let material = mesh.map_or(0, |mesh| mesh.materials.of(hit.triangle));
        match self.ids.last_mut() {
            Some(last) if (last.pixel, last.instance, last.material) == (pixel, hit.instance, material) => {
                last.samples += samples;
            }
            _ => self.ids.push(IdSamples { pixel, instance: hit.instance, material, samples }),
        }
    }

    /// A sample of a pixel hit nothing.
    pub fn miss(&mut self, pixel: u32) {
        self.pixels[pixel as usize].samples += 1;
    }

    /// All camera rays are traced, with this radiance and number of vertices; mirrors follow.
    pub fn end_camera_rays(&mut self, radiance: &[Vec3], vertices: usize) {
        self.emission.extend_from_slice(radiance);
        self.vertices = vertices;
    }

    /// Radiance that a pixel has by way of mirrors.
    #[inline(always)]
    pub fn reflect(&mut self, pixel: u32, radiance: Vec3) {
        self.reflected[pixel as usize] += radiance;
    }
}
