//! This crate shows a forest as a page in a browser, to walk through while it grows and changes.
//!
//! [`LiveForest`] is the forest: it makes [`ViewImage`]s by the sensors of `nemoral-pipeline`,
//! drafts while somebody moves and whole ones while they hold still, grows the land around them on
//! its own thread, and takes changes of light, weather and stand. [`Server`] is a small HTTP server
//! for one person's browser, and [`Routes`] joins the two.
//!
//! # Promises
//! - The picture that stays on the page, [`ViewImage::is_final`], is to the bit frame 0 of the
//!   config that [`LiveForest::config`] gives.
//! - Nothing waits for plants: what has grown is seen, and a change shows when it has grown.
//! - The server listens on 127.0.0.1 only. Every request needs the token that is in the address, a
//!   `Host` and, if there is one, an `Origin` of this server, so that no page of another site can
//!   ask. Requests, connections and times are bounded. The page may load nothing from elsewhere.
//! - No request names a file.
//!
//! # Example
//! ```no_run
//! use std::sync::Arc;
//! use nemoral_pipeline::{Backend, config::ConfigLayers};
//! use nemoral_view::{ForestParams, LiveForest, Routes, Server};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let sequence = ConfigLayers::default().sequences()?.get(0)?;
//! let backend = Backend::Cpu;
//! let params = ForestParams { sequence, backend, threads: 2, cache: None };
//! let forest = Arc::new(LiveForest::new(params)?);
//! let server = Server::bind(0)?;
//! println!("{}", server.url());
//! server.serve(Arc::new(Routes::new(forest)))?;
//! # Ok(())
//! # }
//! ```
//!
//! # Non-goals
//! Serving others, or many people: whoever has the address can use the processor.

mod controls;
mod error;
mod http;
mod live;
mod routes;
mod view_request;

pub use controls::{CONTROLS, Control, Value, Values};
pub use error::Error;
pub use http::{
    Handler, MAX_BODY_BYTES, MAX_CONNECTIONS, MAX_HEAD_BYTES, Method, Request, Response, Server,
    ShutdownHandle,
};
pub use live::{
    ForestParams, ForestStatus, GrowthProgress, GrowthStage, LiveForest, RenderedImage, ViewImage,
};
pub use routes::Routes;
pub use view_request::{ImageKind, SIDES_PX, ViewRequest, Viewpoint};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
