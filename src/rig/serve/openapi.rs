//! The interface's own description, OpenAPI 3.1.

use axum::Json;
use utoipa::openapi::OpenApi as Document;
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityScheme};
use utoipa::{Modify, OpenApi};

use super::{api, files, metrics, preview, sessions};

#[derive(OpenApi)]
#[openapi(
    info(
        title = "relit-capture",
        description = "A turntable rig: its state, commands to it, and what it recorded.",
    ),
    paths(
        api::state, api::events, api::command,
        preview::picture, preview::stream,
        sessions::list, sessions::detail, sessions::thumbnail, sessions::frame, sessions::objects,
        files::video, metrics::metrics, document,
    ),
    security(("token" = [])),
    modifiers(&Bearer),
)]
struct Interface;

struct Bearer;

impl Modify for Bearer {
    fn modify(&self, document: &mut Document) {
        let components = document.components.get_or_insert_default();
        let scheme = HttpBuilder::new()
            .scheme(HttpAuthScheme::Bearer)
            .description(Some("Demanded on every address but loopback."))
            .build();
        components.add_security_scheme("token", SecurityScheme::Http(scheme));
    }
}

/// This description
#[utoipa::path(
    get, path = "/api/v1/openapi.json", tag = "description",
    responses((status = 200, description = "OpenAPI 3.1", content_type = "application/json"))
)]
pub(super) async fn document() -> Json<Document> {
    Json(Interface::openapi())
}
