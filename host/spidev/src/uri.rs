//! Names of SSI lines, as people write them on a command line or in a file.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use thiserror::Error;

/// The name of an SSI line: which port clocks it.
///
/// Written and read as `spidev:FILE`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SsiUri {
    /// `spidev:FILE`: an SPI controller of Linux, such as `spidev:/dev/spidev0.0`.
    Spidev(PathBuf),
}

/// A text that names no SSI line; its message says what was given and which form there is.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{given:?} names no SSI line{why}: write spidev:FILE, such as spidev:/dev/spidev0.0")]
pub struct InvalidSsiUri {
    given: String,
    why: &'static str,
}

impl FromStr for SsiUri {
    type Err = InvalidSsiUri;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let invalid = |why| InvalidSsiUri { given: text.to_owned(), why };
        match text.split_once(':') {
            Some(("spidev", "")) => Err(invalid(" (the file is missing)")),
            Some(("spidev", file)) => Ok(Self::Spidev(file.into())),
            _ => Err(invalid("")),
        }
    }
}

impl fmt::Display for SsiUri {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spidev(file) => write!(f, "spidev:{}", file.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_read_as_it_is_written() {
        for (text, file) in [
            ("spidev:/dev/spidev0.0", "/dev/spidev0.0"),
            ("spidev:/dev/spi:odd name", "/dev/spi:odd name"),
            ("spidev:spidev1.1", "spidev1.1"),
        ] {
            let uri: SsiUri = text.parse().unwrap();
            assert_eq!(uri, SsiUri::Spidev(file.into()));
            assert_eq!(uri.to_string(), text);
        }
    }

    #[test]
    fn what_names_no_line_is_told_the_form() {
        for text in ["", "spidev", "/dev/spidev0.0", "slcan:/dev/ttyACM0", "SPIDEV:/dev/spidev0.0"]
        {
            let error = text.parse::<SsiUri>().unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("{text:?} names no SSI line: write spi")),
                "{error}"
            );
        }
        let error = "spidev:".parse::<SsiUri>().unwrap_err().to_string();
        assert!(error.contains("(the file is missing): write spidev:FILE"), "{error}");
    }
}
