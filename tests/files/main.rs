//! What is read and written: models, scene files, pictures.

#[path = "../common/mod.rs"]
mod common;

mod animation;
mod channels;
mod damaged_images;
mod failed_images;
mod formats;
mod generate;
mod image_io;
mod independent;
mod malformed;
mod obj;
mod openexr;
mod round_trips;
mod scene_file;
mod textures;
mod whole_files;
