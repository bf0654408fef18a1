//! The program as a whole, mostly run as its users run it.

#[path = "../common/mod.rs"]
mod common;

mod accuracy;
mod awkward;
mod bench;
mod cameras;
mod choice;
mod command_line;
mod compare;
mod display;
mod frames;
mod gallery;
mod help;
mod layers;
mod memory;
mod pipeline;
mod probe;
mod progress;
mod rendered;
mod same_bytes;
mod views;
