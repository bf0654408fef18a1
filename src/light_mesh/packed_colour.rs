//! Colours of the surfaces that gathering rays hit.

use glam::Vec3;

/// Square roots of a colour, three numbers of 10 bits: there are millions of rays, and dark colours need finer steps.
#[derive(Clone, Copy, Debug)]
pub struct PackedColour(u32);

impl PackedColour {
    /// No light comes back.
    pub const BLACK: Self = Self(0);
    /// Steps from 0 to 1.
    const STEPS: f32 = 1023.0;

    /// Packs a colour; what lies outside of [0, 1] comes to lie in it.
    #[inline(always)]
    pub fn new(colour: Vec3) -> Self {
        let step = |k: f32| ((k.sqrt() * Self::STEPS + 0.5) as u32).min(Self::STEPS as u32);
        let [r, g, b] = colour.to_array().map(step);
        Self(r | g << 10 | b << 20)
    }

    /// The colour.
    #[inline(always)]
    pub fn colour(self) -> Vec3 {
        let root = |shift: u32| (self.0 >> shift & 1023) as f32 * (1.0 / Self::STEPS);
        let root = Vec3::new(root(0), root(10), root(20));
        root * root
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Colours are kept to a hundredth of themselves down to what is black in any picture; no number of a file breaks them.
    #[test]
    fn rays_keep_the_colour_where_they_ended() {
        for k in [1.0f32, 0.7, 0.2, 0.03, 0.01] {
            let diffuse = Vec3::new(k, 0.0, 1.0 - k);
            let error = (PackedColour::new(diffuse).colour() - diffuse).abs();
            assert!(error.cmple(0.01 * diffuse + 1e-6).all(), "{error} for {diffuse}");
        }
        for odd in [f32::NAN, f32::INFINITY, -1.0, 5.0] {
            let kept = PackedColour::new(Vec3::splat(odd)).colour();
            assert!(kept.cmpge(Vec3::ZERO).all() && kept.cmple(Vec3::ONE).all());
        }
    }
}
