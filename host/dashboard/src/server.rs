//! The server: a thread with a runtime of its own, so that no bus ever waits for a page.

use std::fmt;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use axum::Router;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, SET_COOKIE};
use axum::http::{HeaderName, HeaderValue, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use codewheel_plant::Running;
use tokio::sync::oneshot;
use utoipa::openapi::{InfoBuilder, OpenApi};

use crate::api::{self, BODY};
use crate::assets;
use crate::connections;
use crate::feed::Feed;
use crate::gate::{Gate, Pass};
use crate::problem::Problem;
use crate::{Settings, StartError};

/// Where the page is when nobody says where.
const USUAL: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), 8080);

/// Commands and questions that wait for their buses at the same time: one for each stream of events,
/// and as many besides.
const WAITING: usize = 64;

/// How long a page that closes waits for commands under way. Their buses end them a moment later.
const PATIENCE: Duration = Duration::from_millis(300);

/// What browsers are told with each answer.
const HEADERS: [(HeaderName, &str); 5] = [
    (
        HeaderName::from_static("content-security-policy"),
        "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'self'",
    ),
    (HeaderName::from_static("x-content-type-options"), "nosniff"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("referrer-policy"), "no-referrer"),
];

/// The page of a running plant. Dropping it closes the page and leaves the plant running.
pub struct Dashboard {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// What all requests share.
pub(crate) struct Shared {
    pub(crate) plant: Arc<Running>,
    pub(crate) feed: Feed,
    pub(crate) gate: Gate,
    pub(crate) name: String,
    pub(crate) openapi: OpenApi,
}

impl fmt::Debug for Dashboard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Dashboard").field("address", &self.address).finish_non_exhaustive()
    }
}

/// A port for a page, before there is a plant to show. Whoever connects waits.
#[derive(Debug)]
pub struct Port {
    listener: TcpListener,
    settings: Settings,
}

impl Port {
    /// Takes the port that `settings` want, so that nothing is started when there is none.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn take(settings: Settings) -> Result<Self, StartError> {
        let listener = listen(&settings)?;
        listener.set_nonblocking(true)?;
        Ok(Self { listener, settings })
    }
}

impl Dashboard {
    /// Serves the page of `plant`: [`Port::take`] and [`Dashboard::serve`].
    ///
    /// # Errors
    /// [`StartError`]; the plant runs on.
    pub fn start(plant: Arc<Running>, settings: Settings) -> Result<Self, StartError> {
        Self::serve(plant, Port::take(settings)?)
    }

    /// Serves the page of `plant` at a port.
    ///
    /// # Errors
    /// [`StartError::System`]; the plant runs on.
    pub fn serve(plant: Arc<Running>, port: Port) -> Result<Self, StartError> {
        let Port { listener, settings } = port;
        let router = router(plant, settings, listener.local_addr()?)?;
        Ok(Self::answer(listener, router)?)
    }

    /// Answers whoever connects to `listener`, in a thread.
    fn answer(listener: TcpListener, router: Router) -> io::Result<Self> {
        let address = listener.local_addr()?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .thread_name("page command")
            .max_blocking_threads(WAITING)
            .build()?;
        let listener = {
            let _inside = runtime.enter();
            tokio::net::TcpListener::from_std(listener)?
        };
        let (stop, stopped) = oneshot::channel();
        let thread = std::thread::Builder::new().name("page".into()).spawn(move || {
            runtime.block_on(async {
                tokio::select! {
                    () = connections::serve(listener, router) => {}
                    _ = stopped => {}
                }
            });
            runtime.shutdown_timeout(PATIENCE);
        })?;
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// Where it listens.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Dashboard {
    fn drop(&mut self) {
        // Dropping the sender is what it waits for.
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so.
            let _ = thread.join();
        }
    }
}

fn listen(settings: &Settings) -> Result<TcpListener, StartError> {
    let wanted = settings.listen.unwrap_or(USUAL);
    if !wanted.ip().is_loopback() && settings.token.is_none() {
        return Err(StartError::NeedsToken(wanted));
    }
    match TcpListener::bind(wanted) {
        Err(error) if settings.listen.is_none() && error.kind() == io::ErrorKind::AddrInUse => {
            TcpListener::bind(SocketAddr::new(wanted.ip(), 0))
        }
        bound => bound,
    }
    .map_err(|reason| StartError::Listen { address: wanted, reason })
}

/// The answers to all requests, as they come to `address`.
///
/// # Errors
/// What the system says where it has no thread.
pub(crate) fn router(
    plant: Arc<Running>,
    settings: Settings,
    address: SocketAddr,
) -> io::Result<Router> {
    let feed = Feed::start(&plant)?;
    let (routes, openapi) = described();
    let gate = Gate::new(address, settings.token, settings.read_only);
    let shared = Arc::new(Shared { plant, feed, gate, name: settings.name, openapi });
    Ok(routes
        .method_not_allowed_fallback(wrong_method)
        .fallback(assets::file)
        .layer(DefaultBodyLimit::max(BODY))
        .layer(from_fn_with_state(Arc::clone(&shared), guard))
        .with_state(shared))
}

/// The routes of the API, and the document that describes them.
pub(crate) fn described() -> (Router<Arc<Shared>>, OpenApi) {
    let (routes, mut openapi) = api::routes().split_for_parts();
    openapi.info = InfoBuilder::new()
        .title("Codewheel")
        .version(env!("CARGO_PKG_VERSION"))
        .description(Some(
            "A running plant: what it is, what happens in it, and what can be done to it. Commands \
             answer when they are done. Requests that change something need `Content-Type: \
             application/json`; where the program was started with a token, all need it.",
        ))
        .build();
    (routes, openapi)
}

async fn wrong_method(request: Request) -> Problem {
    let (method, path) = (request.method(), request.uri().path());
    Problem::new(
        "method",
        StatusCode::METHOD_NOT_ALLOWED,
        "This cannot be done here",
        format!("{method} {path}: /api/v1/openapi.json says what can be done"),
    )
}

async fn guard(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let is_api = request.uri().path().starts_with("/api/");
    let judged = shared.gate.judge(request.method(), request.uri(), request.headers());
    let mut response = match judged {
        Ok(Pass::Answer) => next.run(request).await,
        Ok(Pass::TakeCookie(cookie)) => with_cookie(&cookie),
        Err(problem) => problem.into_response(),
    };
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    if is_api {
        headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    }
    response
}

/// Gives the browser its cookie, and the address without the token. A page that goes on by itself:
/// after a redirect that a link of another site has led to, browsers send no strict cookie.
fn with_cookie(cookie: &str) -> Response {
    let page = "<!doctype html><meta http-equiv=\"refresh\" content=\"0;url=/\"><a href=\"/\">The \
                plant</a>";
    let mut response = page.into_response();
    let headers = response.headers_mut();
    headers.insert(CONTENT_TYPE, HeaderValue::from_static("text/html; charset=utf-8"));
    headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    if let Ok(cookie) = HeaderValue::from_str(cookie) {
        headers.insert(SET_COOKIE, cookie);
    }
    response
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::net::TcpStream;
    use std::sync::{Mutex, mpsc};
    use std::time::Instant;

    use super::*;
    use axum::routing::get;

    #[test]
    fn a_page_that_closes_does_not_wait_for_a_command_under_way() {
        let (begins, begun) = mpsc::channel();
        let (answer, waits) = mpsc::channel::<()>();
        let waits = Arc::new(Mutex::new(waits));
        let command = move || {
            let (begins, waits) = (begins.clone(), Arc::clone(&waits));
            let wait = move || {
                begins.send(()).expect("the test waits");
                drop(waits.lock().map(|waits| waits.recv_timeout(Duration::from_secs(20))));
            };
            async { drop(tokio::task::spawn_blocking(wait).await) }
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
        listener.set_nonblocking(true).expect("it does not block");
        let page = Dashboard::answer(listener, Router::new().route("/", get(command)));
        let page = page.expect("a page");
        let mut client = TcpStream::connect(page.address()).expect("it listens");
        client.write_all(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n").expect("it listens");
        begun.recv().expect("the command begins");
        let begin = Instant::now();
        drop(page);
        assert!(begin.elapsed() < Duration::from_secs(10), "{:?}", begin.elapsed());
        drop(answer);
    }
}
