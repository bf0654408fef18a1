//! The rays that are traced: those of rendering, and those that break ray tracers.

use glam::{Vec2, Vec3};

use super::queries::{GROUP, RayQueries};
use crate::Bounds;
use crate::lights::PackedLights;
use crate::sampling::SplitMix64;
use crate::scene::{Camera, CameraRays, Light, Ray, Scene, SurfacePoint};

macro_rules! kinds {
    ($($kind:ident $name:literal $what:literal,)*) => {
        /// Kinds of rays.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Kind { $(#[doc = $what] $kind,)* }

        impl Kind {
            /// All kinds.
            pub const ALL: &[Self] = &[$(Self::$kind,)*];

            /// Name in tables.
            pub fn name(self) -> &'static str {
                match self { $(Self::$kind => $name,)* }
            }
        }
    };
}

kinds! {
    Camera "camera" "Camera rays through neighbouring pixels.",
    Occlusion "occlusion" "From surface points and mesh points to the lights.",
    Mirror "mirror" "Reflections at surface points.",
    Sphere "sphere" "From mesh points in all directions.",
    Vertex "vertex" "Through vertices.",
    Edge "edge" "Through points of edges.",
    AlongEdge "along-edge" "Along edges, from before or within them.",
    InPlane "in-plane" "In the planes of triangles.",
    Axis "axis" "Parallel to an axis, many through vertices.",
    Zeros "zeros" "With direction components that are 0 or −0.",
    Denormal "denormal" "With direction components that are denormal or next to it.",
    Far "far" "From up to a thousand times the scene's size away.",
    Surface "surface" "Starting or ending on triangles.",
    Mixed "mixed" "All the others in one packet.",
}

/// Side of the squares of pixels that camera rays go through.
const SQUARE: u32 = 64;

/// Resolution of the images that camera rays are taken from.
const RESOLUTION: (u32, u32) = (1024, 768);

/// Camera rays per pixel to choose from.
const SAMPLES: u32 = 16;

/// Rays that are made in one place, or each somewhere else: as many as are traced in one go.
const RUN: usize = GROUP;

/// Of so many runs one has its rays apart.
const APART: u64 = 4;

/// Rays of a run in one place take one of so many triangles that follow each other, and pixels within a square of so
/// many.
const BESIDE: u32 = 16;

/// What a ray at a triangle is made of.
#[derive(Clone, Copy)]
struct Place {
    /// Which instance.
    instance: usize,
    /// Which triangle of it.
    triangle: u32,
    /// Somewhere in the air.
    air: Vec3,
    /// Some direction of length 1.
    way: Vec3,
}

/// A camera and a pixel.
type Pixel = (usize, u32, u32);

/// Makes rays for a scene.
pub struct RaySource<'a> {
    scene: &'a Scene,
    cameras: Vec<CameraRays>,
    lights: PackedLights,
    bounds: Bounds,
    /// Triangles up to and with each instance.
    triangles: Vec<u64>,
    /// Finds the surface points.
    tracer: &'a dyn RayQueries,
    seed: u64,
}

impl<'a> RaySource<'a> {
    /// A scene without lights gets a few in its corners.
    pub fn new(scene: &'a Scene, cameras: &[Camera], tracer: &'a dyn RayQueries, seed: u64) -> Self {
        let mut bounds = scene.bounds();
        if bounds.is_empty() {
            bounds = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        }
        let mut triangles = Vec::with_capacity(scene.instances.len());
        let mut total = 0u64;
        for instance in &scene.instances {
            total += scene.meshes.get(instance.mesh as usize).map_or(0, |mesh| mesh.triangles.len() as u64);
            triangles.push(total);
        }
        let lights = if scene.lights.is_empty() {
            let mut random = SplitMix64::new(seed);
            let lights: Vec<_> =
                (0..20).map(|_| Light::point(random.in_box(bounds.min, bounds.max), Vec3::ONE)).collect();
            PackedLights::of_scene(&Scene { lights, ..Scene::default() })
        } else {
            PackedLights::of_scene(scene)
        };
        let cameras = cameras.iter().map(|camera| CameraRays::new(camera, RESOLUTION, SAMPLES)).collect();
        Self { scene, cameras, lights, bounds, triangles, tracer, seed }
    }

    /// The rays of block `index`, which depend on the seed and it alone.
    pub fn block(&self, index: u64, count: usize) -> (Kind, Vec<Ray>) {
        let kind = Kind::ALL[(index % Kind::ALL.len() as u64) as usize];
        // Blocks that follow each other must not draw from one sequence.
        let mut random = SplitMix64::new(self.seed ^ SplitMix64::new(index).next());
        let mut rays = Vec::with_capacity(count);
        while rays.len() < count {
            self.some(kind, count, &mut random, &mut rays);
        }
        rays.truncate(count);
        (kind, rays)
    }

    fn some(&self, kind: Kind, count: usize, random: &mut SplitMix64, rays: &mut Vec<Ray>) {
        match kind {
            Kind::Camera => self.camera(random, rays),
            Kind::Occlusion => self.occlusion(random, rays),
            Kind::Mirror => {
                let (first, together) = (self.pixel(random), together(random));
                for _ in 0..RUN.min(count) {
                    let pixel = if together { beside(first, random) } else { self.pixel(random) };
                    let (seen, surface) = self.surface(pixel, random);
                    rays.push(Ray::new(surface.ray_origin(), seen.reflect(surface.shading_normal)));
                }
            }
            Kind::Sphere => {
                let origin = self.anywhere(random);
                rays.extend((0..16).map(|_| Ray::new(origin, direction(random))));
            }
            Kind::Mixed => {
                for _ in 0..count {
                    let kinds = &Kind::ALL[1..Kind::ALL.len() - 1];
                    let kind = kinds[random.next() as usize % kinds.len()];
                    let start = rays.len();
                    self.some(kind, 1, random, rays);
                    rays.truncate(start + 1);
                }
            }
            _ => {
                let (first, together) = (self.place(random), together(random));
                for _ in 0..RUN.min(count) {
                    let place = if together { self.beside(&first, random) } else { self.place(random) };
                    rays.push(self.at_triangle(kind, &place, random));
                }
            }
        }
    }

    fn camera(&self, random: &mut SplitMix64, rays: &mut Vec<Ray>) {
        let Some(camera) = self.cameras.get(random.next() as usize % self.cameras.len().max(1)) else {
            let origin = self.anywhere(random);
            return rays.push(Ray::new(origin, direction(random)));
        };
        let x = random.next() as u32 % (RESOLUTION.0 - SQUARE);
        let y = random.next() as u32 % (RESOLUTION.1 - SQUARE);
        let sample = random.next() as u32 % SAMPLES;
        // Four by four pixels after each other, as the renderer takes them.
        for square in 0..SQUARE * SQUARE / 16 {
            let (left, top) = (square % (SQUARE / 4) * 4, square / (SQUARE / 4) * 4);
            rays.extend((0..16).map(|i| camera.ray(x + left + i % 4, y + top + i / 4, sample)));
        }
    }

    /// From one point to all lights, or from neighbouring points to one light after the other.
    fn occlusion(&self, random: &mut SplitMix64, rays: &mut Vec<Ray>) {
        let points: Vec<Vec3> = if random.next() & 1 == 0 {
            vec![self.surface(self.pixel(random), random).1.ray_origin()]
        } else {
            let corner = self.anywhere(random);
            let spacing = 0.01 * self.bounds.extent().max_element();
            (0..16).map(|i| corner + spacing * Vec3::new((i % 4) as f32, 0.0, (i / 4) as f32)).collect()
        };
        for chunk in self.lights.chunks() {
            for light in (0..crate::simd::LANES).filter(|&light| chunk.used >> light & 1 != 0) {
                rays.extend(points.iter().map(|&point| {
                    let way = Vec3::from_array(chunk.to_light(light, point.to_array()));
                    Ray { t_far: 1.0, ..Ray::new(point, way) }
                }));
            }
        }
        if self.lights.is_empty() {
            rays.push(Ray::between(points[0], self.anywhere(random)));
        }
    }

    fn pixel(&self, random: &mut SplitMix64) -> Pixel {
        let camera = random.next() as usize % self.cameras.len().max(1);
        (camera, random.next() as u32 % RESOLUTION.0, random.next() as u32 % RESOLUTION.1)
    }

    /// A point that is seen in a pixel, or in any other where that is empty, with the direction that it is seen along.
    fn surface(&self, mut pixel: Pixel, random: &mut SplitMix64) -> (Vec3, SurfacePoint) {
        for _ in 0..4 {
            let (camera, x, y) = pixel;
            let ray = match self.cameras.get(camera) {
                Some(camera) => camera.ray(x, y, random.next() as u32 % SAMPLES),
                None => Ray::new(self.anywhere(random), direction(random)),
            };
            if let Some(hit) = self.tracer.closest(&ray) {
                return (ray.direction, self.scene.interaction(&hit, ray.direction).point);
            }
            pixel = self.pixel(random);
        }
        // Nothing is seen: a point in the air does as well.
        let normal = direction(random);
        let point = SurfacePoint {
            position: self.anywhere(random),
            offset: 0.0,
            geometric_normal: normal,
            shading_normal: normal,
        };
        (-normal, point)
    }

    fn at_triangle(&self, kind: Kind, place: &Place, random: &mut SplitMix64) -> Ray {
        let corners = self.corners(place, random);
        let first = random.next() as usize % 3;
        let [a, b, c] = [0, 1, 2].map(|i| corners[(first + i) % 3]);
        let (on_edge, inside) = (a.lerp(b, random.unit()), inside(corners, random));
        let origin = self.origin(a, place.air, random);
        let aimed = |from: Vec3, at: Vec3, random: &mut SplitMix64| match random.next() % 3 {
            0 => Ray::between(from, at),
            1 => Ray::new(from, at - from),
            // Beyond what it is aimed at.
            _ => Ray::between(from, from + 2.0 * (at - from)),
        };
        let mut axis = Vec3::ZERO;
        axis[random.next() as usize % 3] = if random.next() & 1 == 0 { 1.0 } else { -1.0 };
        match kind {
            Kind::Vertex => aimed(origin, a, random),
            Kind::Edge => aimed(origin, on_edge, random),
            Kind::AlongEdge => {
                let start = [a, on_edge, a - (b - a)][random.next() as usize % 3];
                aimed(start, b, random)
            }
            Kind::InPlane => {
                let weights = Vec2::new(random.between(-3.0, 3.0), random.between(-3.0, 3.0));
                let start = a + weights.x * (b - a) + weights.y * (c - a);
                let target = [a, b, on_edge, inside][random.next() as usize % 4];
                aimed(start, target, random)
            }
            Kind::Axis => {
                let target = [a, on_edge, inside, origin][random.next() as usize % 4];
                let size = self.bounds.extent().max_element();
                let length = [1.0, size, random.unit() * size][random.next() as usize % 3];
                Ray::new(target - random.unit() * size * axis, length * axis)
            }
            Kind::Zeros => {
                let mut way = inside - origin;
                way[random.next() as usize % 3] = if random.next() & 1 == 0 { 0.0 } else { -0.0 };
                Ray::new(if random.next() & 1 == 0 { inside - way } else { origin }, way)
            }
            Kind::Denormal => {
                let mut way = inside - origin;
                let tiny = [1e-45, 1e-40, -1e-39, 1e-38, -1e-30, 1e-25, 1e-19, -1e-18, 1e-17, 1e-12];
                for _ in 0..1 + random.next() % 2 {
                    way[random.next() as usize % 3] = tiny[random.next() as usize % tiny.len()];
                }
                Ray::new(if random.next() & 1 == 0 { inside - way } else { origin }, way)
            }
            Kind::Far => {
                let size = self.bounds.extent().max_element().max(f32::MIN_POSITIVE);
                let far = inside + size * 10f32.powf(random.between(0.0, 3.0)) * place.way;
                aimed(far, [inside, inside, on_edge, a][random.next() as usize % 4], random)
            }
            _ => {
                let start = [a, on_edge, inside, inside][random.next() as usize % 4];
                match random.next() % 3 {
                    0 => Ray::new(start, place.way),
                    1 => Ray::between(start, place.air),
                    _ => Ray::between(place.air, start),
                }
            }
        }
    }

    /// Somewhere to start from: in the air, or near the triangle.
    fn origin(&self, near: Vec3, air: Vec3, random: &mut SplitMix64) -> Vec3 {
        match random.next() % 3 {
            0 => near + random.unit() * 0.01 * self.bounds.extent().max_element() * direction(random),
            _ => air,
        }
    }

    fn anywhere(&self, random: &mut SplitMix64) -> Vec3 {
        random.in_box(self.bounds.min, self.bounds.max)
    }

    /// A place at any instance, or at any triangle, in turn.
    fn place(&self, random: &mut SplitMix64) -> Place {
        let (air, way) = (self.anywhere(random), direction(random));
        let total = self.triangles.last().copied().unwrap_or(0).max(1);
        let drawn = random.next() % total;
        let mut instance = self.triangles.partition_point(|&up_to| up_to <= drawn);
        if random.next() & 1 == 0 {
            instance = random.next() as usize % self.triangles.len().max(1);
        }
        Place { instance, triangle: random.next() as u32, air, way }
    }

    /// One close to another.
    fn beside(&self, place: &Place, random: &mut SplitMix64) -> Place {
        let triangle = place.triangle.wrapping_add(random.next() as u32 % BESIDE);
        let air = place.air + random.unit() * 0.02 * self.bounds.extent().max_element() * direction(random);
        let way = (place.way + 0.05 * direction(random)).normalize_or(place.way);
        Place { triangle, air, way, ..*place }
    }

    /// The corners of a place's triangle in world space.
    fn corners(&self, place: &Place, random: &mut SplitMix64) -> [Vec3; 3] {
        let instance = self.scene.instances.get(place.instance);
        let mesh = instance.and_then(|instance| self.scene.meshes.get(instance.mesh as usize));
        let (Some(instance), Some(mesh)) = (instance, mesh.filter(|mesh| !mesh.triangles.is_empty())) else {
            return [self.anywhere(random), self.anywhere(random), self.anywhere(random)];
        };
        let corners = mesh.corners(place.triangle % mesh.triangles.len() as u32);
        match &instance.to_world {
            Some(to_world) => corners.map(|corner| to_world.transform_point3(corner)),
            None => corners,
        }
    }
}

/// Whether a run of rays is made in one place, as those of rendering mostly are.
fn together(random: &mut SplitMix64) -> bool {
    !random.next().is_multiple_of(APART)
}

/// A pixel close to another.
fn beside((camera, x, y): Pixel, random: &mut SplitMix64) -> Pixel {
    (
        camera,
        x / BESIDE * BESIDE + random.next() as u32 % BESIDE,
        y / BESIDE * BESIDE + random.next() as u32 % BESIDE,
    )
}

/// Uniform on the unit sphere.
fn direction(random: &mut SplitMix64) -> Vec3 {
    loop {
        let way = random.in_box(Vec3::NEG_ONE, Vec3::ONE);
        let length = way.length();
        if length > 1e-3 && length <= 1.0 {
            return way / length;
        }
    }
}

fn inside([a, b, c]: [Vec3; 3], random: &mut SplitMix64) -> Vec3 {
    let (mut u, mut v) = (random.unit(), random.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    a + u * (b - a) + v * (c - a)
}
