//! Files that a verb makes into a folder.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::failure::Failure;

/// Puts `files` into `folder`, as [`put`] does, and prints where each of them is.
pub(crate) fn keep(
    folder: &Path,
    files: &[(impl AsRef<str>, impl AsRef<[u8]>)],
    force: bool,
) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    for path in put(folder, files, force)? {
        writeln!(out, "{}", path.display())?;
    }
    Ok(())
}

/// Puts `files`, each a name and its text, into `folder`, which is made where it is missing, and says
/// where each of them is.
///
/// A file that is there already and says the same is left alone; one that says something else is
/// replaced only by `force`. Where one may not be replaced, none is written.
pub(crate) fn put(
    folder: &Path,
    files: &[(impl AsRef<str>, impl AsRef<[u8]>)],
    force: bool,
) -> Result<Vec<PathBuf>, Failure> {
    let mut different = Vec::new();
    for (name, text) in files {
        let path = folder.join(name.as_ref());
        let failed = |reason| Failure::File { path: path.clone(), reason };
        match fs::read(&path) {
            Ok(there) if there == text.as_ref() => {}
            Ok(_) if !force => {
                return Err(Failure::Usage(format!(
                    "{} is there already and says something else; nothing was written: look at \
                     what it is, and add --force to replace it",
                    path.display()
                )));
            }
            Err(reason) if reason.kind() != io::ErrorKind::NotFound => return Err(failed(reason)),
            _ => different.push((path, text.as_ref())),
        }
    }
    let failed = |path: &Path, reason| Failure::File { path: path.to_owned(), reason };
    fs::create_dir_all(folder).map_err(|reason| failed(folder, reason))?;
    for (path, text) in different {
        write(folder, &path, text).map_err(|reason| failed(&path, reason))?;
    }
    Ok(files.iter().map(|(name, _)| folder.join(name.as_ref())).collect())
}

/// Writes the file whole or not at all, whatever was there.
pub(crate) fn replace(path: &Path, text: &[u8]) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    write(folder.unwrap_or(Path::new(".")), path, text)
}

/// Writes the file whole or not at all.
fn write(folder: &Path, path: &Path, text: &[u8]) -> io::Result<()> {
    let mut file = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any file is made; the umask takes away what it should not have.
        file.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut file = file.tempfile_in(folder)?;
    file.write_all(text)?;
    file.persist(path)?;
    Ok(())
}
