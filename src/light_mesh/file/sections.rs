//! A file of sections: header, table, and the sections' bytes.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use embree_sys::MappedFile;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::error::MeshFileError;

/// The version of the format that is written, and the only one that is read.
const VERSION: u32 = 2;

/// First bytes. Like PNG's they show whether a transfer has changed line ends or lost the eighth bit.
const MAGIC: [u8; 8] = *b"\x89lmesh\r\n";

/// Header: magic, version, number of sections, length of the file, hash of all before it and of the table.
const HEADER: usize = 64;
/// An entry of the table: name, place, length, hash.
const ENTRY: usize = 64;
const NAME: usize = 16;
const HASH: Range<usize> = 24..56;

/// Sections begin at multiples of so many bytes, so that numbers in them can be used where they lie.
const ALIGNMENT: usize = 64;

/// Sections to be written.
#[derive(Default)]
pub struct SectionsWriter {
    sections: Vec<(&'static str, Vec<u8>)>,
}

impl SectionsWriter {
    /// Adds a section of bytes; its name has at most 16 letters.
    pub fn bytes(&mut self, name: &'static str, bytes: Vec<u8>) {
        self.sections.push((name, bytes));
    }

    /// Adds a section that holds a value in the form of the crate `postcard`.
    ///
    /// # Errors
    /// [`MeshFileError::Damaged`] if the value has no such form, as none of ours.
    pub fn value(&mut self, name: &'static str, value: &impl Serialize) -> Result<(), MeshFileError> {
        let bytes = postcard::to_stdvec(value).map_err(|error| MeshFileError::damaged(name, error))?;
        self.bytes(name, bytes);
        Ok(())
    }

    /// The file.
    pub fn finish(self) -> Vec<u8> {
        let mut table = Vec::new();
        let mut at = aligned(HEADER + ENTRY * self.sections.len());
        for (name, bytes) in &self.sections {
            let mut entry = [0; ENTRY];
            entry.iter_mut().zip(name.bytes().take(NAME)).for_each(|(place, letter)| *place = letter);
            entry[NAME..24].copy_from_slice(&(at as u64).to_le_bytes());
            entry[24..32].copy_from_slice(&(bytes.len() as u64).to_le_bytes());
            entry[32..].copy_from_slice(blake3::hash(bytes).as_bytes());
            table.extend_from_slice(&entry);
            at = aligned(at + bytes.len());
        }
        let mut header = [0; HEADER];
        header[..8].copy_from_slice(&MAGIC);
        header[8..12].copy_from_slice(&VERSION.to_le_bytes());
        header[12..16].copy_from_slice(&(self.sections.len() as u32).to_le_bytes());
        header[16..24].copy_from_slice(&(at as u64).to_le_bytes());
        let hash = hash_of_table(&header, &table);
        header[HASH].copy_from_slice(&hash);
        let mut file = Vec::with_capacity(at);
        file.extend_from_slice(&header);
        file.extend_from_slice(&table);
        for (_, bytes) in self.sections {
            file.resize(aligned(file.len()), 0);
            file.extend_from_slice(&bytes);
        }
        file.resize(at, 0);
        file
    }
}

fn aligned(at: usize) -> usize {
    at.next_multiple_of(ALIGNMENT)
}

/// Hash of the header before its own hash, and of the table.
fn hash_of_table(header: &[u8], table: &[u8]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(header.get(..HASH.start).unwrap_or_default());
    hasher.update(table);
    *hasher.finalize().as_bytes()
}

/// A file of sections, mapped read-only; all checksums are right.
pub struct MeshFile {
    map: Arc<MappedFile>,
    sections: Vec<(String, Range<usize>)>,
}

impl MeshFile {
    /// Maps a file and checks that it is whole.
    ///
    /// Who writes such a file replaces it as a whole, so that what is mapped never changes.
    ///
    /// # Errors
    /// See [`MeshFileError`].
    pub fn open(path: &Path) -> Result<Self, MeshFileError> {
        let data = std::fs::metadata(path).map_err(MeshFileError::Read)?;
        if !data.is_file() || data.len() < HEADER as u64 {
            return Err(MeshFileError::Foreign);
        }
        let map = MappedFile::open(path).map_err(MeshFileError::Read)?;
        let sections = read_table(&map)?;
        Ok(Self { map: Arc::new(map), sections })
    }

    /// Names and lengths of all sections, bytes.
    pub fn sections(&self) -> impl Iterator<Item = (&str, usize)> {
        self.sections.iter().map(|(name, range)| (name.as_str(), range.len()))
    }

    /// The bytes of a section, if there is one of that name.
    pub fn section(&self, name: &str) -> Option<MappedSection> {
        let (_, range) = self.sections.iter().find(|(own, _)| own == name)?;
        Some(MappedSection { map: self.map.clone(), range: range.clone() })
    }

    /// The bytes of a section that has to be there.
    ///
    /// # Errors
    /// [`MeshFileError::Damaged`].
    pub fn needed(&self, name: &str) -> Result<MappedSection, MeshFileError> {
        self.section(name).ok_or_else(|| MeshFileError::damaged(name, "missing"))
    }

    /// The value that a section holds.
    ///
    /// # Errors
    /// [`MeshFileError::Damaged`].
    pub fn value<T: DeserializeOwned>(&self, name: &str) -> Result<T, MeshFileError> {
        let section = self.needed(name)?;
        let (value, rest) = postcard::take_from_bytes(section.bytes())
            .map_err(|error| MeshFileError::damaged(name, error))?;
        if rest.is_empty() { Ok(value) } else { Err(MeshFileError::damaged(name, "too long")) }
    }
}

fn read_table(file: &[u8]) -> Result<Vec<(String, Range<usize>)>, MeshFileError> {
    let damaged = |what: &str| MeshFileError::Damaged(what.to_owned());
    let (header, rest) = file.split_at_checked(HEADER).ok_or(MeshFileError::Foreign)?;
    if header.get(..8) != Some(&MAGIC) {
        return Err(MeshFileError::Foreign);
    }
    let version = number::<4>(header, 8) as u32;
    if version != VERSION {
        return Err(MeshFileError::Version { found: version });
    }
    if number::<8>(header, 16) != file.len() as u64 {
        return Err(damaged("it is shorter or longer than it was"));
    }
    let count = number::<4>(header, 12) as usize;
    let table = count.checked_mul(ENTRY).and_then(|length| rest.get(..length));
    let table = table.ok_or_else(|| damaged("its table is cut off"))?;
    if header.get(HASH) != Some(&hash_of_table(header, table)) {
        return Err(damaged("the checksum of its table is wrong"));
    }
    let section = |entry: &[u8]| {
        let name: Vec<u8> = entry.iter().copied().take(NAME).take_while(|letter| *letter != 0).collect();
        let name = String::from_utf8_lossy(&name).into_owned();
        let (begin, length) = (number::<8>(entry, NAME), number::<8>(entry, 24));
        let range = usize::try_from(begin).ok().zip(usize::try_from(begin.saturating_add(length)).ok());
        let range = range.map(|(begin, end)| begin..end);
        let bytes = range.clone().and_then(|range| file.get(range));
        let (Some(range), Some(bytes)) = (range, bytes) else {
            return Err(MeshFileError::damaged(&name, "it lies beyond the end"));
        };
        if range.start % ALIGNMENT != 0 || entry.get(32..) != Some(blake3::hash(bytes).as_bytes()) {
            return Err(MeshFileError::damaged(&name, "its checksum is wrong"));
        }
        Ok((name, range))
    };
    table.chunks_exact(ENTRY).map(section).collect()
}

/// A number of `N` bytes; 0 beyond the end.
fn number<const N: usize>(bytes: &[u8], at: usize) -> u64 {
    let bytes = bytes.get(at..at + N).unwrap_or_default();
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

/// Bytes of a mapped file.
#[derive(Clone)]
pub struct MappedSection {
    map: Arc<MappedFile>,
    range: Range<usize>,
}

impl MappedSection {
    /// The bytes; their place in memory is a multiple of 64.
    #[inline(always)]
    pub fn bytes(&self) -> &[u8] {
        self.map.get(self.range.clone()).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written() -> Vec<u8> {
        let mut writer = SectionsWriter::default();
        writer.value("numbers", &vec![1u32, 2, 3]).unwrap();
        writer.bytes("empty", Vec::new());
        writer.bytes("bytes", (0..200).collect());
        writer.finish()
    }

    fn open(bytes: &[u8]) -> Result<MeshFile, MeshFileError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        MeshFile::open(file.path())
    }

    /// What was written is read again, where numbers can be used without being moved.
    #[test]
    fn sections_come_back() {
        let file = open(&written()).unwrap();
        assert_eq!(file.value::<Vec<u32>>("numbers").unwrap(), [1, 2, 3]);
        let bytes = file.section("bytes").unwrap();
        assert_eq!(bytes.bytes(), (0..200).collect::<Vec<u8>>());
        assert_eq!(bytes.bytes().as_ptr().align_offset(ALIGNMENT), 0);
        assert!(file.section("empty").unwrap().bytes().is_empty() && file.section("other").is_none());
        assert!(file.value::<(u64, u64)>("numbers").is_err());
    }

    /// No bit of a file can change, and no byte be lost or added, without an error. The few bytes of padding carry nothing.
    #[test]
    fn damage_is_found() {
        let whole = written();
        let last = HEADER + 3 * ENTRY;
        let filled = |at: usize| at < 56 || (HEADER..last + 4).contains(&at) || (320..520).contains(&at);
        for at in (0..whole.len()).filter(|at| filled(*at)) {
            for bit in [0, 3, 7] {
                let mut damaged = whole.clone();
                damaged[at] ^= 1 << bit;
                assert!(open(&damaged).is_err(), "bit {bit} of byte {at}");
            }
        }
        for length in (0..whole.len()).step_by(7) {
            assert!(open(&whole[..length]).is_err(), "cut at {length}");
        }
        assert!(open(&[&whole[..], &[0]].concat()).is_err());
        assert!(matches!(open(&[7; 1000]), Err(MeshFileError::Foreign)));
        let mut newer = whole;
        newer[8] = VERSION as u8 + 1;
        assert!(matches!(open(&newer), Err(MeshFileError::Version { found }) if found == VERSION + 1));
    }
}
