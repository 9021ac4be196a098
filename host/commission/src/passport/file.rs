//! The file of a passport: TOML with comments, for people as much as for programs.

mod read;
mod write;

use std::fmt;

use thiserror::Error;

use super::Passport;

/// Why a text is no passport.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub struct FileError {
    text: String,
}

impl fmt::Display for FileError {
    /// Several lines: what is wrong, and the line where it stands.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Passport {
    /// The text of its file. What [`parse`](Self::parse) makes of it is this passport again.
    #[must_use]
    pub fn to_toml(&self) -> String {
        write::write(self)
    }

    /// Reads the text of a file, which people may have edited.
    ///
    /// # Errors
    /// [`FileError`] with the line: no TOML, a key that a passport does not have, a value that
    /// cannot be, another [`FORMAT`](super::FORMAT), parameters that contradict the settings.
    pub fn parse(text: &str) -> Result<Self, FileError> {
        read::read(text)
    }
}
