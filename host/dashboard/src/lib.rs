//! The web page of a running plant, and the API behind it.
//!
//! [`Dashboard::start`] serves a page on which the plant is seen and handled, and the API that the
//! page lives on: JSON over HTTP, and server-sent events. `/api/v1/openapi.json` describes it. The
//! page knows snapshots, reports and commands of [`codewheel_plant`], and no protocol.
//!
//! Without settings only this machine gets in, and of its browsers only this page: the gate looks at
//! `Host`, `Origin` and the content type of every request.

#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic)
)]

mod api;
mod assets;
mod connections;
mod feed;
mod gate;
mod merge_patch;
mod problem;
mod server;
mod settings;
mod stream;
mod view;

pub use server::{Dashboard, Port};
pub use settings::{NoToken, Settings, StartError, Token};
