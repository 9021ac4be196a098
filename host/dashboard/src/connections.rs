//! Connections of clients: how many there are, and how long they may take.
//!
//! Whoever connects need not mean well, nor be awake. A client that sends half a request, or reads
//! half an answer, holds up nobody else for ever.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio_io_timeout::TimeoutWriter;

/// Connections at the same time: a browser has six for a page, and there are 32 streams of events.
/// Who comes later waits.
const CONNECTIONS: usize = 128;
/// How long a client may take for the head of a request, the time without any request included.
const HEAD: Duration = Duration::from_secs(30);
/// How long an answer waits for a client that reads nothing of it.
const ANSWER: Duration = Duration::from_secs(30);
/// The largest head of a request, and how much of an answer waits for a slow client, in octets.
const BUFFER: usize = 64 * 1024;
/// How long it waits where the system has no connection for it, such as for want of open files.
const WITHOUT: Duration = Duration::from_millis(500);

/// Answers whoever connects to `listener`, without end.
pub(crate) async fn serve(listener: TcpListener, router: Router) {
    let room = Arc::new(Semaphore::new(CONNECTIONS));
    // Nobody closes the semaphore.
    while let Ok(place) = Arc::clone(&room).acquire_owned().await {
        let stream = accept(&listener).await;
        let router = router.clone();
        tokio::spawn(async move {
            converse(stream, router).await;
            drop(place);
        });
    }
}

async fn accept(listener: &TcpListener) -> TcpStream {
    loop {
        match listener.accept().await {
            Ok((stream, _)) => {
                // An event is small, and somebody looks at it.
                let _ = stream.set_nodelay(true);
                return stream;
            }
            Err(error) if is_of_the_client(&error) => {}
            Err(_) => tokio::time::sleep(WITHOUT).await,
        }
    }
}

/// Whether a client has gone before it was met.
fn is_of_the_client(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset};
    matches!(error.kind(), ConnectionAborted | ConnectionRefused | ConnectionReset)
}

/// Answers the requests of one client until it goes, or takes too long.
async fn converse(stream: impl AsyncRead + AsyncWrite, router: Router) {
    let mut stream = TimeoutWriter::new(stream);
    stream.set_timeout(Some(ANSWER));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD)
        .max_buf_size(BUFFER)
        .serve_connection(TokioIo::new(Box::pin(stream)), TowerToHyperService::new(router));
    // What goes wrong here is the client's, and it knows.
    let _ = connection.await;
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::routing::get;
    use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
    use tokio::task::JoinHandle;
    use tokio::time::Instant;

    /// A client, and the server's end of its connection.
    fn connected() -> (DuplexStream, JoinHandle<()>) {
        let large = || async { "x".repeat(1_000_000) };
        let router = Router::new().route("/", get(|| async { "well" })).route("/large", get(large));
        let (client, server) = tokio::io::duplex(1_024);
        (client, tokio::spawn(converse(server, router)))
    }

    /// Runs in virtual time, which passes while all wait.
    fn in_virtual_time(test: impl Future<Output = ()>) {
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        let runtime = runtime.enable_time().start_paused(true).build().expect("a runtime");
        runtime.block_on(test);
    }

    #[test]
    fn a_request_that_does_not_come_to_its_end_is_waited_for_half_a_minute() {
        in_virtual_time(async {
            for begun in ["", "GET / HTTP/1.1\r\nHost: a\r\nX"] {
                let (mut client, server) = connected();
                let begin = Instant::now();
                client.write_all(begun.as_bytes()).await.expect("it listens");
                server.await.expect("it ends");
                assert_eq!(begin.elapsed().as_secs(), 30, "{begun:?}");
            }
        });
    }

    #[test]
    fn a_client_that_drips_does_not_stay_longer() {
        in_virtual_time(async {
            let (mut client, server) = connected();
            let begin = Instant::now();
            while client.write_all(b"x").await.is_ok() && begin.elapsed().as_secs() < 100 {
                tokio::time::sleep(Duration::from_secs(5)).await;
            }
            server.await.expect("it ends");
            assert!((30..=40).contains(&begin.elapsed().as_secs()), "{:?}", begin.elapsed());
        });
    }

    #[test]
    fn a_connection_is_kept_for_the_next_request_and_not_for_ever() {
        in_virtual_time(async {
            let (mut client, server) = connected();
            for _ in 0..3 {
                tokio::time::sleep(Duration::from_secs(20)).await;
                client.write_all(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n").await.expect("it listens");
                let mut answer = [0; 500];
                let length = client.read(&mut answer).await.expect("an answer");
                assert!(answer[..length].ends_with(b"well"));
            }
            let begin = Instant::now();
            server.await.expect("it ends");
            assert_eq!(begin.elapsed().as_secs(), 30);
        });
    }

    #[test]
    fn who_reads_nothing_of_an_answer_is_let_go_and_who_reads_slowly_is_not() {
        let ask = b"GET /large HTTP/1.1\r\nHost: a\r\n\r\n";
        in_virtual_time(async {
            let (mut client, server) = connected();
            client.write_all(ask).await.expect("it listens");
            let begin = Instant::now();
            server.await.expect("it ends");
            assert_eq!(begin.elapsed().as_secs(), 30);

            let (mut client, _server) = connected();
            client.write_all(ask).await.expect("it listens");
            let mut read = 0;
            while read < 1_000_000 {
                tokio::time::sleep(Duration::from_secs(20)).await;
                let some = client.read(&mut [0; 1_024]).await.expect("it goes on");
                assert!(some > 0, "it was let go after {read} octets");
                read += some;
            }
        });
    }
}
