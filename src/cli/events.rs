//! Progress as lines for programs: which lines there are in each form, and how often one is due.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::settings::named_enum;

named_enum! {
    /// How a command reports its progress.
    #[derive(Default)]
    pub enum ProgressForm {
        /// Bars where stderr is a terminal, nothing elsewhere
        #[default]
        Auto = "auto",
        /// Bars where stderr is a terminal, elsewhere a line on stderr for every tenth that is done
        Bar = "bar",
        /// A line of JSON on stderr for every event: stage, progress, message, error
        Json = "json",
        /// Lines on stdout that sessions of Open Job Description read
        Openjd = "openjd",
        /// No progress
        None = "none",
    }
}

/// What there is to report.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A stage begins.
    Stage(&'a str),
    /// As much of a stage is done.
    Progress { stage: &'a str, done: u64, total: u64 },
    /// A note or a warning.
    Message(&'a str),
    /// The command failed.
    Error(&'a str),
}

/// A line, and where it goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// To stdout.
    Out(String),
    /// To stderr.
    Err(String),
}

impl ProgressForm {
    /// The lines of an event.
    pub fn lines(self, event: Event) -> Vec<Line> {
        match self {
            Self::Json => vec![Line::Err(json_line(event))],
            Self::Openjd => openjd_lines(event),
            Self::Auto | Self::Bar | Self::None => plain_line(event).into_iter().collect(),
        }
    }
}

/// For readers: messages and errors as they are; progress by stage and per cent.
fn plain_line(event: Event) -> Option<Line> {
    match event {
        Event::Stage(_) => None,
        Event::Progress { stage, done, total } => {
            Some(Line::Err(format!("{stage}: {:.0} %", percent(done, total))))
        }
        Event::Message(text) => Some(Line::Err(text.to_owned())),
        Event::Error(text) => Some(Line::Err(format!("lightmesh: {text}"))),
    }
}

fn json_line(event: Event) -> String {
    match event {
        Event::Stage(stage) => json!({ "event": "stage", "stage": stage }),
        Event::Progress { stage, done, total } => {
            json!({ "event": "progress", "stage": stage, "done": done, "total": total })
        }
        Event::Message(text) => json!({ "event": "message", "text": text }),
        Event::Error(text) => json!({ "event": "error", "text": text }),
    }
    .to_string()
}

/// As "How Jobs Are Run" of the specification 2023-09 says. Sessions read stdout and stderr as one stream; messages are in their log.
fn openjd_lines(event: Event) -> Vec<Line> {
    let out =
        |key: &str, value: &str| Line::Out(format!("openjd_{key}: {}", value.replace(['\n', '\r'], " ")));
    match event {
        Event::Stage(stage) => vec![out("status", stage)],
        Event::Progress { done, total, .. } => {
            vec![out("progress", &format!("{:.1}", percent(done, total)))]
        }
        Event::Message(text) => vec![Line::Err(text.to_owned())],
        Event::Error(text) => vec![out("fail", text), Line::Err(format!("lightmesh: {text}"))],
    }
}

/// The share that is done, from 0 to 100.
fn percent(done: u64, total: u64) -> f64 {
    if total == 0 { 0.0 } else { 100.0 * done.min(total) as f64 / total as f64 }
}

/// Decides when a line on progress is due: now and then, and always when all is done.
pub struct Pace {
    rule: Rule,
    /// What the last line said, and when.
    last: Mutex<Option<(u64, Instant)>>,
}

/// How often a line is due.
#[derive(Clone, Copy, Debug)]
pub enum Rule {
    /// At most once in this time.
    Every(Duration),
    /// Once per tenth.
    Tenths,
}

impl Pace {
    /// No line was written yet.
    pub fn new(rule: Rule) -> Self {
        Self { rule, last: Mutex::new(None) }
    }

    /// Calls `write` if a line is due that says `done`. Lines are written one at a time, and none says less than the one before.
    pub fn report(&self, done: u64, total: u64, now: Instant, write: impl FnOnce()) {
        // Whoever panicked while writing left nothing half changed.
        let mut last = self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let due = match *last {
            None => true,
            Some((before, _)) if done <= before => false,
            Some(_) if done >= total => true,
            Some((before, at)) => match self.rule {
                Rule::Every(time) => now.duration_since(at) >= time,
                Rule::Tenths => tenths(done, total) > tenths(before, total),
            },
        };
        if due {
            *last = Some((done, now));
            write();
        }
    }

    /// The same is done once more from the start.
    pub fn restart(&self) {
        *self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = None;
    }
}

fn tenths(done: u64, total: u64) -> u64 {
    (u128::from(done) * 10 / u128::from(total.max(1))) as u64
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    /// What is written of 0 to 100 of `total` when a thousandth of a second passes in between.
    fn written(rule: Rule, total: u64) -> Vec<u64> {
        let (pace, start, lines) = (Pace::new(rule), Instant::now(), RefCell::new(Vec::new()));
        for done in 0..=100 {
            let now = start + Duration::from_millis(done);
            pace.report(done, total, now, || lines.borrow_mut().push(done));
        }
        lines.into_inner()
    }

    /// However often something is done, lines come at the pace that was chosen, and the last one says that all is.
    #[test]
    fn lines_come_at_their_pace() {
        assert_eq!(written(Rule::Every(Duration::from_millis(40)), 100), [0, 40, 80, 100]);
        assert_eq!(written(Rule::Tenths, 100), [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100]);
        assert_eq!(written(Rule::Every(Duration::MAX), 50)[..2], [0, 50]);
    }

    /// A thread that is late with its news doesn't turn progress back.
    #[test]
    fn progress_does_not_go_back() {
        let (pace, now, lines) =
            (Pace::new(Rule::Every(Duration::ZERO)), Instant::now(), RefCell::new(Vec::new()));
        for done in [3, 2, 5, 5, 4, 6] {
            pace.report(done, 10, now, || lines.borrow_mut().push(done));
        }
        assert_eq!(lines.into_inner(), [3, 5, 6]);
    }

    /// The specification wants a number from 0 to 100 and one line per message, whatever is counted and said.
    #[test]
    fn lines_for_open_job_description_keep_its_form() {
        let lines = |event| ProgressForm::Openjd.lines(event);
        let progress = |done, total| lines(Event::Progress { stage: "rendering", done, total });
        assert_eq!(progress(42, 100), [Line::Out("openjd_progress: 42.0".to_owned())]);
        assert_eq!(progress(120, 100), [Line::Out("openjd_progress: 100.0".to_owned())]);
        assert_eq!(progress(0, 0), [Line::Out("openjd_progress: 0.0".to_owned())]);
        let failed = lines(Event::Error("a.toml:3: no\nlight"));
        assert_eq!(failed[0], Line::Out("openjd_fail: a.toml:3: no light".to_owned()));
    }

    /// A text can hold what it likes and stays one line of JSON that says the same.
    #[test]
    fn json_is_one_line_per_event() {
        let text = "warning: \"quoted\"\nand more";
        let [Line::Err(line)] = &ProgressForm::Json.lines(Event::Message(text))[..] else {
            panic!("one line")
        };
        let value: serde_json::Value = serde_json::from_str(line).expect("JSON");
        assert!(!line.contains('\n') && value["text"] == text && value["event"] == "message", "{line}");
    }
}
