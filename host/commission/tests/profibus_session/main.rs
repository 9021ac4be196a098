//! What people do with a PROFIBUS, on a wire in virtual time with encoders of the catalogue.

mod bench;
mod interrupted;
mod listening;
mod preset;
mod scan;
mod session;
mod speaker;
mod stranger;
mod tokens;
mod trouble;
