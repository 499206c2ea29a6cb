//! The listener and its connections.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use super::connection::{Connection, ReadOutcome};
use super::guard::Token;
use super::{Handler, MAX_CONNECTIONS, Response};
use crate::Error;

/// How long a connection may be silent that has sent no request yet, perhaps a stranger's.
const FIRST: Duration = Duration::from_secs(5);
/// How long a connection may be silent between requests.
const IDLE: Duration = Duration::from_secs(60);
/// How long the other side may take to receive some bytes.
const WRITE_TIME: Duration = Duration::from_secs(10);

/// A server on 127.0.0.1 that answers whoever knows its token.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    port: u16,
    token: Token,
    stopped: Arc<AtomicBool>,
}

/// Ends a server from another thread.
#[derive(Clone, Debug)]
pub struct ShutdownHandle {
    port: u16,
    stopped: Arc<AtomicBool>,
}

impl ShutdownHandle {
    /// Ends [`Server::serve`]. Requests that are being answered are finished by their threads.
    pub fn shutdown(&self) {
        self.stopped.store(true, Ordering::SeqCst);
        // The listener waits for a connection. If this one fails, it waits no more.
        let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port));
    }
}

impl Server {
    /// Listens on a port of 127.0.0.1; 0 for any free one.
    ///
    /// # Errors
    /// [`Error::Listen`], if the port is taken or not allowed.
    pub fn bind(port: u16) -> Result<Self, Error> {
        let bound = || {
            let listener = TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port)))?;
            let port = listener.local_addr()?.port();
            Ok::<_, io::Error>((listener, port, Token::random()?))
        };
        let (listener, port, token) = bound().map_err(|source| Error::Listen { port, source })?;
        Ok(Self {
            listener,
            port,
            token,
            stopped: Arc::default(),
        })
    }

    /// The address of the page, with the token that every request needs.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token.as_str())
    }

    /// What ends it.
    #[must_use]
    pub fn shutdown_handle(&self) -> ShutdownHandle {
        ShutdownHandle {
            port: self.port,
            stopped: Arc::clone(&self.stopped),
        }
    }

    /// Answers requests until it is stopped, each connection on a thread of its own.
    ///
    /// # Errors
    /// [`Error::Listen`], if the system takes the port away.
    pub fn serve(self, handler: Arc<dyn Handler>) -> Result<(), Error> {
        let open = Arc::new(AtomicUsize::new(0));
        loop {
            let accepted = self.listener.accept();
            if self.stopped.load(Ordering::SeqCst) {
                return Ok(());
            }
            let stream = match accepted {
                Ok((stream, _)) => stream,
                // The other side went away, or all file descriptors are in use for now.
                Err(e) if is_passing(&e) => {
                    thread::sleep(Duration::from_millis(20));
                    continue;
                }
                Err(source) => {
                    let port = self.port;
                    return Err(Error::Listen { port, source });
                }
            };
            let place = Place::take(&open);
            let (port, token, handler) = (self.port, self.token.clone(), Arc::clone(&handler));
            let serve = move || {
                // A connection that breaks concerns the other side alone.
                let _ = converse(stream, port, &token, &*handler, place.is_some());
                drop(place);
            };
            // Without a thread the connection is closed.
            let _ = thread::Builder::new()
                .name("connection".to_owned())
                .spawn(serve);
        }
    }
}

fn is_passing(error: &io::Error) -> bool {
    // EMFILE and ENFILE have no kind of their own.
    let out_of_files = [Some(23), Some(24)].contains(&error.raw_os_error());
    let kinds = [
        io::ErrorKind::ConnectionAborted,
        io::ErrorKind::ConnectionReset,
    ];
    out_of_files || kinds.contains(&error.kind()) || error.kind() == io::ErrorKind::Interrupted
}

/// One of the connections that may be open.
#[derive(Debug)]
struct Place(Arc<AtomicUsize>);

impl Place {
    fn take(open: &Arc<AtomicUsize>) -> Option<Self> {
        let place = Self(Arc::clone(open));
        // If there is none, dropping this gives it back.
        (open.fetch_add(1, Ordering::SeqCst) < MAX_CONNECTIONS).then_some(place)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

fn converse(
    stream: TcpStream,
    port: u16,
    token: &Token,
    handler: &dyn Handler,
    has_place: bool,
) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(FIRST))?;
    stream.set_write_timeout(Some(WRITE_TIME))?;
    let settings = stream.try_clone()?;
    let mut connection = Connection::new(stream);
    if !has_place {
        return connection.write(&Response::text(503, "too many connections"), false);
    }
    loop {
        match connection.next(port, token) {
            ReadOutcome::Request { request, keep } => {
                settings.set_read_timeout(Some(IDLE))?;
                connection.write(&handler.handle(&request), keep)?;
                if !keep {
                    return Ok(());
                }
            }
            ReadOutcome::Refused(response) => return connection.write(&response, false),
            ReadOutcome::Nothing => return Ok(()),
        }
    }
}
