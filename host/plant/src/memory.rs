//! The non-volatile memory of an encoder as a file: two records, one behind the other.
//!
//! A record is written to the place that is not in use and reaches the disk before it counts, so
//! after any interruption the old or the new one is there. A damaged file is never written over:
//! it is set aside under another name.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use codewheel_device::Product;
use codewheel_encoder::{Kept, RECORD_OCTETS, Slot, Start, choose, encode};
use thiserror::Error;

/// Why a memory file cannot be used.
#[derive(Debug, Error)]
pub enum MemoryError {
    /// The file cannot be opened, read or written.
    #[error("cannot {attempt} the memory file {}: {reason}; name a file that can be read and \
             written, or leave the memory out", .path.display())]
    Io {
        /// What was tried.
        attempt: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: io::Error,
    },
    /// Another program uses the file.
    #[error("the memory file {} is in use by another encoder; name a file of its own for each",
            .path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// The file was kept by another product.
    #[error("the memory file {} belongs to {owner}, this is {product}; name another file, or that \
             model", .path.display())]
    AnotherProduct {
        /// The file.
        path: PathBuf,
        /// The model that wrote it.
        owner: String,
        /// The model that was asked for.
        product: &'static str,
    },
}

/// What a memory file held when it was opened.
#[derive(Debug)]
pub struct Found {
    /// What the device starts with.
    pub start: Start,
    /// Where a damaged file was put.
    pub set_aside: Option<PathBuf>,
}

/// An open memory file, locked against other encoders.
#[derive(Debug)]
pub struct MemoryFile {
    path: PathBuf,
    file: File,
    next: (Slot, u32),
}

/// What a place holds before anything was written to it.
const BLANK: [u8; RECORD_OCTETS] = [0xFF; RECORD_OCTETS];

impl MemoryFile {
    /// Opens the memory of `product` at `path`; a file that does not exist is made, blank. A
    /// damaged one is renamed and a blank one takes its place.
    ///
    /// # Errors
    /// [`MemoryError`]; nothing has been changed then.
    pub fn open(path: &Path, product: &Product) -> Result<(Self, Found), MemoryError> {
        let error =
            |attempt| move |reason| MemoryError::Io { attempt, path: path.to_owned(), reason };
        let mut file = open_locked(path)?;
        let mut octets = Vec::new();
        // A file many times too long is none of ours; its beginning tells enough.
        let limit = 4 * RECORD_OCTETS as u64;
        (&mut file).take(limit).read_to_end(&mut octets).map_err(error("read"))?;
        let start = read(&octets);
        if let Start::Kept { kept, .. } = &start
            && kept.fingerprint != product.fingerprint
        {
            let owner = Product::all().find(|other| other.fingerprint == kept.fingerprint);
            return Err(MemoryError::AnotherProduct {
                path: path.to_owned(),
                owner: owner.map_or("a model this version does not know".into(), |owner| {
                    owner.model.into()
                }),
                product: product.model,
            });
        }
        // A whole record with settings that this product cannot measure with is damage too.
        let start = match start {
            Start::Kept { kept, .. } if kept.saved.check(product.encoder).is_err() => {
                Start::Damaged
            }
            start => start,
        };
        let damaged = matches!(start, Start::Damaged | Start::Fresh { interrupted: true });
        let set_aside = if damaged {
            let aside = free_name(path);
            std::fs::rename(path, &aside).map_err(error("set aside"))?;
            file = open_locked(path)?;
            octets.clear();
            Some(aside)
        } else {
            None
        };
        if octets.is_empty() {
            file.write_all(&[BLANK, BLANK].concat())
                .and_then(|()| file.sync_all())
                .map_err(error("write"))?;
        }
        let next = if damaged { Start::Fresh { interrupted: false } } else { start }.next();
        Ok((Self { path: path.to_owned(), file, next }, Found { start, set_aside }))
    }

    /// Writes a record to the place that is not in use and waits until it is on the disk.
    ///
    /// # Errors
    /// [`MemoryError::Io`]; the record kept before is still whole.
    pub fn write(&mut self, kept: &Kept) -> Result<(), MemoryError> {
        let (slot, sequence) = self.next;
        let offset = match slot {
            Slot::A => 0,
            Slot::B => RECORD_OCTETS as u64,
        };
        let octets = encode(kept, sequence);
        self.file
            .seek(SeekFrom::Start(offset))
            .and_then(|_| self.file.write_all(&octets))
            .and_then(|()| self.file.sync_data())
            .map_err(|reason| MemoryError::Io {
                attempt: "write",
                path: self.path.clone(),
                reason,
            })?;
        self.next = (slot.other(), sequence.wrapping_add(1));
        Ok(())
    }
}

fn open_locked(path: &Path) -> Result<File, MemoryError> {
    let io = |reason| MemoryError::Io { attempt: "open", path: path.to_owned(), reason };
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)
        .map_err(io)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(MemoryError::InUse { path: path.to_owned() }),
        // A file system that knows no locks is no reason to refuse work.
        Err(TryLockError::Error(reason)) if reason.kind() == io::ErrorKind::Unsupported => Ok(file),
        Err(TryLockError::Error(reason)) => Err(io(reason)),
    }
}

/// What the octets of a memory file say. Whatever is neither blank nor two places long was not
/// written by us.
fn read(octets: &[u8]) -> Start {
    let (a, rest) = octets.split_at(octets.len().min(RECORD_OCTETS));
    let start = choose(a, rest.get(..RECORD_OCTETS).unwrap_or(rest));
    let whole = octets.is_empty() || octets.len() == 2 * RECORD_OCTETS;
    match start {
        Start::Fresh { .. } if !whole => Start::Damaged,
        start => start,
    }
}

/// The first name `PATH.damaged`, `PATH.damaged-2`, … that is free.
fn free_name(path: &Path) -> PathBuf {
    let name = |count: u32| {
        let mut name = path.as_os_str().to_owned();
        name.push(".damaged");
        if count > 1 {
            name.push(format!("-{count}"));
        }
        PathBuf::from(name)
    };
    (1..).map(name).find(|name| !name.exists()).unwrap_or_else(|| name(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_encoder::Block;

    fn product(model: &str) -> &'static Product {
        Product::find(model).expect("in the catalogue")
    }

    fn kept(product: &Product, serial: u32) -> Kept {
        Kept {
            fingerprint: product.fingerprint,
            saved: Block::default_for(product.encoder),
            reference: None,
            serial,
            writes: 1,
            bus: [0; 24],
        }
    }

    fn serial(found: &Found) -> Option<u32> {
        match found.start {
            Start::Kept { kept, .. } => Some(kept.serial),
            _ => None,
        }
    }

    #[test]
    fn what_was_written_last_is_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("memory");
        let product = product("amg11-d29");
        for count in 1..6 {
            let (mut memory, found) = MemoryFile::open(&path, product).unwrap();
            assert_eq!(serial(&found), (count > 1).then_some(count * 10 - 10));
            assert!(found.set_aside.is_none());
            memory.write(&kept(product, count * 10 - 1)).unwrap();
            memory.write(&kept(product, count * 10)).unwrap();
        }
        assert_eq!(std::fs::metadata(&path).unwrap().len(), 2 * RECORD_OCTETS as u64);
    }

    #[test]
    fn a_damaged_file_is_set_aside_and_never_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("memory");
        let product = product("amg11-d29");
        for (count, content) in
            [&b"dear diary"[..], &[7; 2 * RECORD_OCTETS], &[0xFF; 5]].iter().enumerate()
        {
            std::fs::write(&path, content).unwrap();
            let (mut memory, found) = MemoryFile::open(&path, product).unwrap();
            assert_eq!(found.start, Start::Damaged);
            let aside = found.set_aside.expect("a new name");
            assert_eq!(&std::fs::read(&aside).unwrap(), content);
            memory.write(&kept(product, 5)).unwrap();
            drop(memory);
            let (memory, found) = MemoryFile::open(&path, product).unwrap();
            assert_eq!(serial(&found), Some(5));
            drop(memory);
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), count + 2);
        }
    }

    #[test]
    fn settings_the_product_cannot_measure_with_are_damage() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("memory");
        let product = product("amg11-d29");
        let (mut memory, _) = MemoryFile::open(&path, product).unwrap();
        let mut kept = kept(product, 1);
        kept.saved.settings.steps_per_turn = 8_193;
        memory.write(&kept).unwrap();
        drop(memory);
        let (_memory, found) = MemoryFile::open(&path, product).unwrap();
        assert_eq!(found.start, Start::Damaged);
        assert!(found.set_aside.is_some());
    }

    #[test]
    fn a_file_of_another_product_is_refused_and_stays_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("memory");
        let (owner, other) = (product("amg81-d29"), product("hmg10-d13"));
        let (mut memory, _) = MemoryFile::open(&path, owner).unwrap();
        memory.write(&kept(owner, 5)).unwrap();
        drop(memory);
        let before = std::fs::read(&path).unwrap();
        let error = MemoryFile::open(&path, other).unwrap_err().to_string();
        assert!(error.contains("belongs to amg81-d29, this is hmg10-d13"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), before);
    }

    #[test]
    fn two_encoders_never_share_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("memory");
        let _memory = MemoryFile::open(&path, product("amg11-d29")).unwrap();
        let error = MemoryFile::open(&path, product("amg11-d29")).unwrap_err();
        assert!(matches!(error, MemoryError::InUse { .. }), "{error}");
    }

    #[test]
    fn a_folder_or_a_missing_folder_is_an_error_that_names_it() {
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().to_owned(), folder.path().join("none/memory")] {
            let error = MemoryFile::open(&path, product("amg11-d29")).unwrap_err().to_string();
            assert!(error.contains(&path.display().to_string()), "{error}");
        }
    }

    #[test]
    fn a_write_cut_at_any_octet_leaves_the_old_or_the_new_record() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("memory");
        let product = product("amg11-d29");
        let (mut memory, _) = MemoryFile::open(&path, product).unwrap();
        memory.write(&kept(product, 1)).unwrap();
        let before = std::fs::read(&path).unwrap();
        memory.write(&kept(product, 2)).unwrap();
        drop(memory);
        let after = std::fs::read(&path).unwrap();
        for cut in 0..=RECORD_OCTETS {
            let mut octets = before.clone();
            let end = RECORD_OCTETS + cut;
            octets[RECORD_OCTETS..end].copy_from_slice(&after[RECORD_OCTETS..end]);
            let Start::Kept { kept, .. } = read(&octets) else { panic!("cut after {cut}") };
            assert_eq!(kept.serial, if cut == RECORD_OCTETS { 2 } else { 1 });
        }
    }
}
