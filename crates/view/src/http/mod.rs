//! A small HTTP server for one person's browser: on the loopback alone, behind a token.

mod connection;
mod guard;
mod server;

use std::fmt;

pub use server::{Server, ShutdownHandle};

/// How a request changes things.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// It only asks.
    Get,
    /// It changes something.
    Post,
}

/// A request that passed all checks.
#[derive(Clone, PartialEq, Eq)]
pub struct Request {
    /// Its method.
    pub method: Method,
    /// Its path after the token, such as `state`; empty for the page.
    pub path: String,
    /// The keys and values after the question mark, decoded.
    pub query: Vec<(String, String)>,
    /// Its body, at most [`MAX_BODY_BYTES`].
    pub body: Vec<u8>,
}

impl fmt::Debug for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Request")
            .field("method", &self.method)
            .field("path", &self.path)
            .field("query", &self.query)
            .field("body_bytes", &self.body.len())
            .finish()
    }
}

impl Request {
    /// The first value of a key of the query.
    #[must_use]
    pub fn value(&self, key: &str) -> Option<&str> {
        let found = self.query.iter().find(|(k, _)| k == key);
        found.map(|(_, value)| &**value)
    }
}

/// What is sent back.
#[derive(Clone, PartialEq, Eq)]
pub struct Response {
    /// The status code.
    pub status: u16,
    /// The media type of the body.
    pub media_type: &'static str,
    /// Further headers. Their values are ours, never a stranger's.
    pub headers: Vec<(&'static str, String)>,
    /// The body.
    pub body: Vec<u8>,
}

impl fmt::Debug for Response {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Response")
            .field("status", &self.status)
            .field("media_type", &self.media_type)
            .field("headers", &self.headers)
            .field("body_bytes", &self.body.len())
            .finish()
    }
}

impl Response {
    /// A success with a body.
    #[must_use]
    pub fn ok(media_type: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self {
            status: 200,
            media_type,
            headers: Vec::new(),
            body: body.into(),
        }
    }

    /// A status with a line of text.
    #[must_use]
    pub fn text(status: u16, text: &str) -> Self {
        Self {
            status,
            ..Self::ok("text/plain; charset=utf-8", text)
        }
    }

    /// The same with a further header.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl fmt::Display) -> Self {
        self.headers.push((name, value.to_string()));
        self
    }
}

/// Answers requests, from many threads at once.
pub trait Handler: Send + Sync {
    /// The answer to a request.
    fn handle(&self, request: &Request) -> Response;
}

impl<F: Fn(&Request) -> Response + Send + Sync> Handler for F {
    fn handle(&self, request: &Request) -> Response {
        self(request)
    }
}

/// The most bytes of a request's line and headers.
pub const MAX_HEAD_BYTES: usize = 8192;
/// The most bytes of a request's body.
pub const MAX_BODY_BYTES: usize = 8192;
/// The most connections at a time.
pub const MAX_CONNECTIONS: usize = 16;
