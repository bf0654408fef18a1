//! Slots: where the values of a known mesh point lie in its mesh's arrays.

/// Slot of a point that has no value yet: step 1 of the paper's algorithm.
pub const UNKNOWN: u32 = u32::MAX;
