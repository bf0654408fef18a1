//! Progress and notices on stderr.

use std::io::{IsTerminal, Write, stderr};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::render::{Tile, TileSink};

/// Reports to the user on stderr: notices always unless quiet, progress bars on a terminal only.
pub struct Reporter {
    quiet: bool,
    bars: bool,
}

impl Reporter {
    /// A reporter; `quiet` silences all but errors.
    pub fn new(quiet: bool) -> Self {
        Self { quiet, bars: !quiet && stderr().is_terminal() }
    }

    /// Prints a line. What goes wrong with stderr itself can't be reported anywhere.
    pub fn line(&self, text: &str) {
        if !self.quiet {
            let _ = writeln!(stderr(), "{text}");
        }
    }

    /// A spinner for a stage of unknown length.
    pub fn spinner(&self, stage: &'static str) -> ProgressBar {
        if !self.bars {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new_spinner().with_message(stage);
        bar.enable_steady_tick(Duration::from_millis(100));
        bar
    }

    /// A bar with an estimate of the time left.
    pub fn bar(&self, stage: &'static str) -> Bar {
        if !self.bars {
            return Bar(ProgressBar::hidden());
        }
        let style = ProgressStyle::with_template("{msg:>10} {wide_bar} {percent:>3} % · {eta} left");
        let bar = ProgressBar::new(1).with_message(stage);
        Bar(match style {
            Ok(style) => bar.with_style(style),
            Err(_) => bar,
        })
    }
}

/// A progress bar.
pub struct Bar(ProgressBar);

impl Bar {
    /// Shows that as much of the whole is done.
    pub fn set(&self, done: u64, total: u64) {
        self.0.set_length(total);
        self.0.set_position(done);
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// Tiles move the bar on by their pixels; its length is those of the image.
impl TileSink for Bar {
    fn tile(&self, _: &Tile, pixels: &[[f32; 3]]) {
        self.0.inc(pixels.len() as u64);
    }
}
