//! The files of the page, which are part of the program.

use axum::http::header::{ALLOW, CACHE_CONTROL, CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use rust_embed::RustEmbed;

use crate::problem::Problem;

/// In a debug build the files are read anew for each request, so that a page can be written
/// without building.
#[derive(RustEmbed)]
#[folder = "page/"]
struct Page;

/// The file that `uri` names, `/` being `index.html`.
pub(crate) async fn file(method: Method, uri: Uri, headers: HeaderMap) -> Response {
    if method != Method::GET && method != Method::HEAD {
        let problem = Problem::new(
            "method",
            StatusCode::METHOD_NOT_ALLOWED,
            "This cannot be done here",
            format!(
                "{method} {}: this can only be read; /api/v1/openapi.json says what can be done",
                uri.path()
            ),
        );
        // RFC 9110 §15.5.6 asks for what is allowed.
        return ([(ALLOW, HeaderValue::from_static("GET,HEAD"))], problem).into_response();
    }
    let name = match uri.path() {
        "/" => "index.html",
        path => path.trim_start_matches('/'),
    };
    let (Some(file), Some(kind)) = (Page::get(name), content_type(name)) else {
        let path = uri.path();
        return Problem::not_found(format!("{path}: there is no such page; the plant is at /"))
            .into_response();
    };
    let tag = entity_tag(&file.metadata.sha256_hash());
    let is_known = headers.get_all(IF_NONE_MATCH).iter().any(|known| names(known, &tag));
    let mut response = if is_known {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        let kind = HeaderValue::from_static(kind);
        ([(CONTENT_TYPE, kind)], file.data.into_owned()).into_response()
    };
    // Kept, but asked for each time: the next program on this port may have another page.
    response.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        response.headers_mut().insert(ETAG, tag);
    }
    response
}

/// What browsers must take the file for; `None` where it is no part of a page, such as notes of
/// an editor.
fn content_type(name: &str) -> Option<&'static str> {
    let (_, suffix) = name.rsplit_once('.')?;
    Some(match suffix {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "json" => "application/json",
        "webmanifest" => "application/manifest+json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        _ => return None,
    })
}

fn entity_tag(hash: &[u8; 32]) -> String {
    let digits: String = hash.iter().take(16).map(|octet| format!("{octet:02x}")).collect();
    format!("\"{digits}\"")
}

/// Whether the `If-None-Match` names the tag.
fn names(known: &HeaderValue, tag: &str) -> bool {
    let Ok(known) = known.to_str() else { return false };
    known.split(',').map(str::trim).any(|one| one == "*" || one.trim_start_matches("W/") == tag)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_page_is_small() {
        let size: usize =
            Page::iter().filter_map(|name| Page::get(&name)).map(|file| file.data.len()).sum();
        assert!((1..=150 * 1024).contains(&size), "{size} octets");
    }

    #[test]
    fn every_file_of_the_page_has_a_content_type() {
        for name in Page::iter() {
            assert!(content_type(&name).is_some(), "{name} would not be served");
        }
    }
}
