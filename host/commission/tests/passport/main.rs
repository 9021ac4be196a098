//! Passports: taken, written down, compared, applied to another encoder, made from captures.

mod applying;
mod captures;
mod comparing;
mod files;
mod refusals;
mod swaps;
mod toy;
