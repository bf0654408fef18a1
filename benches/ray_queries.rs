//! Rates of the ray-query backends on the rays of light meshes, in million rays per second and thread.
//!
//! All backends answer the same rays in one process, in turn, on one thread whose processor time counts, and
//! medians of rates and of ratios are printed, so that the ratio means something on a busy machine. Arguments: triangles (default 23500 and 1500000).

use std::hint::black_box;
use std::sync::{Arc, LazyLock};
use std::time::Instant;

use glam::Vec3;
#[cfg(feature = "embree")]
use lightmesh::accel::EmbreeAccel;
use lightmesh::accel::{Accel, BvhAccel, Coherence, PacketLanes, RayHitPacket, RayPacket};
use lightmesh::scene::{Instance, Positions, Ray, Scene, TriangleMaterials, TriangleMesh};

const LIGHTS: usize = 96;
const ROUNDS: usize = 5;

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn vec(&mut self) -> Vec3 {
        2.0 * Vec3::new(self.unit(), self.unit(), self.unit()) - 1.0
    }
}

/// Small leaves of random orientation in spherical crowns over a square of ground, 30 units wide.
fn forest(triangles: usize) -> Scene {
    let mut random = Random(1);
    let (trees, ground) = (60, 20);
    let mut positions = Vec::with_capacity(3 * triangles);
    for i in 0..ground * ground {
        let at = |dx: i32, dz: i32| {
            let cell = 30.0 / ground as f32;
            Vec3::new((i % ground + dx) as f32 * cell - 15.0, 0.0, (i / ground + dz) as f32 * cell - 15.0)
        };
        positions.extend([at(0, 0), at(0, 1), at(1, 0), at(1, 0), at(0, 1), at(1, 1)]);
    }
    let per_tree = (triangles - positions.len() / 3) / trees;
    // The same total leaf area whatever the count.
    let size = 0.3 * (380.0 / per_tree as f32).sqrt();
    for _ in 0..trees {
        let trunk = 14.0 * Vec3::new(2.0 * random.unit() - 1.0, 0.0, 2.0 * random.unit() - 1.0);
        let (height, radius) = (3.0 + random.unit(), 1.2 + random.unit());
        for _ in 0..per_tree {
            let offset = loop {
                let offset = random.vec();
                if offset.length_squared() <= 1.0 {
                    break offset;
                }
            };
            let center = trunk + Vec3::Y * height + radius * offset;
            positions.extend([0; 3].map(|_| center + size * random.vec()));
        }
    }
    let count = positions.len() as u32 / 3;
    let mesh = TriangleMesh {
        name: "forest".to_owned(),
        positions: Positions::new(positions.into_iter().map(|p| p.to_array()).collect()),
        triangles: Arc::new((0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()),
        normals: None,
        uvs: None,
        colors: None,
        materials: TriangleMaterials::Uniform(0),
    };
    Scene {
        meshes: vec![Arc::new(mesh)],
        instances: vec![Instance { mesh: 0, to_world: None }],
        ..Scene::default()
    }
}

/// Sixteen rays at a time, in the orders in which light meshes and cameras trace them.
struct Workload {
    name: &'static str,
    rays: Vec<Ray>,
    coherence: Coherence,
}

fn workloads() -> Vec<Workload> {
    let mut random = Random(2);
    let lights: Vec<_> = (0..LIGHTS)
        .map(|_| 14.0 * random.vec() * Vec3::new(1.0, 0.0, 1.0) + Vec3::Y * (6.5 + random.unit()))
        .collect();
    let grid = 64;
    let point = |x: usize, y: usize, z: usize| {
        let p = Vec3::new(x as f32, y as f32, z as f32) + 0.5;
        p / grid as f32 * Vec3::new(30.0, 6.0, 30.0) - Vec3::new(15.0, 0.0, 15.0)
    };
    // Bricks of 4 × 2 × 2 neighbouring points, a sample of all.
    let bricks: Vec<[Vec3; 16]> = (0..400)
        .map(|_| {
            let mut at = |width: usize| (random.unit() * (grid / width) as f32) as usize * width;
            let (x, y, z) = (at(4), at(2), at(2));
            std::array::from_fn(|i| point(x + i % 4, y + i / 4 % 2, z + i / 8))
        })
        .collect();
    let to_one_light = bricks.iter().flat_map(|brick| {
        lights.iter().flat_map(move |&light| brick.iter().map(move |&p| Ray::between(p, light)))
    });
    let to_many_lights = bricks
        .iter()
        .flat_map(|brick| brick.iter().flat_map(|&p| lights.iter().map(move |&l| Ray::between(p, l))));
    let eye = Vec3::new(0.0, 9.0, 24.0);
    let camera = (0..800 * 600 / 16).flat_map(|tile| {
        (0..16).map(move |i| {
            let (x, y) = (tile % 200 * 4 + i % 4, tile / 200 * 4 + i / 4);
            let aim = Vec3::new(24.0 * (x as f32 / 800.0 - 0.5), 9.0 - 14.0 * (y as f32 / 600.0), 10.0);
            Ray::new(eye, aim - eye)
        })
    });
    let sphere = (0..400_000).map(|i| Ray::new(bricks[i / 1200 % 400][0], random.vec())).collect();
    vec![
        Workload {
            name: "points to one light",
            rays: to_one_light.collect(),
            coherence: Coherence::Coherent,
        },
        Workload {
            name: "point to many lights",
            rays: to_many_lights.collect(),
            coherence: Coherence::Incoherent,
        },
        Workload { name: "camera", rays: camera.collect(), coherence: Coherence::Coherent },
        Workload { name: "all directions", rays: sphere, coherence: Coherence::Incoherent },
    ]
}

fn any_single(accel: &impl Accel, rays: &[Ray]) -> u32 {
    rays.iter().map(|ray| u32::from(accel.occluded(ray))).sum()
}

fn any_packet<const N: usize>(accel: &impl Accel, rays: &[Ray], coherence: Coherence) -> u32 {
    let mut packet = RayPacket::<N>::empty();
    let mut blocked = 0;
    for rays in rays.chunks_exact(N) {
        rays.iter().enumerate().for_each(|(lane, ray)| packet.set_lane(lane, ray));
        blocked += accel.occluded_packet(((1u64 << N) - 1) as u32, &mut packet, coherence).count_ones();
    }
    blocked
}

fn closest_single(accel: &impl Accel, rays: &[Ray]) -> u32 {
    rays.iter().map(|ray| u32::from(accel.intersect(ray).is_some())).sum()
}

fn closest_packet<const N: usize>(accel: &impl Accel, rays: &[Ray], coherence: Coherence) -> u32 {
    let mut packet = RayHitPacket::<N>::empty();
    let mut hits = 0;
    for rays in rays.chunks_exact(N) {
        rays.iter().enumerate().for_each(|(lane, ray)| packet.set_lane(lane, ray));
        accel.intersect_packet(((1u64 << N) - 1) as u32, &mut packet, coherence);
        hits += packet.hit.geom_id.iter().filter(|&&id| id != u32::MAX).count() as u32;
    }
    hits
}

/// Seconds that this thread has run, which other load on the machine doesn't count towards; wall-clock
/// time where the system doesn't count it.
fn seconds() -> f64 {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let schedule = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = schedule.split(' ').next().and_then(|field| field.parse::<u64>().ok());
    nanoseconds.map_or_else(|| START.elapsed().as_secs_f64(), |nanoseconds| nanoseconds as f64 * 1e-9)
}

/// Seconds of one run of a query kind, and how many rays hit.
fn run(accel: &impl Accel, kind: usize, work: &Workload) -> (f64, u32) {
    let rays = &work.rays[..];
    let start = seconds();
    let hits = match kind {
        0 => any_single(accel, rays),
        1 => any_packet::<4>(accel, rays, work.coherence),
        2 => any_packet::<8>(accel, rays, work.coherence),
        3 => any_packet::<16>(accel, rays, work.coherence),
        4 => closest_single(accel, rays),
        5 => closest_packet::<8>(accel, rays, work.coherence),
        _ => closest_packet::<16>(accel, rays, work.coherence),
    };
    (seconds() - start, black_box(hits))
}

const KINDS: [&str; 7] = ["any 1", "any 4", "any 8", "any 16", "closest 1", "closest 8", "closest 16"];

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn main() {
    let counts: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    for triangles in if counts.is_empty() { vec![23_500, 1_500_000] } else { counts } {
        let scene = forest(triangles);
        let start = Instant::now();
        let accel = match BvhAccel::build(&scene) {
            Ok(accel) => accel,
            Err(error) => return eprintln!("{error}"),
        };
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{triangles} triangles: built in {seconds:.3} s, {:.1} bytes per triangle, {:?}",
            accel.memory_bytes() as f64 / triangles as f64,
            accel.level()
        );
        #[cfg(feature = "embree")]
        let embree = EmbreeAccel::build(&scene).inspect_err(|error| eprintln!("no Embree: {error}")).ok();
        for work in workloads() {
            println!("{:22} {:>10} {:>10} {:>6} {:>7}", work.name, "bvh", "embree", "ratio", "hits");
            for (kind, name) in KINDS.iter().enumerate() {
                let (mut bvh_rates, mut embree_rates, mut ratios, mut hits) = (vec![], vec![], vec![], 0);
                for _ in 0..ROUNDS {
                    let rate = |seconds: f64| work.rays.len() as f64 / 1e6 / seconds;
                    let (seconds, found) = run(&accel, kind, &work);
                    bvh_rates.push(rate(seconds));
                    hits = found;
                    #[cfg(feature = "embree")]
                    if let Some(embree) = &embree {
                        let (embree_seconds, _) = run(embree, kind, &work);
                        embree_rates.push(rate(embree_seconds));
                        ratios.push(embree_seconds / seconds);
                    }
                }
                let share = 100.0 * f64::from(hits) / work.rays.len() as f64;
                let [bvh, embree, ratio] = [bvh_rates, embree_rates, ratios].map(median);
                println!("  {name:20} {bvh:10.2} {embree:10.2} {ratio:6.2} {share:6.1}%");
            }
        }
    }
}
