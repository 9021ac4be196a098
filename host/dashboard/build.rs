//! A file that is new in `page/` is embedded at the next build.

fn main() {
    println!("cargo::rerun-if-changed=page");
}
