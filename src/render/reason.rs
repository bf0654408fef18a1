//! What `auto` took, as it is said and counted.

use std::fmt;

use serde::Serialize;

use crate::settings::Integrator;

/// What `auto` took, and why.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// What was taken.
    pub integrator: Integrator,
    /// Why.
    pub reason: Reason,
}

/// Why an integrator was taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// The settings ask for what only a light mesh gives: soft shadows, or indirect light at points in free space.
    Settings,
    /// So many lights lie above the horizon of a surface point that the one way is known to be cheaper.
    Lights(f32),
    /// By trial: what the light mesh costs, as a share of conventional shading.
    Trial(f32),
    /// By trial: the share of the light that the light mesh is estimated to get wrong exceeds the tolerance.
    Mistaken(f32),
    /// A light mesh would take more memory than the limit leaves it.
    Memory,
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: ", self.integrator)?;
        match self.reason {
            Reason::Settings => f.write_str("soft shadows, or indirect light in free space"),
            Reason::Lights(lights) => write!(f, "{lights:.1} lights above the horizon of a surface point"),
            Reason::Trial(share) => {
                write!(f, "a light mesh is estimated at {:.0} % of conventional shading", 100.0 * share)
            }
            Reason::Memory => f.write_str("a light mesh would exceed the memory limit"),
            Reason::Mistaken(share) => {
                write!(f, "a light mesh is estimated to get {:.1} % of the light wrong", 100.0 * share)
            }
        }
    }
}
