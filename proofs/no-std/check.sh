#!/usr/bin/env bash
# Proves that the core crates need neither an allocator nor an operating system.
#
#   host    the machine's own target: nothing undefined but what a C run-time always has
#   thumb   Cortex-M0, with core built from source: a complete link with nothing undefined at all
#
# Usage: check.sh [host|thumb]…   (both by default)
set -euo pipefail
cd "$(dirname "$0")"

target_dir=$(realpath -m "${CARGO_TARGET_DIR:-../../target}")/no-std
export CARGO_TARGET_DIR="$target_dir"
archive=libcodewheel_no_std_proof.a
entry=codewheel_exercise

# The crates of which at least one function must be found in the linked object. A crate that
# `exercise` calls into belongs here.
linked_crates=(station encoder devicenet profibus device)

# What an allocator looks like, mangled or not.
allocator='__(rust|rdl|rg)_(alloc|dealloc|realloc)|__rust_no_alloc_shim|(^|[^a-z_])(malloc|calloc|realloc|free)$|alloc::(alloc|raw_vec|vec|boxed|string)::'

# The compiler emits calls to these four, and any C run-time or compiler_builtins has them. The
# ready-made core of a host target also names `rust_eh_personality` in its unwinding tables, which
# a panic=abort program never reads.
host_may_need='^(memcpy|memmove|memset|memcmp|bcmp|rust_eh_personality)$'

fail() {
    echo "no-std: $*" >&2
    exit 1
}

build() {
    "$@" || fail "the archive does not build (see above; where it says that the lock file needs an" \
        "update, run 'cargo update --workspace' in proofs/no-std and commit its Cargo.lock)"
}

# Lists the symbols of $1, one a line: its section or UND, its demangled name. (Not nm: with other
# versions of LLVM installed as its plugin it stumbles over the bitcode that comes with core.)
symbols() {
    readelf --wide --symbols "$1" | awk 'NF >= 8 && $7 != "Ndx" { print $7, $8 }' | c++filt
}

# Fails where the linked object $1 has an allocator or std, or lacks what it should prove.
check_symbols() {
    local names
    names=$(symbols "$1" | cut -d' ' -f2-)
    grep -qx "$entry" <<<"$names" || fail "$1 lacks $entry: the proof proves nothing"
    if grep -E "$allocator" <<<"$names"; then
        fail "$1 links the allocator symbols above"
    fi
    if grep -E '^<?std::' <<<"$names"; then
        fail "$1 links the std symbols above"
    fi
}

# Shows how many functions of each core crate are in $1, and fails where a listed crate has none.
check_crates() {
    local crate count
    for crate in "${linked_crates[@]}"; do
        count=$(symbols "$1" | grep -v '^UND' | grep -c "codewheel_$crate\(::\|\[\)" || true)
        echo "no-std: host: $count functions of codewheel-$crate"
        [ "$count" -gt 0 ] || fail "no function of codewheel-$crate is linked: exercise() misses it"
    done
}

host() {
    local release="$target_dir/release" undefined
    # Without link-time optimization the functions keep their crates' names.
    build env CARGO_PROFILE_RELEASE_LTO=off cargo build --quiet --release --locked
    ld -r --gc-sections -u "$entry" -o "$release/linked.o" "$release/$archive"
    check_symbols "$release/linked.o"
    check_crates "$release/linked.o"
    undefined=$(symbols "$release/linked.o" | sed -n 's/^UND //p' | grep -vE "$host_may_need" || true)
    [ -z "$undefined" ] || fail "the archive needs from a system:" $undefined
    echo "no-std: host: no allocator, no std"
}

# Debian's parallel toolchain brings the sources of core; its cargo and rustc belong together, so
# the machine's own come last in the path.
thumb_tools() {
    local packages=(rustc-web cargo-web rust-web-src binutils-arm-none-eabi)
    dpkg -s "${packages[@]}" >/dev/null 2>&1 && return
    local root=()
    [ "$(id -u)" = 0 ] || root=(sudo)
    "${root[@]}" apt-get update -qq
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null
}

thumb() {
    local target=thumbv6m-none-eabi
    local release="$target_dir/$target/release"
    thumb_tools || fail "Debian's packages rustc-web cargo-web rust-web-src" \
        "binutils-arm-none-eabi cannot be installed"
    build env -u RUSTUP_TOOLCHAIN -u CARGO -u RUSTC_WRAPPER PATH="/usr/bin:$PATH" \
        RUSTC_BOOTSTRAP=1 RUSTC=/usr/bin/rustc RUSTDOC=/usr/bin/rustdoc \
        /usr/bin/cargo build --quiet --release --locked --target "$target" \
        -Zbuild-std=core,compiler_builtins -Zbuild-std-features=compiler-builtins-mem
    # A complete link: the linker itself refuses whatever is undefined.
    arm-none-eabi-ld --gc-sections -e "$entry" -o "$release/proof.elf" "$release/$archive" ||
        fail "the archive does not link without a system (see above)"
    check_symbols "$release/proof.elf"
    arm-none-eabi-size "$release/proof.elf"
    echo "no-std: thumb: links completely for $target, no allocator, no std"
}

[ $# -gt 0 ] || set -- host thumb
for proof in "$@"; do
    case $proof in
    host | thumb) "$proof" ;;
    *) fail "unknown proof '$proof': host or thumb" ;;
    esac
done
