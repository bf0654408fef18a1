//! The `lightmesh` program.

fn main() {}
