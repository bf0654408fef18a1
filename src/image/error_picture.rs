//! Where a picture differs from a reference, in false colours.
