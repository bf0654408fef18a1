//! What the numbers were measured on.

use std::{fmt, fs};

use serde::Serialize;

/// The machine and how busy it is.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Name of the processor.
    pub processor: String,
    /// Threads that run at the same time.
    pub logical_processors: usize,
    /// Mean number of runnable threads over the last minute, before the benchmark; `None` where the system doesn't report it.
    pub load_average: Option<f64>,
    /// Operating system and architecture.
    pub platform: String,
}

impl Machine {
    /// This machine, now.
    pub fn here() -> Self {
        let cpuinfo = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = cpuinfo.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
        let load = fs::read_to_string("/proc/loadavg").unwrap_or_default();
        Self {
            processor: model.map_or("unknown processor", |(_, name)| name.trim()).to_owned(),
            logical_processors: std::thread::available_parallelism().map_or(1, usize::from),
            load_average: load.split_whitespace().next().and_then(|number| number.parse().ok()),
            platform: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        }
    }

    /// Whether others use so much of the machine that times say little.
    pub fn busy(&self) -> bool {
        self.load_average.is_some_and(|load| load > 0.5)
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {} logical processors, {}", self.processor, self.logical_processors, self.platform)?;
        match self.load_average {
            Some(load) if self.busy() => write!(f, "; UNDER LOAD: load average {load} before the run"),
            _ => Ok(()),
        }
    }
}
