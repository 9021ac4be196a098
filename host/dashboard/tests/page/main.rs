//! The page and its API, as a browser and a program meet them: over TCP, from a plant that runs.

mod assets;
mod client;
mod commands;
mod description;
mod document;
mod events;
mod refusals;
