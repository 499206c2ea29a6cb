//! Tests of the local page and its server, in one program.

mod forest;
mod server;
