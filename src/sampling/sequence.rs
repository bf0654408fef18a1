//! Sequences that spread evenly.

use glam::Vec3;

/// Point `index` of Roberts' R₃ sequence in the unit cube, whose points stay evenly spread however many are taken.
pub fn unit_cube_point(index: u32) -> Vec3 {
    // Powers of the root of g⁴ = g + 1.
    const ALPHA: [f64; 3] = [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3];
    Vec3::from_array(ALPHA.map(|alpha| (0.5 + alpha * f64::from(index)).fract() as f32))
}
