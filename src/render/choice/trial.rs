//! What was tried of a light mesh, and what follows.

use glam::Vec3;

use super::costs::TileCost;
use crate::render::frame::BlockIntegrator;
use crate::render::layers::LightParts;
use crate::render::paths::TilePaths;
use crate::render::reason::Reason;
use crate::render::stats::{HybridError, RenderStats, ShadeCounters};
use crate::render::tiles::Tile;
use crate::settings::Integrator;

/// What a light mesh has to save, as a share of conventional shading: who is level is exact, and the estimate is one.
const LEAST_SAVED: f32 = 0.05;

/// What was tried.
#[derive(Default)]
pub struct Trial {
    pub tiles: Vec<TriedTile>,
    costs: Vec<TileCost>,
}

impl Trial {
    /// Adds tiles, and their rays to those of the render.
    pub fn add(&mut self, tried: Vec<(TriedTile, TileCost)>, stats: &mut RenderStats) {
        for (mut tile, cost) in tried {
            stats.rays.shadow += std::mem::take(&mut tile.counters.shadow_rays);
            self.tiles.push(tile);
            self.costs.push(cost);
        }
    }

    /// What the light mesh costs as a share of conventional shading, and the standard error of that.
    fn share(&self) -> (f32, f32) {
        let sum = |cost: fn(&TileCost) -> f32| self.costs.iter().map(cost).sum::<f32>();
        let conventional = sum(|cost| cost.conventional);
        let share = sum(|cost| cost.light_mesh) / conventional;
        let deviations = self.costs.iter().map(|cost| cost.light_mesh - share * cost.conventional);
        (share, error_of_sum(deviations) / conventional)
    }

    /// Whether more tiles are unlikely to say anything else of what costs less. The error itself comes from few tiles: twice of it is too little.
    pub fn is_cost_clear(&self) -> bool {
        let (share, error) = self.share();
        (share - (1.0 - LEAST_SAVED)).abs() > 3.0 * error
    }

    /// Whether the light mesh costs less.
    pub fn saves(&self) -> bool {
        self.share().0 <= 1.0 - LEAST_SAVED
    }

    /// Whether more tiles are unlikely to acquit a light mesh that seems mistaken.
    pub fn is_mistake_clear(&self, tolerance: f32) -> bool {
        let (excess, error) = self.excess(tolerance);
        excess <= 0.0 || excess > 2.0 * error
    }

    /// What to take by what was tried.
    pub fn verdict(&self, tolerance: f32) -> (Integrator, Reason) {
        let (share, _) = self.share();
        if !self.saves() {
            return (Integrator::Conventional, Reason::Trial(share));
        }
        match self.mistaken().filter(|_| self.excess(tolerance).0 > 0.0) {
            Some(mistaken) => (Integrator::Conventional, Reason::Mistaken(mistaken)),
            None => (Integrator::LightMesh, Reason::Trial(share)),
        }
    }

    /// The share of the light that hybrid shading takes for missing, or the other way round; `None` where there is no light.
    fn mistaken(&self) -> Option<f32> {
        let mut sum = HybridError::default();
        self.errors().for_each(|error| sum.add(error));
        sum.share()
    }

    /// How much more light than a tolerance allows is wrong, and the standard error of that.
    fn excess(&self, tolerance: f32) -> (f32, f32) {
        let excess = self.errors().map(|error| (error.missed - f64::from(tolerance) * error.received) as f32);
        (excess.clone().sum(), error_of_sum(excess))
    }

    fn errors(&self) -> impl Iterator<Item = HybridError> + Clone {
        self.tiles.iter().map(|tried| tried.counters.hybrid_error)
    }
}

/// Standard error of a sum of values that were drawn independently; infinite for a single one.
fn error_of_sum(values: impl Iterator<Item = f32> + Clone) -> f32 {
    let count = values.clone().count() as f32;
    if count < 2.0 {
        return f32::INFINITY;
    }
    let mean = values.clone().sum::<f32>() / count;
    let squares: f32 = values.map(|value| (value - mean).powi(2)).sum();
    (squares * count / (count - 1.0)).sqrt()
}

/// A tile that a light mesh was tried on: its vertices' light, as [`BlockIntegrator::shade`] gives it. The rays of the trial
/// are counted already.
pub struct TriedTile {
    pub tile: Tile,
    pub light: Vec<Vec3>,
    pub counters: ShadeCounters,
}

/// Takes what was shaded for a trial as it is.
pub struct WithTrial<I> {
    pub integrator: I,
    pub tried: Vec<TriedTile>,
}

impl<I: BlockIntegrator> BlockIntegrator for WithTrial<I> {
    fn evaluate(&mut self, paths: &[TilePaths], stats: &mut RenderStats) {
        self.integrator.evaluate(paths, stats);
    }

    fn shade(
        &self,
        tile: &Tile,
        paths: &TilePaths,
        light: &mut [Vec3],
        parts: Option<&mut LightParts>,
    ) -> ShadeCounters {
        // A trial has no parts.
        let is_known = |tried: &&TriedTile| parts.is_none() && tried.tile == *tile;
        match self.tried.iter().find(is_known).filter(|tried| tried.light.len() == light.len()) {
            Some(tried) => {
                light.copy_from_slice(&tried.light);
                tried.counters
            }
            None => self.integrator.shade(tile, paths, light, parts),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(errors: &[f64], costs: &[[f32; 2]]) -> Trial {
        let tile = |&missed: &f64| TriedTile {
            tile: Tile { x: 0, y: 0, width: 1, height: 1 },
            light: Vec::new(),
            counters: ShadeCounters {
                hybrid_error: HybridError { missed, received: 1.0 },
                ..ShadeCounters::default()
            },
        };
        let cost = |&[light_mesh, conventional]: &[f32; 2]| TileCost { light_mesh, conventional };
        Trial { tiles: errors.iter().map(tile).collect(), costs: costs.iter().map(cost).collect() }
    }

    /// One bad tile among four says little, four of them do, and so do good ones; a tile alone never says enough to condemn.
    #[test]
    fn few_tiles_must_agree_that_a_mesh_is_mistaken() {
        let is_clear = |errors: &[f64]| trial(errors, &[]).is_mistake_clear(0.01);
        assert!(!is_clear(&[0.0, 0.0, 0.0, 0.1]));
        assert!(!is_clear(&[0.1]));
        assert!(is_clear(&[0.005; 4]));
        assert!(is_clear(&[0.03, 0.04, 0.05, 0.04]));
        let cheap = [[5.0, 10.0]; 4];
        let (integrator, reason) = trial(&[0.03, 0.04, 0.05, 0.04], &cheap).verdict(0.01);
        assert_eq!(integrator, Integrator::Conventional);
        assert!(matches!(reason, Reason::Mistaken(share) if (share - 0.04).abs() < 1e-6), "{reason:?}");
    }

    /// Tiles that agree end a trial; one that costs most of the light mesh's rays, among cheap ones, doesn't, though the mean is the same.
    #[test]
    fn a_trial_goes_on_while_tiles_disagree() {
        let even = trial(&[], &[[5.0, 10.0], [6.0, 10.0], [5.5, 10.0], [5.5, 10.0]]);
        let uneven = trial(&[], &[[1.0, 10.0], [1.0, 10.0], [1.0, 10.0], [19.0, 10.0]]);
        assert!((even.share().0 - 0.55).abs() < 1e-6 && (uneven.share().0 - 0.55).abs() < 1e-6);
        assert!(even.is_cost_clear() && !uneven.is_cost_clear());
        assert!(matches!(even.verdict(0.01), (Integrator::LightMesh, Reason::Trial(_))));
        let level = trial(&[], &[[9.8, 10.0], [9.7, 10.0]]);
        assert!(matches!(level.verdict(0.01), (Integrator::Conventional, Reason::Trial(_))));
    }
}
