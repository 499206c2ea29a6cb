//! Requests read and responses written on one connection, within bounds of size and time.

use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use nemoral_scene::excerpt;

use super::guard::{OriginHeaders, Token, refusal};
use super::{MAX_BODY_BYTES, MAX_HEAD_BYTES, Method, Request, Response};

/// The most headers of a request. Browsers send about twenty.
const MAX_HEADERS: usize = 48;
/// How long a request may take to arrive once it has begun.
const REQUEST_TIME: Duration = Duration::from_secs(10);

/// What every response says: nothing of it is stored or framed, and the page may load and ask only
/// what comes from here.
const ALWAYS: &str = "\
Cache-Control: no-store\r\n\
Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; \
img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; \
frame-ancestors 'none'\r\n\
Cross-Origin-Opener-Policy: same-origin\r\n\
Cross-Origin-Resource-Policy: same-origin\r\n\
Referrer-Policy: no-referrer\r\n\
X-Content-Type-Options: nosniff\r\n";

/// What arrived on a connection.
#[derive(Debug)]
pub(super) enum ReadOutcome {
    /// A request that may be answered.
    Request { request: Request, keep: bool },
    /// Something that is refused; the connection is closed after the response.
    Refused(Response),
    /// Nothing more: the connection was closed, or is silent.
    Nothing,
}

/// A connection that reads bytes ahead.
#[derive(Debug)]
pub(super) struct Connection<S> {
    stream: S,
    /// What was read and is not part of a request yet.
    ahead: Vec<u8>,
}

/// The parts of a request's head.
struct Head {
    method: Method,
    target: String,
    body_bytes: usize,
    keep: bool,
}

impl<S: Read + Write> Connection<S> {
    pub(super) fn new(stream: S) -> Self {
        Self {
            stream,
            ahead: Vec::new(),
        }
    }

    /// The next request.
    pub(super) fn next(&mut self, port: u16, token: &Token) -> ReadOutcome {
        let mut deadline = None;
        let (head, length) = loop {
            match parse(&self.ahead, port) {
                Ok(Some(whole)) => break whole,
                Ok(None) if self.ahead.len() >= MAX_HEAD_BYTES => {
                    let why = format!("headers: must be at most {MAX_HEAD_BYTES} bytes");
                    return ReadOutcome::Refused(Response::text(431, &why));
                }
                Ok(None) => {}
                Err(refused) => return ReadOutcome::Refused(refused),
            }
            match self.read_more(MAX_HEAD_BYTES, &mut deadline) {
                Ok(0) | Err(_) => return ReadOutcome::Nothing,
                Ok(_) => {}
            }
        };
        self.ahead.drain(..length);
        while self.ahead.len() < head.body_bytes {
            match self.read_more(head.body_bytes, &mut deadline) {
                Ok(0) | Err(_) => return ReadOutcome::Nothing,
                Ok(_) => {}
            }
        }
        let rest = self.ahead.split_off(head.body_bytes);
        let body = std::mem::replace(&mut self.ahead, rest);
        match to_request(&head, body, token) {
            Some(request) => ReadOutcome::Request {
                request,
                keep: head.keep,
            },
            None => ReadOutcome::Refused(Response::text(
                404,
                "no such page: open the address that was printed",
            )),
        }
    }

    /// Reads until `most` bytes are ahead, at most what there is.
    fn read_more(&mut self, most: usize, deadline: &mut Option<Instant>) -> io::Result<usize> {
        if deadline.is_some_and(|d| Instant::now() > d) {
            return Err(io::ErrorKind::TimedOut.into());
        }
        let mut some = [0; 2048];
        let room = most.saturating_sub(self.ahead.len()).clamp(1, some.len());
        let count = self.stream.read(&mut some[..room])?;
        self.ahead.extend_from_slice(&some[..count]);
        deadline.get_or_insert_with(|| Instant::now() + REQUEST_TIME);
        Ok(count)
    }

    pub(super) fn write(&mut self, response: &Response, keep: bool) -> io::Result<()> {
        let status = response.status;
        let mut head = format!(
            "HTTP/1.1 {status} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\n{ALWAYS}",
            reason(status),
            response.media_type,
            response.body.len()
        );
        for (name, value) in &response.headers {
            head += &format!("{name}: {value}\r\n");
        }
        head += if keep {
            "\r\n"
        } else {
            "Connection: close\r\n\r\n"
        };
        let mut bytes = head.into_bytes();
        bytes.extend_from_slice(&response.body);
        self.stream.write_all(&bytes)?;
        self.stream.flush()
    }
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        204 => "No Content",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        413 => "Content Too Large",
        422 => "Unprocessable Content",
        431 => "Request Header Fields Too Large",
        501 => "Not Implemented",
        503 => "Service Unavailable",
        _ => "Internal Server Error",
    }
}

/// The head and its length, if it has arrived whole.
fn parse(bytes: &[u8], port: u16) -> Result<Option<(Head, usize)>, Response> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let length = match parsed.parse(bytes) {
        Ok(httparse::Status::Complete(length)) => length,
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(httparse::Error::TooManyHeaders) => {
            return Err(Response::text(431, "headers: too many"));
        }
        Err(e) => return Err(Response::text(400, &format!("not a request: {e}"))),
    };
    let values = |name: &str| {
        let named = parsed.headers.iter();
        let named = named.filter(|h| h.name.eq_ignore_ascii_case(name));
        named
            .map(|h| std::str::from_utf8(h.value).unwrap_or("?").trim())
            .collect::<Vec<_>>()
    };
    let only = |name: &'static str| match values(name)[..] {
        [] => Ok(None),
        [value] => Ok(Some(value)),
        _ => Err(Response::text(400, &format!("{name}: given twice"))),
    };
    let origin_headers = OriginHeaders {
        host: only("Host")?,
        origin: only("Origin")?,
        site: only("Sec-Fetch-Site")?,
    };
    if let Some(why) = refusal(port, origin_headers) {
        return Err(Response::text(403, why));
    }
    let method = match parsed.method {
        Some("GET") => Method::Get,
        Some("POST") => Method::Post,
        _ => {
            return Err(
                Response::text(405, "method: must be GET or POST").with("Allow", "GET, POST")
            );
        }
    };
    if !values("Transfer-Encoding").is_empty() {
        return Err(Response::text(501, "Transfer-Encoding: must not be given"));
    }
    let told = only("Content-Length")?.unwrap_or("0");
    // Digits alone: `parse` takes a sign, too.
    let is_number = told.bytes().all(|b| b.is_ascii_digit()) && told.len() < 10;
    let Some(body_bytes) = told.parse::<usize>().ok().filter(|_| is_number) else {
        let told = excerpt(told, 40);
        let why = format!("Content-Length = {told}: must be one number of at most 9 digits");
        return Err(Response::text(400, &why));
    };
    if body_bytes > MAX_BODY_BYTES {
        let why = format!("body: {body_bytes} bytes: must be at most {MAX_BODY_BYTES}");
        return Err(Response::text(413, &why));
    }
    let closes = values("Connection")
        .iter()
        .any(|v| v.eq_ignore_ascii_case("close"));
    let head = Head {
        method,
        target: parsed.path.unwrap_or_default().to_owned(),
        body_bytes,
        keep: !closes && parsed.version == Some(1),
    };
    Ok(Some((head, length)))
}

/// `None` without the token, and for an address that is not written as ours are.
fn to_request(head: &Head, body: Vec<u8>, token: &Token) -> Option<Request> {
    let (path, query) = head.target.split_once('?').unwrap_or((&head.target, ""));
    let (offered, path) = path.strip_prefix('/')?.split_once('/')?;
    if !token.is(offered) {
        return None;
    }
    let pair = |pair: &str| {
        let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
        Some((decoded(key)?, decoded(value)?))
    };
    let pairs = query.split('&').filter(|p| !p.is_empty());
    Some(Request {
        method: head.method,
        path: path.to_owned(),
        query: pairs.map(pair).collect::<Option<_>>()?,
        body,
    })
}

/// Text with `%XX` for bytes and `+` for spaces.
fn decoded(text: &str) -> Option<String> {
    let mut bytes = text.bytes();
    let mut out = Vec::new();
    while let Some(b) = bytes.next() {
        out.push(match b {
            b'+' => b' ',
            b'%' => {
                let mut digit = || char::from(bytes.next()?).to_digit(16);
                let (high, low) = (digit()?, digit()?);
                (16 * high + low) as u8
            }
            b => b,
        });
    }
    String::from_utf8(out).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    /// Gives its input in pieces of `step` bytes, and collects what is written.
    struct Pieces {
        input: Cursor<Vec<u8>>,
        step: usize,
        written: Vec<u8>,
    }

    impl Read for Pieces {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let step = self.step.min(buffer.len());
            self.input.read(&mut buffer[..step])
        }
    }

    impl Write for Pieces {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.written.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn connection(text: &str, step: usize) -> Connection<Pieces> {
        Connection::new(Pieces {
            input: Cursor::new(text.as_bytes().to_vec()),
            step,
            written: Vec::new(),
        })
    }

    fn status(outcome: &ReadOutcome) -> u16 {
        match outcome {
            ReadOutcome::Request { .. } => 200,
            ReadOutcome::Refused(response) => response.status,
            ReadOutcome::Nothing => 0,
        }
    }

    #[test]
    fn requests_follow_each_other_however_they_are_cut() {
        let token = Token::random().unwrap();
        let t = token.as_str();
        let text = format!(
            "POST /{t}/change HTTP/1.1\r\nHost: localhost:5\r\nContent-Length: 4\r\n\r\nbodyGET \
             /{t}/frame?x=1.5&map=a%20b+c HTTP/1.1\r\nhost: 127.0.0.1:5\r\n\
             Connection: Close\r\n\r\n"
        );
        for step in [1, 7, 4096] {
            let mut connection = connection(&text, step);
            let ReadOutcome::Request { request, keep } = connection.next(5, &token) else {
                panic!("a request");
            };
            assert!(keep);
            assert_eq!((request.method, &*request.path), (Method::Post, "change"));
            assert_eq!(request.body, b"body");
            let ReadOutcome::Request { request, keep } = connection.next(5, &token) else {
                panic!("a request");
            };
            assert!(!keep);
            assert_eq!(request.value("x"), Some("1.5"));
            assert_eq!(request.value("map"), Some("a b c"));
            assert!(request.body.is_empty());
            assert_eq!(status(&connection.next(5, &token)), 0);
        }
    }

    #[test]
    fn hostile_requests_are_refused_with_their_reason() {
        let token = Token::random().unwrap();
        let t = token.as_str();
        let host = "Host: 127.0.0.1:5\r\n";
        let long = "x".repeat(MAX_HEAD_BYTES);
        let many = "a: b\r\n".repeat(MAX_HEADERS + 1);
        let cases = [
            (format!("GET /{t}/ HTTP/1.1\r\n{host}\r\n"), 200),
            (format!("GET /{t}/ HTTP/1.1\r\n\r\n"), 403),
            (
                format!("GET /{t}/ HTTP/1.1\r\nHost: evil.example\r\n\r\n"),
                403,
            ),
            (format!("GET /{t}/ HTTP/1.1\r\n{host}{host}\r\n"), 400),
            (
                format!("GET /{t}/ HTTP/1.1\r\n{host}Origin: http://evil.example\r\n\r\n"),
                403,
            ),
            (
                format!("GET /{t}/ HTTP/1.1\r\n{host}Sec-Fetch-Site: cross-site\r\n\r\n"),
                403,
            ),
            (format!("GET / HTTP/1.1\r\n{host}\r\n"), 404),
            (format!("GET /{t} HTTP/1.1\r\n{host}\r\n"), 404),
            (
                format!("GET /{}/ HTTP/1.1\r\n{host}\r\n", "0".repeat(32)),
                404,
            ),
            (
                format!("GET http://127.0.0.1:5/{t}/ HTTP/1.1\r\n{host}\r\n"),
                404,
            ),
            (format!("GET /{t}/frame?x=%zz HTTP/1.1\r\n{host}\r\n"), 404),
            (format!("GET /{t}/frame?x=%ff HTTP/1.1\r\n{host}\r\n"), 404),
            (format!("PUT /{t}/ HTTP/1.1\r\n{host}\r\n"), 405),
            (
                format!("GET /{t}/ HTTP/1.1\r\n{host}Transfer-Encoding: chunked\r\n\r\n"),
                501,
            ),
            (
                format!("GET /{t}/ HTTP/1.1\r\n{host}Content-Length: -1\r\n\r\n"),
                400,
            ),
            (
                format!("GET /{t}/ HTTP/1.1\r\n{host}Content-Length: 1e3\r\n\r\n"),
                400,
            ),
            (
                format!("GET /{t}/ HTTP/1.1\r\n{host}Content-Length: 999999999\r\n\r\n"),
                413,
            ),
            (
                format!("GET /{t}/ HTTP/1.1\r\n{host}Content-Length: 99999999999999\r\n\r\n"),
                400,
            ),
            (format!("GET /{t}/ HTTP/1.1\r\n{host}{many}\r\n"), 431),
            (format!("GET /{t}/{long} HTTP/1.1\r\n{host}\r\n"), 431),
            (
                format!("GET /{t}/ HTTP/1.1\r\n{host}bad header\r\n\r\n"),
                400,
            ),
            ("\u{0}\u{1}\u{2}\r\n\r\n".to_owned(), 400),
            ("GET / HT".to_owned(), 0),
            (
                format!("POST /{t}/ HTTP/1.1\r\n{host}Content-Length: 4\r\n\r\nbo"),
                0,
            ),
        ];
        for (text, expected) in cases {
            let outcome = connection(&text, 64).next(5, &token);
            let shown = &text[..text.len().min(90)];
            assert_eq!(status(&outcome), expected, "{shown}: {outcome:?}");
        }
    }

    #[test]
    fn refusals_of_sizes_say_what_is_allowed() {
        let token = Token::random().unwrap();
        let t = token.as_str();
        let start = format!("GET /{t}/ HTTP/1.1\r\nHost: 127.0.0.1:5\r\n");
        let long = "x".repeat(MAX_HEAD_BYTES);
        for (rest, told) in [
            (
                "Content-Length: 1e3",
                "Content-Length = 1e3: must be one number",
            ),
            (
                "Content-Length: 8193",
                "body: 8193 bytes: must be at most 8192",
            ),
            (
                &*format!("a: {long}"),
                "headers: must be at most 8192 bytes",
            ),
        ] {
            let text = format!("{start}{rest}\r\n\r\n");
            let ReadOutcome::Refused(response) = connection(&text, 64).next(5, &token) else {
                panic!("{told}");
            };
            let body = String::from_utf8(response.body).unwrap();
            assert!(body.starts_with(told), "{body}");
        }
    }

    #[test]
    fn every_response_forbids_what_the_page_does_not_need() {
        let mut connection = connection("", 1);
        let response = Response::text(404, "none").with("Allow", "GET");
        connection.write(&response, false).unwrap();
        let text = String::from_utf8(connection.stream.written).unwrap();
        assert!(text.starts_with("HTTP/1.1 404 Not Found\r\n"), "{text}");
        for header in [
            "default-src 'none'",
            "no-store",
            "nosniff",
            "no-referrer",
            "Allow: GET",
        ] {
            assert!(text.contains(header), "{text}");
        }
        assert!(text.ends_with("Connection: close\r\n\r\nnone"), "{text}");
    }
}
