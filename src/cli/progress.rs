//! Progress and notices.

use std::io::{IsTerminal, Write, stderr, stdout};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::events::{Event, Line, Pace, ProgressForm, Rule};
use crate::image::Image;
use crate::render::{Tile, TileSink};

/// Lines on progress come at most this often.
const PACE: Duration = Duration::from_millis(250);

/// Reports to the user: notices on stderr unless quiet, progress in the form that was asked for.
#[derive(Clone, Copy, Debug)]
pub struct Reporter {
    quiet: bool,
    verbose: bool,
    form: ProgressForm,
    /// Whether bars are shown.
    bars: bool,
}

impl Reporter {
    /// A reporter. `quiet` silences all but errors, and progress that was asked for in a form of its own; `verbose` adds what was chosen
    /// and where time goes.
    pub fn new(quiet: bool, verbose: bool, form: ProgressForm) -> Self {
        let bars = match form {
            ProgressForm::Auto => !quiet && stderr().is_terminal(),
            ProgressForm::Bar => stderr().is_terminal(),
            ProgressForm::Json | ProgressForm::Openjd | ProgressForm::None => false,
        };
        Self { quiet, verbose, form, bars }
    }

    /// Prints a line.
    pub fn line(&self, text: &str) {
        if !self.quiet {
            self.report(Event::Message(text));
        }
    }

    /// Prints a line that only who wants to know more gets to see.
    pub fn detail(&self, text: &str) {
        if self.verbose {
            self.line(text);
        }
    }

    /// Reports why the command failed.
    pub fn error(&self, text: &str) {
        self.report(Event::Error(text));
    }

    /// A stage of unknown length.
    pub fn spinner(&self, stage: &'static str) -> Spinner {
        let bar = self.bars.then(|| {
            let bar = ProgressBar::new_spinner().with_message(stage);
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        });
        Spinner { stage: self.begin(stage), bar }
    }

    /// A stage with a bar and an estimate of the time left.
    pub fn bar(&self, stage: &'static str) -> Bar {
        let shown = if self.bars {
            let style = ProgressStyle::with_template("{msg:>10} {wide_bar} {percent:>3} % · {eta} left");
            let bar = ProgressBar::new(1).with_message(stage);
            Shown::Bar(match style {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            })
        } else {
            match self.form {
                ProgressForm::Json | ProgressForm::Openjd => Shown::lines(Rule::Every(PACE)),
                ProgressForm::Bar => Shown::lines(Rule::Tenths),
                ProgressForm::Auto | ProgressForm::None => Shown::Nothing,
            }
        };
        Bar { stage: self.begin(stage), shown }
    }

    fn begin(&self, name: &'static str) -> Stage {
        if matches!(self.form, ProgressForm::Json | ProgressForm::Openjd) {
            self.report(Event::Stage(name));
        }
        Stage { name, start: Instant::now(), reporter: *self }
    }

    /// Writes the lines of an event. What goes wrong with stdout or stderr themselves can't be reported anywhere.
    fn report(&self, event: Event) {
        for line in self.form.lines(event) {
            let _ = match line {
                Line::Out(text) => writeln!(stdout(), "{text}").and_then(|()| stdout().flush()),
                Line::Err(text) => writeln!(stderr(), "{text}"),
            };
        }
    }
}

/// A stage that has begun.
struct Stage {
    name: &'static str,
    start: Instant,
    reporter: Reporter,
}

impl Stage {
    fn finish(&self) {
        self.reporter.detail(&format!("{}: {:.2} s", self.name, self.start.elapsed().as_secs_f64()));
    }
}

/// A stage of unknown length.
pub struct Spinner {
    stage: Stage,
    bar: Option<ProgressBar>,
}

impl Spinner {
    /// The stage is over.
    pub fn finish_and_clear(&self) {
        self.bar.iter().for_each(ProgressBar::finish_and_clear);
        self.stage.finish();
    }
}

/// A stage of which it is known how much is done.
pub struct Bar {
    stage: Stage,
    shown: Shown,
}

/// What there is to see of a stage.
enum Shown {
    Nothing,
    Bar(ProgressBar),
    Lines { done: AtomicU64, total: AtomicU64, pace: Pace },
}

impl Shown {
    fn lines(rule: Rule) -> Self {
        Self::Lines { done: AtomicU64::new(0), total: AtomicU64::new(1), pace: Pace::new(rule) }
    }
}

impl Bar {
    /// Shows that as much of the whole is done.
    pub fn set(&self, done: u64, total: u64) {
        match &self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => {
                bar.set_length(total);
                bar.set_position(done);
            }
            Shown::Lines { done: counted, total: whole, pace } => {
                counted.store(done, Ordering::Relaxed);
                whole.store(total, Ordering::Relaxed);
                self.write(pace, done, total);
            }
        }
    }

    /// Shows that as much more is done.
    pub fn add(&self, more: u64) {
        match &self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => bar.inc(more),
            Shown::Lines { done, total, pace } => {
                let done = done.fetch_add(more, Ordering::Relaxed) + more;
                self.write(pace, done, total.load(Ordering::Relaxed));
            }
        }
    }

    /// The same begins once more.
    fn restart(&self) {
        match &self.shown {
            Shown::Nothing => {}
            Shown::Bar(bar) => bar.set_position(0),
            Shown::Lines { done, pace, .. } => {
                done.store(0, Ordering::Relaxed);
                pace.restart();
            }
        }
    }

    fn write(&self, pace: &Pace, done: u64, total: u64) {
        let done = done.min(total);
        let Stage { name: stage, reporter, .. } = self.stage;
        pace.report(done, total, Instant::now(), || reporter.report(Event::Progress { stage, done, total }));
    }

    /// The stage is over.
    pub fn finish(&self) {
        if let Shown::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
        self.stage.finish();
    }
}

/// Tiles move the bar on by their pixels; its length is those of the image.
impl TileSink for Bar {
    fn tile(&self, _: &Tile, pixels: &[[f32; 3]]) {
        self.add(pixels.len() as u64);
    }

    fn picture(&self, _: &Image) {
        self.restart();
    }
}
