//! A forest: trees with separate small leaves on uneven ground, under point lights just above the crowns.
//!
//! Lengths are in units of which a crown is about 3.8 wide; y is up and the viewer stands at positive z.

use std::f32::consts::TAU;
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

use glam::{Vec2, Vec3};

use super::error::GenerateError;
use super::files::write_files;
use crate::sampling::SplitMix64;

/// What to generate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Forest {
    /// Triangles, exactly; see [`Forest::TRIANGLES`].
    pub triangles: u32,
    /// Lights; see [`Forest::LIGHTS`].
    pub lights: u32,
    /// Seed of everything random.
    pub seed: u32,
}

impl Forest {
    /// Least and greatest number of triangles.
    pub const TRIANGLES: (u32, u32) = (64, 100_000_000);
    /// Least and greatest number of lights.
    pub const LIGHTS: (u32, u32) = (1, 1_000_000);

    /// Writes `forest.obj`, `forest.mtl` and `forest.toml` into `folder`, which is created if need be.
    ///
    /// # Errors
    /// [`GenerateError`]; then none of the files is new.
    pub fn write(&self, folder: &Path) -> Result<(), GenerateError> {
        for (name, found, (min, max)) in
            [("triangles", self.triangles, Self::TRIANGLES), ("lights", self.lights, Self::LIGHTS)]
        {
            if !(min..=max).contains(&found) {
                return Err(GenerateError::OutOfRange { name, min, max, found });
            }
        }
        let plan = Plan::new(*self);
        write_files(
            folder,
            &[
                ("forest.obj", &|out| plan.write_obj(out)),
                ("forest.mtl", &|out| out.write_all(MATERIALS.as_bytes())),
                ("forest.toml", &|out| out.write_all(plan.scene_file().as_bytes())),
            ],
        )
    }
}

const MATERIALS: &str = "\
newmtl ground
Kd 0.52 0.45 0.33
newmtl bark
Kd 0.32 0.23 0.16
newmtl leaf_dark
Kd 0.16 0.34 0.09
newmtl leaf_light
Kd 0.34 0.52 0.14
newmtl leaf_autumn
Kd 0.62 0.44 0.10
";

/// Leaf materials and their share among the trees.
const LEAVES: [(&str, f32); 3] = [("leaf_dark", 0.5), ("leaf_light", 0.35), ("leaf_autumn", 0.15)];

/// Triangles that make a full tree; more make more trees.
const TRIANGLES_PER_TREE: u32 = 1_150;
/// Distance between neighbouring trees' places.
const CELL: f32 = 3.7;
/// Ground beyond the outermost trees' places.
const MARGIN: f32 = 7.0;
/// Half the width of an average crown, and half its height.
const CROWN: Vec2 = Vec2::new(1.9, 1.55);
/// Height of an average crown's centre.
const CROWN_CENTRE: f32 = 4.2;
/// No crown reaches higher than this above the lowest ground.
const TOP: f32 = 7.2;
/// Sides of a trunk, and its segments along its height.
const TRUNK: (u32, u32) = (7, 3);
/// Branches of a tree and their sides.
const BRANCHES: (u32, u32) = (6, 3);

/// Sizes that follow from the number of triangles.
struct Plan {
    forest: Forest,
    trees: u32,
    columns: u32,
    rows: u32,
    /// Cells of the ground per side.
    ground: u32,
    with_branches: bool,
    leaf_triangles: u32,
}

impl Plan {
    fn new(forest: Forest) -> Self {
        let trees = (forest.triangles / TRIANGLES_PER_TREE).max(1);
        let columns = (f64::from(trees).sqrt().ceil() as u32).max(1);
        let rows = trees.div_ceil(columns);
        // A twentieth of the triangles for the ground, as long as that makes facets too small to see.
        let ground = (f64::from(forest.triangles / 40).sqrt() as u32).clamp(1, 4 * (columns + 4));
        let trunk = 2 * TRUNK.0 * TRUNK.1;
        let branches = 2 * BRANCHES.0 * BRANCHES.1;
        let rest = forest.triangles - 2 * ground * ground - trees * trunk;
        let with_branches = rest > 4 * trees * branches;
        let leaf_triangles = if with_branches { rest - trees * branches } else { rest };
        Self { forest, trees, columns, rows, ground, with_branches, leaf_triangles }
    }

    /// Half the extent of the trees' places along x and z.
    fn half_extent(&self) -> Vec2 {
        Vec2::new(self.columns as f32, self.rows as f32) * (CELL / 2.0)
    }

    fn write_obj(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut random = SplitMix64::new(u64::from(self.forest.seed));
        let mut text = format!(
            "# lightmesh generate forest --triangles {} --lights {} --seed {}\nmtllib forest.mtl\n",
            self.forest.triangles, self.forest.lights, self.forest.seed
        );
        self.ground(&mut text);
        for tree in 0..self.trees {
            self.tree(tree, &mut random, &mut text);
            out.write_all(text.as_bytes())?;
            text.clear();
        }
        Ok(())
    }

    fn ground(&self, text: &mut String) {
        text.push_str("o ground\nusemtl ground\n");
        let half = self.half_extent() + MARGIN;
        let n = self.ground;
        for row in 0..=n {
            for column in 0..=n {
                let at = Vec2::new(column as f32, row as f32) / n as f32 * 2.0 - 1.0;
                let at = at * half;
                vertex(text, Vec3::new(at.x, ground_height(at), at.y));
            }
        }
        for row in 0..n {
            for column in 0..n {
                let a = row * (n + 1) + column + 1;
                let [b, c, d] = [a + n + 1, a + n + 2, a + 1];
                let _ = writeln!(text, "f {a} {b} {c} {d}");
            }
        }
    }

    fn tree(&self, tree: u32, random: &mut SplitMix64, text: &mut String) {
        let cell = Vec2::new((tree % self.columns) as f32, (tree / self.columns) as f32) + 0.5;
        let jitter = Vec2::new(random.between(-0.22, 0.22), random.between(-0.22, 0.22));
        let at = (cell + jitter) * CELL - self.half_extent();
        let size = random.between(0.85, 1.12);
        let root = Vec3::new(at.x, ground_height(at) - 0.1, at.y);
        let lean = Vec3::new(random.between(-0.3, 0.3), 0.0, random.between(-0.3, 0.3));
        let centre = root + Vec3::Y * (CROWN_CENTRE * size) + lean;
        let half = Vec3::new(CROWN.x, CROWN.y, CROWN.x) * size;

        let _ = writeln!(text, "o tree_{tree}\nusemtl bark");
        // The trunk ends inside the crown; its foot is wider than the rest.
        let spine: Vec<(Vec3, f32)> = (0..=TRUNK.1)
            .map(|ring| {
                let t = ring as f32 / TRUNK.1 as f32;
                let radius = size * (0.07 + 0.17 * (1.0 - t) + 0.1 * (1.0 - t) * (1.0 - t) * (1.0 - t));
                (root.lerp(centre, t * t * 0.25 + t * 0.75), radius)
            })
            .collect();
        tube(text, &spine, TRUNK.0);
        if self.with_branches {
            let fork = root.lerp(centre, 0.72);
            for branch in 0..BRANCHES.0 {
                let angle = TAU * (branch as f32 + random.between(-0.3, 0.3)) / BRANCHES.0 as f32;
                let (sin, cos) = sin_cos(angle);
                let outward = Vec3::new(cos, random.between(-0.1, 0.5), sin);
                let tip = centre + outward * half * random.between(0.55, 0.75);
                tube(text, &[(fork, 0.07 * size), (tip, 0.015 * size)], BRANCHES.1);
            }
        }

        let share = random.unit();
        let mut bound = 0.0;
        let material = LEAVES.iter().find(|(_, part)| {
            bound += part;
            share < bound
        });
        let _ = writeln!(text, "usemtl {}", material.unwrap_or(&LEAVES[0]).0);
        // The trees share the leaves so that all of them together have exactly what is left.
        let of_tree =
            |tree: u32| (u64::from(self.leaf_triangles) * u64::from(tree) / u64::from(self.trees)) as u32;
        let mut left = of_tree(tree + 1) - of_tree(tree);
        let clumps: Vec<Vec3> = (0..18).map(|_| in_ball(random) * 0.68).collect();
        while left > 0 {
            let clump = clumps[(random.next() % clumps.len() as u64) as usize];
            let place = (clump + in_ball(random) * 0.36).clamp_length_max(1.0);
            left -= leaf(text, centre + place * half, place, size, left >= 2, random);
        }
    }

    fn scene_file(&self) -> String {
        let half = self.half_extent();
        let Forest { triangles, lights, seed } = self.forest;
        // With linear falloff the light that reaches a point grows with the forest's extent; this keeps
        // the image's brightness.
        let total = 1.6 * (half.x + half.y);
        let front = half.y;
        format!(
            "\
# A forest of {triangles} triangles under {lights} point lights just above the trees.
# Made by: lightmesh generate forest --triangles {triangles} --lights {lights} --seed {seed}

background = [0.32, 0.45, 0.62]
falloff = \"linear\"

[camera]
position = [{eye_x:.2}, 7.6, {eye_z:.2}]
look_at = [0.0, 1.4, {look_z:.2}]
vertical_fov = 48.0

[render]
resolution = [600, 600]

[[geometry]]
file = \"forest.obj\"

[[light_box]]
min = [{min_x:.2}, {low:.2}, {min_z:.2}]
max = [{max_x:.2}, {high:.2}, {max_z:.2}]
count = {lights}
seed = {seed}
total_intensity = {total:.2}
",
            eye_x = 2.0,
            eye_z = front + 8.5,
            look_z = front - 4.5,
            // Beyond the front row, so that the sides that the viewer sees are lit.
            min_x = -half.x,
            min_z = -half.y,
            max_x = half.x,
            max_z = half.y + CELL,
            low = TOP + 0.2,
            high = TOP + 1.2,
        )
    }
}

/// Computed in double precision, so that the result in single precision is the same with every system's
/// library, and a seed the same forest everywhere.
fn sin_cos(angle: f32) -> (f32, f32) {
    let (sin, cos) = f64::from(angle).sin_cos();
    (sin as f32, cos as f32)
}

/// Gentle waves, at most 0.2 high and low.
fn ground_height(at: Vec2) -> f32 {
    0.2 * sin_cos(0.31 * at.x + 0.7).0 * sin_cos(0.27 * at.y).1
}

/// Uniform in the unit ball.
fn in_ball(random: &mut SplitMix64) -> Vec3 {
    loop {
        let point = random.in_box(Vec3::NEG_ONE, Vec3::ONE);
        if point.length_squared() <= 1.0 {
            return point;
        }
    }
}

/// Rings around the points of a spine, joined by quads: 2 × `sides` triangles per segment, open ends.
fn tube(text: &mut String, spine: &[(Vec3, f32)], sides: u32) {
    let (Some((first, _)), Some((last, _))) = (spine.first(), spine.last()) else { return };
    let (u, v) = (*last - *first).normalize().any_orthonormal_pair();
    for (centre, radius) in spine {
        for side in 0..sides {
            let angle = TAU * side as f32 / sides as f32;
            let (sin, cos) = sin_cos(angle);
            vertex(text, *centre + (u * cos + v * sin) * *radius);
        }
    }
    let rings = spine.len() as i64;
    let sides = i64::from(sides);
    for ring in 0..rings - 1 {
        for side in 0..sides {
            let index = |ring: i64, side: i64| (ring - rings) * sides + side % sides;
            let [a, b] = [index(ring, side), index(ring, side + 1)];
            let [c, d] = [index(ring + 1, side + 1), index(ring + 1, side)];
            let _ = writeln!(text, "f {a} {b} {c} {d}");
        }
    }
}

/// A leaf folded along its midrib, of two triangles, or half of one; returns how many it has.
fn leaf(text: &mut String, at: Vec3, outward: Vec3, size: f32, whole: bool, random: &mut SplitMix64) -> u32 {
    let length = size * random.between(0.24, 0.36);
    let width = length * random.between(0.45, 0.6);
    let heading = outward + in_ball(random) * 0.8 + Vec3::NEG_Y * 0.15;
    let along = heading.try_normalize().unwrap_or(Vec3::X);
    let flat = Vec3::Y.cross(along).try_normalize().unwrap_or(Vec3::Z);
    let (sin, cos) = sin_cos(random.between(-0.9, 0.9));
    let across = flat * cos + along.cross(flat) * sin;
    let fold = across.cross(along) * (0.25 * width);
    let middle = at + along * (0.45 * length);
    vertex(text, at);
    vertex(text, middle + across * (0.5 * width) - fold);
    vertex(text, at + along * length);
    if !whole {
        text.push_str("f -3 -2 -1\n");
        return 1;
    }
    vertex(text, middle - across * (0.5 * width) - fold);
    text.push_str("f -4 -3 -2 -1\n");
    2
}

/// A `v` statement, to a thousandth and without trailing zeros.
fn vertex(text: &mut String, position: Vec3) {
    text.push('v');
    for value in position.to_array() {
        let start = text.len();
        // Writing to a string cannot fail.
        let _ = write!(text, " {value:.3}");
        text.truncate(start + text[start..].trim_end_matches('0').trim_end_matches('.').len());
    }
    text.push('\n');
}
