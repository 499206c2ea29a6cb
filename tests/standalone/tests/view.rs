//! Use of `nemoral-view` alone: a server of one's own, and what it refuses.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;

use nemoral_view::{Request, Response, Server};

#[test]
fn whoever_has_the_address_is_answered() -> Result<(), Box<dyn std::error::Error>> {
    let server = Server::bind(0)?;
    let (url, handle) = (server.url(), server.shutdown_handle());
    let (host, path) = url["http://".len()..].split_once('/').ok_or("an address")?;
    let greet = |request: &Request| Response::ok("text/plain", format!("hello {}", request.path));
    let serving = std::thread::spawn(move || server.serve(Arc::new(greet)));
    let ask = |path: &str| -> Result<String, std::io::Error> {
        let mut stream = TcpStream::connect(host)?;
        write!(
            stream,
            "GET /{path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
        )?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        Ok(answer)
    };
    assert!(ask(&format!("{path}you"))?.ends_with("hello you"));
    assert!(ask("you")?.starts_with("HTTP/1.1 404 "));
    handle.shutdown();
    serving.join().map_err(|_| "a panic")??;
    Ok(())
}
