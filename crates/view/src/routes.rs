//! The page and what it asks for.

use std::sync::Arc;

use nemoral_scene::glam::DVec2;
use serde_json::json;

use crate::Error;
use crate::controls::Values;
use crate::http::{Handler, Method, Request, Response};
use crate::live::LiveForest;
use crate::view_request::{ImageKind, ViewRequest, Viewpoint};

const PAGE: &str = include_str!("../page/page.html");
const SCRIPT: &str = include_str!("../page/view.js");
const STYLE: &str = include_str!("../page/style.css");

/// Answers the page with pictures of a forest.
#[derive(Clone, Debug)]
pub struct Routes {
    forest: Arc<LiveForest>,
}

impl Routes {
    /// The answers about a forest.
    #[must_use]
    pub fn new(forest: Arc<LiveForest>) -> Self {
        Self { forest }
    }

    fn answer(&self, request: &Request) -> Result<Response, Error> {
        match (request.method, &*request.path) {
            (Method::Get, "") => Ok(Response::ok("text/html; charset=utf-8", PAGE)),
            (Method::Get, "view.js") => Ok(Response::ok("text/javascript; charset=utf-8", SCRIPT)),
            (Method::Get, "style.css") => Ok(Response::ok("text/css; charset=utf-8", STYLE)),
            (Method::Get, "state") => Ok(self.state()),
            (Method::Get, "picture") => self.picture(request),
            (Method::Get, "config") => self.config(request),
            (Method::Post, "change") => {
                let values: Values = serde_json::from_slice(&request.body).map_err(|e| {
                    let text = String::from_utf8_lossy(&request.body);
                    Error::value(
                        "change",
                        text,
                        format!("an object of numbers and texts: {e}"),
                    )
                })?;
                self.forest.change(&values)?;
                Ok(self.state())
            }
            _ => Ok(Response::text(404, "no such page")),
        }
    }

    fn state(&self) -> Response {
        let status = serde_json::to_vec(&self.forest.status()).expect("a status is plain data");
        Response::ok("application/json", status)
    }

    fn picture(&self, request: &Request) -> Result<Response, Error> {
        let Some(picture) = self.forest.picture(&view_request(request)?)? else {
            return Ok(Response {
                status: 204,
                ..Response::ok("text/plain", "")
            });
        };
        let (media_type, bytes) = picture.rendered.encode();
        let DVec2 { x, y } = picture.viewpoint.position_m;
        Ok(Response::ok(media_type, bytes)
            .with("X-Place", format!("{x} {y}"))
            .with("X-Revision", picture.revision)
            .with("X-Final", u8::from(picture.is_final)))
    }

    fn config(&self, request: &Request) -> Result<Response, Error> {
        let (drive, name) = match request.value("what") {
            Some("view") => (false, "view.toml"),
            Some("drive") => (true, "drive.toml"),
            other => return Err(Error::value("what", other.unwrap_or(""), "view or drive")),
        };
        let config = self.forest.config(&view_request(request)?, drive)?;
        let attachment = format!("attachment; filename=\"{name}\"");
        let response = Response::ok("application/toml; charset=utf-8", config);
        Ok(response.with("Content-Disposition", attachment))
    }
}

impl Handler for Routes {
    fn handle(&self, request: &Request) -> Response {
        self.answer(request).unwrap_or_else(|error| {
            let status = if error.is_request() { 422 } else { 500 };
            let message = json!({ "error": error.to_string() });
            Response {
                status,
                ..Response::ok("application/json", message.to_string())
            }
        })
    }
}

/// The request that a query describes.
fn view_request(request: &Request) -> Result<ViewRequest, Error> {
    let text = |key: &str| request.value(key).unwrap_or("");
    let real = |key: &str| {
        let value = text(key);
        let refused = |_| Error::value(key, value, "a number");
        value.parse::<f64>().map_err(refused)
    };
    let whole = |key: &str| {
        let value = text(key);
        let refused = |_| Error::value(key, value, "a whole number");
        value.parse::<u32>().map_err(refused)
    };
    Ok(ViewRequest {
        viewpoint: Viewpoint {
            position_m: DVec2::new(real("x")?, real("y")?),
            heading_deg: real("heading")?,
            pitch_deg: real("pitch")?,
            eye_m: real("eye")?,
        },
        kind: text("map").parse::<ImageKind>()?,
        size_px: (whole("width")?, whole("height")?),
        still: match text("still") {
            "0" => false,
            "1" => true,
            other => return Err(Error::value("still", other, "0 or 1")),
        },
        viewer: whole("viewer")?.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controls::CONTROLS;

    #[test]
    fn the_page_can_say_every_unit() {
        for control in CONTROLS {
            let says = format!("\n  \"{}\": (v", control.unit);
            assert!(
                SCRIPT.contains(&says),
                "{} of {}",
                control.unit,
                control.name
            );
        }
    }
}
