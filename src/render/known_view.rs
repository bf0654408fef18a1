//! Views that were rendered before: what was found for them need not be found again.

use serde::{Deserialize, Serialize};

use super::accuracy::{Accuracy, Ending};
use super::reason::Reason;
use super::settled::Settled;
use super::stats::RenderStats;
use crate::scene::{Camera, Fingerprint};
use crate::settings::{OutputSettings, Settings};

/// What was found for a view.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct KnownView {
    /// Whether a file knows it: what was only rendered is measured anew.
    #[serde(skip, default = "yes")]
    pub of_file: bool,
    /// Of the camera and the settings.
    pub identity: Fingerprint,
    /// What was chosen where the settings left it open.
    pub settled: Settled,
    /// How wrong its image was.
    pub accuracy: Option<Accuracy>,
    /// Points on surfaces that it is interpolated from: numbers, and how many surface points each is the nearest of.
    pub records: Vec<(u32, u32)>,
}

impl KnownView {
    /// A view that was rendered; `None` if it might have been better with more time or memory.
    pub fn of(
        camera: &Camera,
        settings: &Settings,
        stats: &RenderStats,
        records: Vec<(u32, u32)>,
    ) -> Option<Self> {
        let accuracy = stats.accuracy;
        let by_memory = stats.choice.is_some_and(|choice| choice.reason == Reason::Memory);
        let is_cut = |accuracy: Accuracy| matches!(accuracy.ending, Ending::Time | Ending::Memory);
        let is_whole = !by_memory && !accuracy.is_some_and(is_cut);
        let identity = identity(camera, settings);
        let known = |settled| Self { of_file: false, identity, settled, accuracy, records };
        stats.settled.filter(|_| is_whole).map(known)
    }
}

fn yes() -> bool {
    true
}

/// What makes two views the same: all but which part of them is rendered, how it is written and how much memory there is for that.
pub(super) fn identity(camera: &Camera, settings: &Settings) -> Fingerprint {
    Fingerprint::of(&(camera, of_views(settings)))
}

/// The settings without which part of a view is rendered, how it is written and how much memory there is for that.
pub(super) fn of_views(settings: &Settings) -> Settings {
    let mut settings = settings.clone();
    settings.view.crop = None;
    settings.view.block_samples = None;
    settings.limits.memory = None;
    settings.output = OutputSettings::default();
    settings
}
