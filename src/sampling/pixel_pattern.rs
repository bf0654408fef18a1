//! Where in a pixel samples lie.

use glam::Vec2;

/// Positions in the unit square, spread such that of 16, and of 32, the share on one side of any straight edge is as near as can be to the area there:
/// within 1.5 and 2.04 samples. Found by simulated annealing of the greatest difference over all edges: of the first 16, then of the rest beside them;
/// the order of the first serves smaller numbers.
///
/// Rows of a grid cross an edge that is nearly level all at once, and jittered samples are off by up to 4 of 16.
#[rustfmt::skip]
const SPREAD: [(f32, f32); 32] = [
    (0.472, 0.920), (0.402, 0.437), (0.137, 0.243), (0.889, 0.216),
    (0.635, 0.640), (0.923, 0.716), (0.469, 0.090), (0.099, 0.730),
    (0.830, 0.478), (0.628, 0.378), (0.190, 0.935), (0.252, 0.120),
    (0.785, 0.878), (0.720, 0.106), (0.091, 0.473), (0.382, 0.669),
    (0.667, 0.268), (0.797, 0.588), (0.019, 0.075), (0.221, 0.359),
    (0.369, 0.844), (0.676, 0.939), (0.584, 0.751), (0.885, 0.053),
    (0.376, 0.150), (0.339, 0.540), (0.482, 0.273), (0.094, 0.907),
    (0.554, 0.514), (0.961, 0.329), (0.877, 0.833), (0.151, 0.592),
];

/// The most samples that twice as many, of which they are the first half, spread as evenly as they do.
pub const MOST_DOUBLED: u32 = SPREAD.len() as u32 / 2;

/// Positions of so many samples in the unit square, the same for all pixels: an edge that is straight then has steps of equal length, where
/// positions by chance would make a row of dots of it.
pub fn pixel_pattern(samples: u32) -> Vec<Vec2> {
    if samples == 1 {
        return vec![Vec2::splat(0.5)];
    }
    if let Some(few) = SPREAD.get(..samples as usize) {
        return few.iter().map(|&position| Vec2::from(position)).collect();
    }
    // Hammersley's points, in the middle of their strata.
    let stratum = |index: u32| ((f64::from(index) + 0.5) / f64::from(samples)) as f32;
    let reversed =
        |index: u32| (f64::from(index.reverse_bits()) / 2f64.powi(32) + 0.5 / f64::from(samples)) as f32;
    // Rounding may reach the square's edge.
    let inside = |at: f32| at.min(1.0 - f32::EPSILON);
    (0..samples).map(|index| Vec2::new(stratum(index), inside(reversed(index)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area of the part of the unit square where a·x + b·y < c, by clipping its outline.
    fn area_below(a: f32, b: f32, c: f32) -> f32 {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(Vec2::from);
        let height = |p: Vec2| a * p.x + b * p.y - c;
        let mut outline = Vec::new();
        for (number, &p) in corners.iter().enumerate() {
            let q = corners[(number + 1) % 4];
            if height(p) < 0.0 {
                outline.push(p);
            }
            if (height(p) < 0.0) != (height(q) < 0.0) {
                outline.push(p.lerp(q, height(p) / (height(p) - height(q))));
            }
        }
        let next = |number: usize| outline[(number + 1) % outline.len()];
        0.5 * outline.iter().enumerate().map(|(number, p)| p.perp_dot(next(number))).sum::<f32>()
    }

    /// The greatest difference between area and share of samples on one side of an edge, over edges of all directions and places.
    fn worst(samples: u32) -> f32 {
        let pattern = pixel_pattern(samples);
        let mut worst = 0.0f32;
        for step in 0..180 {
            let (b, a) = (step as f32).to_radians().sin_cos();
            for place in 0..600 {
                let c = -1.0 + 2.42 * place as f32 / 600.0;
                let below = pattern.iter().filter(|p| a * p.x + b * p.y < c).count();
                worst = worst.max((below as f32 / samples as f32 - area_below(a, b, c)).abs());
            }
        }
        worst
    }

    /// An edge through a pixel shows in the pixel's value as the area on each side of it, to within 1.5 samples of 16, and 2 of 32.
    #[test]
    fn edges_are_seen_as_they_are() {
        assert!((area_below(1.0, 1.0, 0.5) - 0.125).abs() < 1e-6 && area_below(0.0, -1.0, 0.0) == 1.0);
        for (samples, bound) in
            [(4, 0.36), (8, 0.22), (16, 1.5 / 16.0), (32, 0.064), (64, 0.07), (256, 0.035)]
        {
            let worst = worst(samples);
            assert!(worst <= bound, "{samples} samples: {worst}");
        }
    }

    /// Every number of samples lies inside of the pixel.
    #[test]
    fn samples_lie_in_their_pixel() {
        for samples in (1..70).chain([65_536]) {
            let pattern = pixel_pattern(samples);
            assert_eq!(pattern.len(), samples as usize);
            assert!(pattern.iter().all(|p| p.min_element() >= 0.0 && p.max_element() < 1.0));
        }
    }
}
