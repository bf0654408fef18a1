//! Files mapped into memory, read-only: the other thing, beside Embree, that takes `unsafe` code.

use std::fs::File;
use std::io;
use std::ops::Deref;
use std::path::Path;

use memmap2::Mmap;

/// A file's bytes, mapped read-only. They begin at the start of a page.
///
/// The file must not be changed in place while it is mapped, nor cut off: a reader would be ended by the operating system. Whoever writes files that
/// others map replaces them as a whole.
#[derive(Debug)]
pub struct MappedFile(Mmap);

impl MappedFile {
    /// Maps a file.
    ///
    /// # Errors
    /// Those of opening a file, and of mapping what can't be mapped, such as a folder.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        // SAFETY: the mapping is read-only and stays valid for as long as it is held, also if the file is replaced or deleted. That nobody changes the
        // file in place is what the type asks of those who write such files.
        unsafe { Mmap::map(&file) }.map(Self)
    }
}

impl Deref for MappedFile {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}
