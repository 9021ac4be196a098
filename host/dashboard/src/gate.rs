//! Who is let in: what a request must have before anybody looks at what it wants.
//!
//! Any page that a browser of this machine shows can send requests to any port of this machine. So
//! being on loopback is no protection by itself: `Host` keeps off pages whose name was pointed at
//! this machine (DNS rebinding), `Origin` and `Sec-Fetch-Site` those of other sites, and
//! `Content-Type` what a form could send.

use std::net::{IpAddr, SocketAddr};

use axum::http::header::{AUTHORIZATION, CONTENT_TYPE, COOKIE, HOST, HeaderName, ORIGIN};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, Method, StatusCode, Uri};

use crate::problem::Problem;
use crate::settings::Token;

const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// What a request must have.
#[derive(Debug)]
pub(crate) struct Gate {
    address: SocketAddr,
    token: Option<Token>,
    read_only: bool,
}

/// What becomes of a request that is let in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Pass {
    /// It is answered.
    Answer,
    /// The browser shows the token in the address: it gets this cookie, and is sent on without.
    TakeCookie(String),
}

impl Gate {
    /// The gate of a server that listens on `address`.
    pub(crate) const fn new(address: SocketAddr, token: Option<Token>, read_only: bool) -> Self {
        Self { address, token, read_only }
    }

    pub(crate) const fn is_read_only(&self) -> bool {
        self.read_only
    }

    /// Whether a request is let in.
    ///
    /// # Errors
    /// The [`Problem`] it is answered with.
    pub(crate) fn judge(
        &self,
        method: &Method,
        uri: &Uri,
        headers: &HeaderMap,
    ) -> Result<Pass, Problem> {
        let host = self.host(uri, headers)?;
        refuse_other_sites(&host, uri, headers)?;
        let pass = self.known(method, uri, headers)?;
        if is_writing(method) {
            if self.read_only {
                return Err(Problem::new(
                    "read-only",
                    StatusCode::FORBIDDEN,
                    "This plant is only shown",
                    format!(
                        "{method} {}: the program was started with --read-only; start it without \
                         to change anything",
                        uri.path()
                    ),
                ));
            }
            refuse_forms(method, headers)?;
        }
        Ok(pass)
    }

    /// The `Host` of the request, which is ours.
    fn host(&self, uri: &Uri, headers: &HeaderMap) -> Result<Authority, Problem> {
        let mut named = headers.get_all(HOST).iter();
        let host = match (named.next(), named.next()) {
            (Some(host), None) => host.to_str().ok().and_then(|host| host.parse().ok()),
            _ => None,
        };
        let ours = host.filter(|host| self.is_ours(host));
        // A request line may name a host too, which then counts; both must be ours.
        let line_is_ours = uri.authority().is_none_or(|authority| self.is_ours(authority));
        ours.filter(|_| line_is_ours).ok_or_else(|| {
            let asked = headers.get(HOST).map_or("none", |host| host.to_str().unwrap_or("no text"));
            Problem::new(
                "wrong-host",
                StatusCode::MISDIRECTED_REQUEST,
                "This is not the host of that name",
                format!(
                    "the request is for the host {asked:?}; this is {}: ask for \
                     http://{}/ and, through a tunnel, keep the port",
                    self.address,
                    self.shown()
                ),
            )
        })
    }

    /// A loopback name, or where it listens; and the port.
    fn is_ours(&self, authority: &Authority) -> bool {
        let host = authority.host();
        let address = host.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>().ok();
        // An address cannot be pointed elsewhere, as a name can.
        let is_host = host.eq_ignore_ascii_case("localhost")
            || address.is_some_and(|address| {
                address.is_loopback()
                    || address == self.address.ip()
                    || self.address.ip().is_unspecified()
            });
        let port = authority.port_u16().unwrap_or(80);
        is_host && port == self.address.port() && !authority.as_str().contains('@')
    }

    /// Where a browser of this machine finds it.
    fn shown(&self) -> SocketAddr {
        let mut address = self.address;
        if address.ip().is_unspecified() {
            address.set_ip(if address.is_ipv4() {
                std::net::Ipv4Addr::LOCALHOST.into()
            } else {
                std::net::Ipv6Addr::LOCALHOST.into()
            });
        }
        address
    }

    /// Whether whoever asks knows the token, where there is one.
    fn known(&self, method: &Method, uri: &Uri, headers: &HeaderMap) -> Result<Pass, Problem> {
        let Some(token) = &self.token else { return Ok(Pass::Answer) };
        let cookie = self.cookie();
        let in_cookie = texts(headers, &COOKIE)
            .flat_map(|line| line.split(';'))
            .filter_map(|pair| pair.trim().split_once('='))
            .any(|(name, value)| name == cookie && token.is(value));
        let in_header = texts(headers, &AUTHORIZATION).any(|line| {
            line.split_once(' ').is_some_and(|(scheme, value)| {
                scheme.eq_ignore_ascii_case("bearer") && token.is(value.trim())
            })
        });
        let in_address = *method == Method::GET
            && uri.path() == "/"
            && uri.query().is_some_and(|query| {
                query
                    .split('&')
                    .filter_map(|pair| pair.split_once('='))
                    .any(|(name, value)| name == "token" && token.is(value))
            });
        if in_address {
            let token = token.as_str();
            let cookie = format!("{cookie}={token}; Path=/; HttpOnly; SameSite=Strict");
            return Ok(Pass::TakeCookie(cookie));
        }
        if in_cookie || in_header {
            return Ok(Pass::Answer);
        }
        Err(Problem::new(
            "no-token",
            StatusCode::UNAUTHORIZED,
            "The token is missing or wrong",
            format!(
                "{method} {}: whoever asks must know the token that the program was started with; \
                 open /?token=TOKEN once, or send `Authorization: Bearer TOKEN`",
                uri.path()
            ),
        ))
    }

    /// Cookies are the same for all ports of a host, so their name tells ours.
    fn cookie(&self) -> String {
        format!("codewheel-{}", self.address.port())
    }
}

fn texts<'a>(headers: &'a HeaderMap, name: &HeaderName) -> impl Iterator<Item = &'a str> {
    headers.get_all(name).iter().filter_map(|value| value.to_str().ok())
}

fn is_writing(method: &Method) -> bool {
    *method != Method::GET && *method != Method::HEAD
}

/// Refuses what a page of another site has sent.
fn refuse_other_sites(host: &Authority, uri: &Uri, headers: &HeaderMap) -> Result<(), Problem> {
    let foreign = |what: String| {
        Problem::new(
            "foreign-origin",
            StatusCode::FORBIDDEN,
            "Another site has sent this",
            format!("{}: {what}; use the page of this plant, or a program", uri.path()),
        )
    };
    let ours = format!("http://{host}");
    let mut origins = headers.get_all(ORIGIN).iter();
    if let Some(origin) = origins
        .find(|origin| !origin.to_str().is_ok_and(|origin| origin.eq_ignore_ascii_case(&ours)))
    {
        return Err(foreign(format!("it comes from {origin:?}, and only {ours} may ask")));
    }
    // Whoever types an address or follows a link gets the page, but nothing of the plant.
    let is_api = uri.path().starts_with("/api/");
    let mut sites = headers.get_all(SEC_FETCH_SITE).iter();
    match sites.find(|site| is_api && !matches!(site.as_bytes(), b"same-origin" | b"none")) {
        Some(site) => Err(foreign(format!("the browser says that it is {site:?}"))),
        None => Ok(()),
    }
}

/// Refuses what a form of another site could send without being asked for.
fn refuse_forms(method: &Method, headers: &HeaderMap) -> Result<(), Problem> {
    // Browsers ask before they send a DELETE of another site, and get no leave.
    if *method == Method::DELETE {
        return Ok(());
    }
    let kind = texts(headers, &CONTENT_TYPE).next().unwrap_or("");
    let essence = kind.split(';').next().unwrap_or("").trim();
    if essence.eq_ignore_ascii_case("application/json") {
        return Ok(());
    }
    let what = if kind.is_empty() { "nothing".to_owned() } else { format!("{kind:?}") };
    Err(Problem::new(
        "content-type",
        StatusCode::UNSUPPORTED_MEDIA_TYPE,
        "The content type is wrong",
        format!("the request says that it holds {what}; send `Content-Type: application/json`"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    const TOKEN: &str = "0123456789abcdef";

    fn gate(address: &str) -> Gate {
        Gate::new(address.parse().expect("an address"), None, false)
    }

    fn judge(gate: &Gate, method: Method, uri: &str, lines: &[(&str, &str)]) -> Result<Pass, u16> {
        let mut headers = HeaderMap::new();
        for (name, value) in lines {
            headers.append(
                HeaderName::from_bytes(name.as_bytes()).expect("a name"),
                HeaderValue::from_str(value).expect("a value"),
            );
        }
        gate.judge(&method, &uri.parse().expect("a URI"), &headers)
            .map_err(|problem| problem.status().as_u16())
    }

    fn read(gate: &Gate, lines: &[(&str, &str)]) -> Result<Pass, u16> {
        judge(gate, Method::GET, "/api/v1/plant", lines)
    }

    fn write(gate: &Gate, lines: &[(&str, &str)]) -> Result<Pass, u16> {
        let json = ("content-type", "application/json; charset=utf-8");
        judge(gate, Method::POST, "/api/v1/x", &[&[json], lines].concat())
    }

    #[test]
    fn loopback_names_with_the_right_port_are_let_in() {
        let gate = gate("127.0.0.1:8080");
        for host in ["127.0.0.1:8080", "localhost:8080", "LOCALHOST:8080", "[::1]:8080"] {
            assert_eq!(read(&gate, &[("host", host)]), Ok(Pass::Answer), "{host}");
        }
    }

    #[test]
    fn a_name_that_was_pointed_at_this_machine_is_misdirected() {
        let gate = gate("127.0.0.1:8080");
        for host in [
            "evil.example:8080",
            "127.0.0.1",
            "127.0.0.1:80",
            "localhost:8081",
            "localhost.evil.example:8080",
            "192.168.1.5:8080",
            "someone@localhost:8080",
            "",
        ] {
            assert_eq!(read(&gate, &[("host", host)]), Err(421), "{host}");
        }
        assert_eq!(read(&gate, &[]), Err(421));
        let both = [("host", "localhost:8080"), ("host", "evil.example:8080")];
        assert_eq!(read(&gate, &both), Err(421));
        let absolute = "http://evil.example:8080/api/v1/plant";
        let line = judge(&gate, Method::GET, absolute, &[("host", "localhost:8080")]);
        assert_eq!(line, Err(421));
    }

    #[test]
    fn beyond_loopback_addresses_are_let_in_and_names_are_not() {
        let everywhere = gate("0.0.0.0:8080");
        assert_eq!(read(&everywhere, &[("host", "192.168.1.5:8080")]), Ok(Pass::Answer));
        assert_eq!(read(&everywhere, &[("host", "evil.example:8080")]), Err(421));
        let one = gate("192.168.1.5:8080");
        assert_eq!(read(&one, &[("host", "192.168.1.5:8080")]), Ok(Pass::Answer));
        assert_eq!(read(&one, &[("host", "192.168.1.6:8080")]), Err(421));
        let web = gate("127.0.0.1:80");
        assert_eq!(read(&web, &[("host", "localhost")]), Ok(Pass::Answer));
    }

    #[test]
    fn another_origin_is_refused_for_reading_and_writing() {
        let gate = gate("127.0.0.1:8080");
        let host = ("host", "localhost:8080");
        for origin in [
            "http://evil.example",
            "http://localhost:3000",
            "https://localhost:8080",
            "http://127.0.0.1:8080",
            "null",
        ] {
            assert_eq!(read(&gate, &[host, ("origin", origin)]), Err(403), "{origin}");
            assert_eq!(write(&gate, &[host, ("origin", origin)]), Err(403), "{origin}");
        }
        let ours = ("origin", "http://localhost:8080");
        assert_eq!(read(&gate, &[host, ours]), Ok(Pass::Answer));
        assert_eq!(write(&gate, &[host, ours]), Ok(Pass::Answer));
        assert_eq!(write(&gate, &[host]), Ok(Pass::Answer), "a program sends no origin");
    }

    #[test]
    fn what_a_browser_calls_cross_site_reaches_the_page_and_not_the_plant() {
        let gate = gate("127.0.0.1:8080");
        let host = ("host", "localhost:8080");
        for site in ["cross-site", "same-site"] {
            let lines = [host, ("sec-fetch-site", site)];
            assert_eq!(read(&gate, &lines), Err(403));
            assert_eq!(write(&gate, &lines), Err(403));
            assert_eq!(judge(&gate, Method::GET, "/", &lines), Ok(Pass::Answer), "a link");
        }
        for site in ["same-origin", "none"] {
            assert_eq!(write(&gate, &[host, ("sec-fetch-site", site)]), Ok(Pass::Answer));
        }
    }

    #[test]
    fn what_a_form_can_send_is_refused() {
        let gate = gate("127.0.0.1:8080");
        let host = ("host", "localhost:8080");
        for kind in ["text/plain", "application/x-www-form-urlencoded", "application/jsonx", ""] {
            for method in [Method::POST, Method::PUT] {
                let lines = [host, ("content-type", kind)];
                assert_eq!(judge(&gate, method, "/api/v1/x", &lines), Err(415), "{kind}");
            }
        }
        assert_eq!(judge(&gate, Method::POST, "/api/v1/x", &[host]), Err(415));
        assert_eq!(judge(&gate, Method::DELETE, "/api/v1/x", &[host]), Ok(Pass::Answer));
    }

    #[test]
    fn read_only_refuses_whatever_is_not_reading() {
        let gate = Gate::new("127.0.0.1:8080".parse().expect("an address"), None, true);
        let host = ("host", "localhost:8080");
        assert_eq!(read(&gate, &[host]), Ok(Pass::Answer));
        assert_eq!(write(&gate, &[host]), Err(403));
        for method in [Method::DELETE, Method::PUT, Method::PATCH, Method::OPTIONS] {
            assert_eq!(judge(&gate, method, "/api/v1/x", &[host]), Err(403));
        }
    }

    #[test]
    fn the_token_comes_in_a_header_a_cookie_or_once_in_the_address() {
        let token = TOKEN.parse().expect("a token");
        let gate = Gate::new("0.0.0.0:8080".parse().expect("an address"), Some(token), false);
        let host = ("host", "192.168.1.5:8080");
        assert_eq!(read(&gate, &[host]), Err(401));
        assert_eq!(judge(&gate, Method::GET, "/", &[host]), Err(401), "the page neither");
        for (name, value) in [
            ("authorization", "Bearer 0123456789abcdef"),
            ("authorization", "bearer 0123456789abcdef"),
            ("cookie", "other=1; codewheel-8080=0123456789abcdef"),
        ] {
            assert_eq!(read(&gate, &[host, (name, value)]), Ok(Pass::Answer), "{value}");
        }
        for (name, value) in [
            ("authorization", "Bearer 0123456789abcdee"),
            ("authorization", "Basic 0123456789abcdef"),
            ("cookie", "codewheel-8081=0123456789abcdef"),
            ("cookie", "codewheel-8080="),
        ] {
            assert_eq!(read(&gate, &[host, (name, value)]), Err(401), "{value}");
        }
        let address = format!("/?token={TOKEN}");
        let cookie = format!("codewheel-8080={TOKEN}; Path=/; HttpOnly; SameSite=Strict");
        assert_eq!(judge(&gate, Method::GET, &address, &[host]), Ok(Pass::TakeCookie(cookie)));
        assert_eq!(judge(&gate, Method::GET, "/?token=wrong", &[host]), Err(401));
        let api = format!("/api/v1/plant?token={TOKEN}");
        assert_eq!(judge(&gate, Method::GET, &api, &[host]), Err(401), "only once, at the door");
    }
}
