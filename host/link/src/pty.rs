//! A serial port made of software, which programs find at a path.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::fd::AsRawFd;
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::{OpenOptionsExt, symlink};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mio::unix::SourceFd;
use mio::{Interest, Token};
use rustix::fs::OFlags;
use rustix::io::{FdFlags, fcntl_setfd, ioctl_fionbio, ioctl_fionread};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

use crate::LinkError;
use crate::socket::Watch;

/// Octets that a program may leave unread: what surely fits into the buffer of a pty, 4095 octets
/// on Linux and 1024 on macOS.
const UNREAD: u64 = 1000;

/// How long octets wait to be read. A program that opens the port later is not to find them.
const STALE: Duration = Duration::from_secs(1);

/// Our side of a pty. Reading and writing do not wait.
#[derive(Debug)]
pub(crate) struct Pty {
    master: File,
    held: File,
    name: Name,
    /// How many octets may be unread at most.
    unread: u64,
    /// When something was sent that may still be unread.
    last_sent: Option<Instant>,
}

impl Pty {
    /// Makes a pty, puts its name at `path`, and has `watch` watch our side as `token`.
    pub(crate) fn make(path: &Path, watch: &Watch, token: Token) -> Result<Self, LinkError> {
        let failed = |reason| LinkError::Device { path: path.to_owned(), reason };
        let master =
            openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).map_err(|e| failed(e.into()))?;
        let name = (|| {
            grantpt(&master)?;
            unlockpt(&master)?;
            ioctl_fionbio(&master, true)?;
            fcntl_setfd(&master, FdFlags::CLOEXEC)?;
            ptsname(&master, Vec::new())
        })();
        let name = name.map_err(|error| failed(error.into()))?;
        let name = PathBuf::from(OsString::from_vec(name.into_bytes()));
        let master = File::from(master);
        let held = hold(&name).map_err(failed)?;
        let interest = Interest::READABLE | Interest::WRITABLE;
        watch
            .registry()
            .register(&mut SourceFd(&master.as_raw_fd()), token, interest)
            .map_err(LinkError::System)?;
        let name = Name::put(path, name)?;
        Ok(Self { master, held, name, unread: 0, last_sent: None })
    }

    /// Where programs find it.
    pub(crate) fn path(&self) -> &Path {
        &self.name.path
    }

    /// Throws away what was sent long ago and nobody has read; gives whether there may have been
    /// such. Who asks now is not to take the answer to somebody who is gone for its own.
    pub(crate) fn forget_stale(&mut self) -> bool {
        let is_stale = self.last_sent.take_if(|sent| sent.elapsed() > STALE).is_some();
        if is_stale {
            self.throw_away();
        }
        is_stale
    }

    /// Makes room for `length` octets that are about to be written; gives whether something was
    /// thrown away for them.
    pub(crate) fn make_room(&mut self, length: usize) -> bool {
        let length = length as u64;
        if self.unread + length > UNREAD {
            self.count_unread();
        }
        let is_full = self.unread + length > UNREAD;
        if is_full {
            self.throw_away();
        }
        self.unread += length;
        self.last_sent = Some(Instant::now());
        is_full
    }

    /// Asks how many octets no program has fetched yet.
    fn count_unread(&mut self) {
        self.unread = ioctl_fionread(&self.held).unwrap_or_default();
    }

    fn throw_away(&mut self) {
        // What is under way to the programs' side, then what lies there. Where this fails they are
        // read late, which every reader of a line must bear.
        let _ = tcflush(&self.master, QueueSelector::OFlush);
        let _ = tcflush(&self.held, QueueSelector::IFlush);
        self.unread = 0;
    }
}

/// Opens the side of the programs, so that the line does not end when one of them closes it, and
/// makes it pass octets as they are.
fn hold(name: &Path) -> io::Result<File> {
    let flags = OFlags::NOCTTY.bits().cast_signed();
    let held = OpenOptions::new().read(true).write(true).custom_flags(flags).open(name)?;
    let mut settings = tcgetattr(&held)?;
    settings.make_raw();
    tcsetattr(&held, OptionalActions::Now, &settings)?;
    Ok(held)
}

impl Read for Pty {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.master.read(buffer)
    }
}

impl Write for Pty {
    fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
        self.master.write(octets)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A symbolic link to the programs' side, for as long as it is there.
#[derive(Debug)]
struct Name {
    path: PathBuf,
    device: PathBuf,
}

impl Name {
    /// Puts a link to `device` at `path`, where nothing is or a link that leads nowhere, as a
    /// program leaves it that was killed, or that leads to `device` already.
    fn put(path: &Path, device: PathBuf) -> Result<Self, LinkError> {
        let taken = |reason| LinkError::Name { path: path.to_owned(), reason };
        match fs::read_link(path) {
            Ok(target) if target == device || leads_nowhere(path) => {
                fs::remove_file(path).map_err(|error| taken(error.to_string()))?;
            }
            Ok(target) => {
                return Err(taken(format!("a link to {} is there", target.display())));
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(_) => return Err(taken("a file is there that is no link".to_owned())),
        }
        symlink(&device, path).map_err(|error| taken(error.to_string()))?;
        Ok(Self { path: path.to_owned(), device })
    }
}

fn leads_nowhere(path: &Path) -> bool {
    fs::metadata(path).is_err_and(|error| error.kind() == io::ErrorKind::NotFound)
}

impl Drop for Name {
    fn drop(&mut self) {
        // Another may have put its own name there meanwhile.
        if fs::read_link(&self.path).is_ok_and(|target| target == self.device) {
            let _ = fs::remove_file(&self.path);
        }
    }
}
