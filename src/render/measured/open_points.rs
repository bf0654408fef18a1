//! Mesh points of averaged shadows that settings leave open, coarser and finer ones.

use glam::Vec3;

use crate::render::held_out::HeldOut;
use crate::render::settled::Settled;
use crate::settings::{PointLayout, PointSettings, Settings, Spacing};

/// Spacings that are tried are R times powers of 2, this many to an octave, down to R/4: already there a surface point has some 130 points to weigh, which
/// takes longer than conventional tracing unless lights are many, and memory for the points grows eightfold with each further octave. Who wants a finer
/// mesh than that can name its spacing.
///
/// With few points in D_y a regular grid is wrong by a fifth where it happens to lie badly; a body-centred one of as many points is not, and from a spacing of R/1.26 on
/// both are wrong by the same. So the coarsest meshes are body-centred, unless settings name a layout.
const STEPS_PER_OCTAVE: f32 = 3.0;
const FINEST: i32 = 6;
const COARSEST_REGULAR: i32 = 0;
const FINEST_BODY_CENTRED: i32 = 0;
const COARSEST_BODY_CENTRED: i32 = -1;

/// The error falls with about this power of the spacing, by what `lightmesh bench` finds on the forest; the first guess leaves some room for the
/// uncertainty of what is measured.
const ORDER: f32 = 1.9;
const HEADROOM: f32 = 1.25;

/// Mesh points that are to be found.
pub(super) struct OpenPoints {
    /// R.
    radius: f32,
    /// Whether coarse ones are body-centred.
    body_centred: bool,
    /// What is tried next, see [`OpenPoints::points`].
    pub step: i32,
    /// Pixels at which it is tried.
    pub held_out: HeldOut,
    /// The finest that was tried, and for which there is memory.
    pub fitting: Option<i32>,
    /// That of a picture that is finished.
    pub shown: Option<i32>,
    /// Whether memory allows no finer one.
    pub by_memory: bool,
}

impl OpenPoints {
    /// Of a softness R, tried at some pixels, with the coarsest first.
    pub fn new(radius: f32, body_centred: bool, held_out: HeldOut) -> Self {
        let mut open =
            Self { radius, body_centred, step: 0, held_out, fitting: None, shown: None, by_memory: false };
        open.step = open.coarsest();
        open
    }

    /// The step that is tried first.
    pub fn coarsest(&self) -> i32 {
        if self.body_centred { COARSEST_BODY_CENTRED } else { COARSEST_REGULAR }
    }

    /// The points of settings as they are tried: those of a step are twice as many as those of the step before.
    pub fn points(&self, settings: &PointSettings) -> PointSettings {
        // A body-centred mesh has two points per cell.
        let (layout, octaves) = if self.body_centred && self.step <= FINEST_BODY_CENTRED {
            (PointLayout::BodyCentred, 1 - self.step)
        } else {
            (PointLayout::Regular, -self.step)
        };
        let spacing = self.radius * (octaves as f32 / STEPS_PER_OCTAVE).exp2();
        PointSettings { layout, spacing: Spacing::Units(Vec3::splat(spacing)), ..settings.clone() }
    }

    /// Whether all that is tried was.
    pub fn is_over(&self) -> bool {
        self.step > FINEST
    }

    /// Tries nothing finer than what was.
    pub fn end(&mut self) {
        self.step = FINEST;
    }

    /// Begins with the coarsest again; whether that was not tried alone.
    pub fn begin_again(&mut self) -> bool {
        let is_finer = self.step > self.coarsest();
        (self.step, self.fitting) = (self.coarsest(), None);
        is_finer
    }

    /// Tries no coarser mesh than that of a choice that was made before.
    pub fn begin_at(&mut self, before: &Settled, settings: &Settings) {
        let mut wanted = settings.clone();
        before.choose_mesh(&mut wanted);
        while self.step < FINEST && self.points(&settings.mesh.direct) != wanted.mesh.direct {
            self.step += 1;
        }
    }

    /// Goes on to a mesh as fine as it probably has to be, so that few are tried, after one whose error was so many `times` too large.
    pub fn refine(&mut self, times: f32) {
        let octaves = (HEADROOM * times).log2() / ORDER;
        let next = self.step.saturating_add(((octaves * STEPS_PER_OCTAVE).round() as i32).max(1));
        // The finest one is tried, unless it was.
        self.step = if self.step < FINEST { next.min(FINEST) } else { next };
    }
}
