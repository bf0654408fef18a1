//! Embree 3 and 4 behind one safe interface, loaded at run time.

pub mod packet;
