//! Where the page is, and who may see it and change the plant.

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::str::FromStr;

use subtle::ConstantTimeEq;
use thiserror::Error;

/// Where the page is, and who may do what.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// What the page calls the plant, such as the name of its file.
    pub name: String,
    /// Where it listens; port 0 is any free one. `None`: 127.0.0.1:8080, or any free port of
    /// 127.0.0.1 where that one is taken.
    pub listen: Option<SocketAddr>,
    /// What whoever asks must know; needed where others than this machine can ask.
    pub token: Option<Token>,
    /// Nobody may change anything.
    pub read_only: bool,
}

/// What whoever asks must know: 16 to 128 letters, digits, `-`, `.`, `_` or `~`.
#[derive(Clone)]
pub struct Token(String);

/// A text that is no token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "a token has 16 to 128 characters, letters, digits and -._~ only, so that it cannot be guessed \
     and stands in an address: `openssl rand -hex 16` makes one"
)]
pub struct NoToken;

impl FromStr for Token {
    type Err = NoToken;

    fn from_str(text: &str) -> Result<Self, NoToken> {
        let allowed = |octet: u8| octet.is_ascii_alphanumeric() || b"-._~".contains(&octet);
        let fits = (16..=128).contains(&text.len()) && text.bytes().all(allowed);
        fits.then(|| Self(text.to_owned())).ok_or(NoToken)
    }
}

impl fmt::Debug for Token {
    /// Never itself: what is printed for debugging ends up in logs.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(…)")
    }
}

impl Token {
    /// Whether `text` is the token, in a time that does not tell how much of it is right.
    pub(crate) fn is(&self, text: &str) -> bool {
        self.0.as_bytes().ct_eq(text.as_bytes()).into()
    }

    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

/// Why the page cannot be served.
#[derive(Debug, Error)]
pub enum StartError {
    /// Others than this machine could ask, and nothing keeps them off.
    #[error(
        "cannot serve the page on {0}: others than this machine could turn the shafts; give \
         --token TOKEN too (`openssl rand -hex 16` makes one), or listen on 127.0.0.1"
    )]
    NeedsToken(SocketAddr),
    /// The port is not to be had.
    #[error("cannot serve the page on {address}: {reason}; {}", remedy(.reason))]
    Listen {
        /// Where.
        address: SocketAddr,
        /// What the system said.
        reason: io::Error,
    },
    /// The system gives no thread or no timer.
    #[error("cannot start the server of the page: {0}; close other programs, or use --no-page")]
    System(#[from] io::Error),
}

fn remedy(reason: &io::Error) -> &'static str {
    match reason.kind() {
        io::ErrorKind::AddrInUse => {
            "another program listens there: end it, or give another port with --listen"
        }
        io::ErrorKind::AddrNotAvailable => {
            "this machine has no such address: give one of its own with --listen"
        }
        io::ErrorKind::PermissionDenied => "give a port above 1023 with --listen",
        _ => "give another address with --listen, or use --no-page",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_long_and_stands_in_an_address() {
        assert!("0123456789abcdef".parse::<Token>().is_ok());
        for text in
            ["", "0123456789abcde", "0123456789abcde&", "0123456789abcde ", "ä23456789abcdef"]
        {
            assert_eq!(text.parse::<Token>().err(), Some(NoToken), "{text}");
        }
        assert!("a".repeat(129).parse::<Token>().is_err());
    }

    #[test]
    fn a_token_is_known_and_never_printed() {
        let token: Token = "0123456789abcdef".parse().expect("a token");
        assert!(token.is("0123456789abcdef"));
        assert!(!token.is("0123456789abcdeg") && !token.is("0123456789abcdef0") && !token.is(""));
        assert!(!format!("{token:?}").contains("0123"));
    }
}
