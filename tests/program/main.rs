//! The program as a whole, mostly run as its users run it.

#[path = "../common/mod.rs"]
mod common;

mod accuracy;
mod awkward;
mod bench;
mod choice;
mod command_line;
mod compare;
mod frames;
mod gallery;
mod memory;
mod pipeline;
mod same_bytes;
mod views;
