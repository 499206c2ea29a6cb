//! The server against clients of all kinds, by real connections.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nemoral_view::{Error, MAX_CONNECTIONS, Request, Response, Server, ShutdownHandle};

/// A running server that answers with what it was asked.
struct Running {
    url: String,
    address: SocketAddr,
    handle: ShutdownHandle,
    thread: JoinHandle<Result<(), Error>>,
    asked: Arc<AtomicUsize>,
}

fn run(answer_time: Duration) -> Running {
    let server = Server::bind(0).expect("a free port");
    let (url, handle) = (server.url(), server.shutdown_handle());
    let port = url.split(['/', ':']).nth(4).expect("a port");
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port.parse().expect("a port")));
    let asked = Arc::new(AtomicUsize::new(0));
    let count = Arc::clone(&asked);
    let handler = move |request: &Request| {
        count.fetch_add(1, Ordering::SeqCst);
        std::thread::sleep(answer_time);
        Response::ok(
            "text/plain",
            format!("{} {:?}", request.path, request.query),
        )
    };
    Running {
        url,
        address,
        handle,
        thread: std::thread::spawn(move || server.serve(Arc::new(handler))),
        asked,
    }
}

impl Running {
    fn path(&self) -> &str {
        let after_scheme = &self.url["http://".len()..];
        &after_scheme[after_scheme.find('/').expect("a path")..]
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).expect("it listens");
        let time = Some(Duration::from_secs(20));
        stream.set_read_timeout(time).expect("a time");
        stream
    }

    /// What is sent back to these bytes until the other side closes.
    fn raw(&self, bytes: &str) -> String {
        let mut stream = self.connect();
        stream.write_all(bytes.as_bytes()).expect("it reads");
        let mut answer = String::new();
        // A server that refuses may close before it has read everything.
        let _ = stream.read_to_string(&mut answer);
        answer
    }

    fn get(&self, path: &str, headers: &str) -> String {
        let host = self.address;
        self.raw(&format!(
            "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{headers}\r\n"
        ))
    }

    fn end(self) {
        self.handle.shutdown();
        self.thread.join().expect("no panic").expect("no error");
        assert!(
            TcpStream::connect(self.address).is_err(),
            "it listens no more"
        );
    }
}

#[test]
fn only_the_page_with_its_token_is_answered() {
    let server = run(Duration::ZERO);
    assert!(server.url.starts_with("http://127.0.0.1:"));
    let path = server.path().to_owned();
    assert_eq!(path.len(), 34, "{path}");
    let answer = server.get(&format!("{path}state?a=1"), "");
    assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
    assert!(answer.ends_with("state [(\"a\", \"1\")]"), "{answer}");
    let refused = [
        (server.get("/", ""), 404),
        (server.get("/state", ""), 404),
        (server.get(&path.replace(&path[1..3], "zz"), ""), 404),
        (server.get(&path, "Origin: http://evil.example\r\n"), 403),
        (server.get(&path, "Origin: null\r\n"), 403),
        (server.get(&path, "Sec-Fetch-Site: cross-site\r\n"), 403),
        // DNS rebinding: a stranger's name that resolves to 127.0.0.1.
        (
            server.raw(&format!(
                "GET {path} HTTP/1.1\r\nHost: evil.example\r\n\r\n"
            )),
            403,
        ),
        (server.raw(&format!("GET {path} HTTP/1.0\r\n\r\n")), 403),
        (server.raw("\u{16}\u{3}\u{1}\r\n\r\n"), 400),
    ];
    for (answer, status) in refused {
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status} ")),
            "{status}: {answer}"
        );
        assert!(answer.contains("Content-Security-Policy: default-src 'none'"));
        assert!(!answer.contains(&path[1..33]), "the token is not told");
    }
    assert_eq!(
        server.asked.load(Ordering::SeqCst),
        1,
        "the handler sees nothing that is refused"
    );
    let origin = format!(
        "Origin: http://{}\r\nSec-Fetch-Site: same-origin\r\n",
        server.address
    );
    assert!(server.get(&path, &origin).starts_with("HTTP/1.1 200 "));
    server.end();
}

#[test]
fn many_ask_at_once_and_more_are_sent_away() {
    let server = run(Duration::from_millis(300));
    let path = server.path().to_owned();
    let began = Instant::now();
    std::thread::scope(|scope| {
        let ask = || server.get(&path, "");
        let threads: Vec<_> = (0..MAX_CONNECTIONS).map(|_| scope.spawn(ask)).collect();
        for thread in threads {
            assert!(
                thread
                    .join()
                    .expect("no panic")
                    .starts_with("HTTP/1.1 200 ")
            );
        }
    });
    let together = Duration::from_millis(300) * MAX_CONNECTIONS as u32 / 2;
    assert!(
        began.elapsed() < together,
        "one after the other: {:?}",
        began.elapsed()
    );
    // Silent connections take all places, until they are closed.
    let silent: Vec<TcpStream> = (0..MAX_CONNECTIONS).map(|_| server.connect()).collect();
    let mut refused = server.connect();
    let mut answer = String::new();
    let _ = refused.read_to_string(&mut answer);
    assert!(answer.starts_with("HTTP/1.1 503 "), "{answer}");
    drop(silent);
    let freed = (0..100).any(|_| {
        std::thread::sleep(Duration::from_millis(20));
        server.get(&path, "").starts_with("HTTP/1.1 200 ")
    });
    assert!(freed, "their places are free again");
    server.end();
}

#[test]
fn a_connection_is_used_again_and_a_silent_one_is_closed() {
    let server = run(Duration::ZERO);
    let mut stream = server.connect();
    let request = format!(
        "GET {}a HTTP/1.1\r\nHost: {}\r\n\r\n",
        server.path(),
        server.address
    );
    for _ in 0..3 {
        stream.write_all(request.as_bytes()).expect("it reads");
        let mut some = [0; 4096];
        let mut answer = Vec::new();
        while !answer.ends_with(b"a []") {
            let count = stream.read(&mut some).expect("an answer");
            assert!(count > 0, "closed");
            answer.extend_from_slice(&some[..count]);
        }
    }
    // Half a request, and then nothing.
    let mut slow = server.connect();
    slow.write_all(b"GET / HT").expect("it reads");
    let began = Instant::now();
    assert_eq!(slow.read(&mut [0; 16]).expect("it is closed"), 0);
    assert!(began.elapsed() < Duration::from_secs(15));
    server.end();
}

#[test]
fn a_port_that_is_taken_is_said() {
    let server = Server::bind(0).expect("a free port");
    let port = server
        .url()
        .split(['/', ':'])
        .nth(4)
        .expect("a port")
        .parse()
        .expect("a port");
    let error = Server::bind(port).expect_err("it is taken");
    assert!(
        error
            .to_string()
            .contains(&format!("cannot listen on 127.0.0.1:{port}"))
    );
    assert!(error.is_request());
}
