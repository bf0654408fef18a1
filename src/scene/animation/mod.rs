//! What moves in a scene, and how.

mod frame;

pub use frame::Frame;
