//! How far a picture is from a reference.
