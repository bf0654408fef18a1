//! What a signal does to work that takes long: it ends at the next place where nothing is lost.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::SigId;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use signal_hook::low_level::unregister;

use crate::render::StopToken;

/// Catches Ctrl-C and SIGTERM for as long as it lives. The second one ends the program at once.
pub struct Interrupt {
    /// Stops what was given it.
    pub stop: StopToken,
    /// The signal that came; 0 for none.
    signal: Arc<AtomicUsize>,
    handlers: Vec<SigId>,
}

impl Interrupt {
    /// Catches them from now on.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub fn catch() -> io::Result<Self> {
        let mut caught = Self { stop: StopToken::default(), signal: Arc::default(), handlers: Vec::new() };
        let second = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // Before the one that arms it, so that the first signal doesn't end the program.
            let exit = exit_code_of(signal as usize).into();
            caught.handlers.push(flag::register_conditional_shutdown(signal, exit, second.clone())?);
            caught.handlers.push(flag::register(signal, second.clone())?);
            caught.handlers.push(flag::register_usize(signal, caught.signal.clone(), signal as usize)?);
            caught.handlers.push(flag::register(signal, caught.stop.flag())?);
        }
        Ok(caught)
    }

    /// The exit code of a program that a signal ended, if one came: 130 for Ctrl-C, 143 for SIGTERM.
    pub fn exit_code(&self) -> Option<u8> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            signal => Some(exit_code_of(signal)),
        }
    }
}

/// What shells report of programs that a signal ended.
fn exit_code_of(signal: usize) -> u8 {
    128 + (signal as u8 & 127)
}

impl Drop for Interrupt {
    fn drop(&mut self) {
        for handler in self.handlers.drain(..) {
            unregister(handler);
        }
    }
}
