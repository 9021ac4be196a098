//! Passports: taken, written down, compared, applied to another encoder, made from captures.

mod applying;
mod buses;
mod captures;
mod comparing;
mod files;
mod real_encoders;
mod refusals;
mod swaps;
mod toy;
