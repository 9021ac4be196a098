//! The web page of a plant that runs: where it is, and who may see it and change the plant.

use std::ffi::OsString;
use std::net::SocketAddr;
use std::sync::Arc;

use clap::Args;
use codewheel_dashboard::{Dashboard, Port, Settings, Token};
use codewheel_plant::Running;

use crate::arguments::Chatter;
use crate::failure::Failure;

/// The variable with the token.
const TOKEN: &str = "CODEWHEEL_TOKEN";

/// Where the page is, and who may do what.
#[derive(Args, Debug, Default)]
#[command(next_help_heading = "Web page")]
pub(crate) struct PageArguments {
    /// Where the page is served, such as 127.0.0.1:9000 or 0.0.0.0:8080; by default
    /// 127.0.0.1:8080, or a free port where that one is taken
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = parse_address)]
    listen: Option<SocketAddr>,

    /// What whoever opens the page must know, 16 characters or more; needed where other machines
    /// can reach it. Open http://ADDRESS:PORT/?token=TOKEN once. All users of this machine can see
    /// arguments; the variable CODEWHEEL_TOKEN, which is read without --token, is yours alone
    #[arg(long)]
    token: Option<Token>,

    /// Show the plant on the page, and let nobody change it there
    #[arg(long)]
    read_only: bool,

    /// Serve no page
    #[arg(long, conflicts_with_all = ["listen", "token", "read_only"])]
    no_page: bool,
}

impl PageArguments {
    /// The first option that was given, as it is written.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let given = [
            (self.listen.is_some(), "--listen"),
            (self.token.is_some(), "--token"),
            (self.read_only, "--read-only"),
            (self.no_page, "--no-page"),
        ];
        given.into_iter().find_map(|(is_given, option)| is_given.then_some(option))
    }

    /// Takes the port for the page of a plant called `name`, before anything is started; `None`
    /// where no page is wanted.
    ///
    /// # Errors
    /// A page that was asked for and cannot be served. One that nobody asked for is left out, and
    /// that is said.
    pub(crate) fn port(&self, name: &str) -> Result<Option<Port>, Failure> {
        if self.no_page {
            return Ok(None);
        }
        let token = match &self.token {
            Some(token) => Some(token.clone()),
            None => token_of(std::env::var_os(TOKEN))?,
        };
        let settings = Settings {
            name: name.to_owned(),
            listen: self.listen,
            token,
            read_only: self.read_only,
        };
        match Port::take(settings) {
            Ok(port) => Ok(Some(port)),
            Err(error) if self.given().is_some() => Err(error.into()),
            Err(error) => {
                eprintln!("codewheel: {error}");
                Ok(None)
            }
        }
    }
}

/// Serves the page of `plant` at `port`, and says where it is.
///
/// # Errors
/// The system has no thread for it.
pub(crate) fn serve(
    plant: &Arc<Running>,
    port: Port,
    chatter: Chatter,
) -> Result<Dashboard, Failure> {
    let page = Dashboard::serve(Arc::clone(plant), port)?;
    if chatter > Chatter::Quiet {
        eprintln!("codewheel: page http://{}", page.address());
    }
    Ok(page)
}

/// The token that [`TOKEN`] holds; an empty one is none.
///
/// # Errors
/// It cannot be a token. A page without it would be open to more people than was meant.
fn token_of(variable: Option<OsString>) -> Result<Option<Token>, Failure> {
    let Some(text) = variable.filter(|text| !text.is_empty()) else { return Ok(None) };
    let token = text.to_str().unwrap_or_default().parse();
    token.map(Some).map_err(|error| Failure::Usage(format!("cannot use {TOKEN}: {error}")))
}

fn parse_address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| {
        "write an address and a port, such as 127.0.0.1:9000, [::1]:8080 or 0.0.0.0:8080".to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_comes_from_the_environment_unless_it_cannot_be_one() {
        assert!(token_of(None).unwrap().is_none() && token_of(Some("".into())).unwrap().is_none());
        assert!(token_of(Some("0123456789abcdef".into())).unwrap().is_some());
        let failure = token_of(Some("short".into())).expect_err("too short");
        let text = failure.to_string();
        assert!(text.contains("CODEWHEEL_TOKEN") && !text.contains("short"), "{text}");
    }
}
