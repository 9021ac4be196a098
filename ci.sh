#!/usr/bin/env bash
# The checks that people and CI both run.
#
#   ./ci.sh              all of them
#   ./ci.sh fmt test     some
#   ./ci.sh --list       what there is
#
# Each step installs what it needs and is missing (as root, or with sudo). A step that cannot run
# has failed.
set -euo pipefail
cd "$(dirname "$0")"
export PATH="$PATH:$HOME/.cargo/bin"

CARGO_TARGET_DIR=$(realpath -m "${CARGO_TARGET_DIR:-target}")
export CARGO_TARGET_DIR
steps=(fmt clippy doc test requests segments telegrams no-std bench-builds fuzz-builds deny
    book strangers page socketcan)

explain() {
    case $1 in
    fmt) echo "the sources are formatted (cargo fmt)" ;;
    clippy) echo "clippy has nothing to say" ;;
    doc) echo "the API documentation builds without a warning" ;;
    test) echo "all tests, walls.rs with the import table among them" ;;
    requests) echo "two million requests from a seed: one answer each, and a refusal changes nothing" ;;
    segments) echo "63 encoders and a scanner with losses and power cuts, 20 seeds" ;;
    telegrams) echo "every bit flip of a PROFIBUS telegram, and every FC and SAP in every state" ;;
    no-std) echo "core links without allocator and std, on the host and for Cortex-M0 (proofs/no-std)" ;;
    bench-builds) echo "the benchmarks build" ;;
    fuzz-builds) echo "the fuzz targets build (fuzz/); their corpus runs in test" ;;
    deny) echo "licences, sources and bans of every dependency (cargo deny, deny.toml)" ;;
    book) echo "the user's book builds (mdbook, docs/book); its commands and links run in test" ;;
    strangers) echo "masters and parsers that are not ours, or know the manuals alone (strangers/)" ;;
    page) echo "people before the page, in Chromium, by keyboard; axe judges it (strangers/page)" ;;
    socketcan) echo "can-utils, on a Linux kernel with emulated controllers, joins us (strangers/)" ;;
    esac
}

step_fmt() {
    cargo fmt --all --check
    cargo fmt --manifest-path proofs/no-std/Cargo.toml --check
}

step_clippy() {
    cargo clippy --workspace --all-targets --locked -- -D warnings
}

step_doc() {
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked
}

step_test() {
    cargo test --workspace --locked
}

step_requests() {
    CODEWHEEL_REQUESTS=2000000 \
        cargo test --release --locked --package codewheel-device --tests request
}

step_segments() {
    CODEWHEEL_NODES=63 \
        cargo test --release --locked --package codewheel-device --test segments lost_frames
}

step_telegrams() {
    CODEWHEEL_EXHAUSTIVE=1 \
        cargo test --release --locked --package codewheel-profibus --test exhaustive
}

step_no-std() {
    proofs/no-std/check.sh
}

step_bench-builds() {
    cargo bench --workspace --no-run --locked
}

# Not linked: that needs cargo-fuzz. libFuzzer itself is built, with the C++ compiler.
step_fuzz-builds() {
    need c++ g++
    cargo fmt --manifest-path fuzz/Cargo.toml --check
    cargo clippy --manifest-path fuzz/Cargo.toml --locked -- -D warnings
}

step_deny() {
    # Without optimization it builds in half the time and checks no slower than one can see.
    command -v cargo-deny >/dev/null ||
        env -u CARGO_TARGET_DIR \
            cargo install cargo-deny --version '^0.20' --locked --debug --quiet
    cargo deny --locked --workspace check licenses bans sources
}

step_book() {
    command -v mdbook >/dev/null ||
        env -u CARGO_TARGET_DIR \
            cargo install mdbook --version '^0.5' --locked --no-default-features --debug --quiet
    mdbook build docs/book --dest-dir "$CARGO_TARGET_DIR/book"
}

step_strangers() {
    need tshark tshark
    need python3 python3 python3-venv
    local venv="$CARGO_TARGET_DIR/strangers-venv"
    make_venv "$venv" strangers/requirements.txt
    cargo build --package codewheel --locked
    local python="$venv/bin/python" logs="$CARGO_TARGET_DIR/strangers-logs" walks=()
    mkdir -p "$logs"
    "$python" strangers/devicenet_master_test.py
    "$python" strangers/profibus_book_test.py
    "$python" strangers/commission_test.py
    "$python" strangers/tshark_judges.py --self-test
    "$python" strangers/data_sheets.py --self-test host/datasheet/tests/golden
    "$python" strangers/data_sheets.py host/datasheet/tests/golden
    "$python" strangers/api_document.py --self-test
    "$python" strangers/api_document.py "$CARGO_TARGET_DIR/debug/codewheel"
    # Walks mostly wait for the encoder's clock, so they go side by side; but not beside those whose
    # masters are other people's and give up when they are kept waiting.
    # Not local, since the trap outlives this function.
    pids=()
    trap '[ ${#pids[@]} = 0 ] || kill "${pids[@]}" 2>/dev/null' EXIT
    local failed=()
    walk session devicenet_session.py
    walk modes devicenet_chapters.py --part turning taken rushing singleturn
    walk resting devicenet_chapters.py --part resting
    walk objects devicenet_chapters.py --part objects
    walk profibus-telegrams profibus_chapters.py --part telegrams rates lamp segment
    walk profibus-services profibus_chapters.py --part services watchdog
    walk profibus-settings profibus_chapters.py --part parameters data
    walk profibus-diagnosis profibus_chapters.py --part diagnosis
    end_walks
    walk profibus-session profibus_session.py
    walk pyprofibus pyprofibus_session.py
    walk python-can-links python_can_links.py
    end_walks
    walk commission-devicenet commission_devicenet.py
    walk commission-profibus commission_profibus.py
    end_walks
    # What failed comes last, where people look first.
    if [ ${#failed[@]} != 0 ]; then
        cat "${failed[@]}"
        return 1
    fi
    "$python" strangers/tshark_judges.py session "$logs/session.log"
    "$python" strangers/tshark_judges.py chapters "$logs"/{modes,resting,objects}.log
    cargo run --quiet --package codewheel-capture --locked --example make_samples -- \
        "$logs/captures"
    "$python" strangers/captures.py "$logs/captures"
}

# Waits for the walks of `step_strangers` that have been started, and shows those that are well.
end_walks() {
    local at
    for at in "${!pids[@]}"; do
        if wait "${pids[at]}"; then
            cat "$logs/${walks[at]}.out"
        else
            failed+=("$logs/${walks[at]}.out")
        fi
    done
    pids=() walks=()
}

step_page() {
    need python3 python3 python3-venv
    need chromium chromium fonts-dejavu-core
    local venv="$CARGO_TARGET_DIR/page-venv"
    make_venv "$venv" strangers/page/requirements.txt
    # Playwright brings the node that drives it.
    local node
    node=$("$venv/bin/python" -c \
        'import pathlib, playwright; print(pathlib.Path(playwright.__file__).parent / "driver/node")')
    "$node" --test strangers/page/*.test.mjs
    cargo build --release --package codewheel --locked
    "$venv/bin/python" strangers/page/page_walk.py "$CARGO_TARGET_DIR/release/codewheel" \
        --log "$CARGO_TARGET_DIR/page.log"
}

# Installs what it needs by itself.
step_socketcan() {
    cargo build --package codewheel --locked
    strangers/socketcan_session.sh "$CARGO_TARGET_DIR/debug/codewheel"
}

# Starts the walk $2… of `step_strangers`, called $1, which writes $logs/$1.log and $logs/$1.out.
walk() {
    local name=$1 script=$2
    shift 2
    "$python" "strangers/$script" "$CARGO_TARGET_DIR/debug/codewheel" --log "$logs/$name.log" "$@" \
        >"$logs/$name.out" 2>&1 &
    walks+=("$name")
    pids+=($!)
}

# Makes the virtual environment $1 with what the file $2 asks for, unless it is there.
make_venv() {
    cmp -s "$2" "$1/requirements.txt" && return
    rm -rf "$1"
    python3 -m venv "$1" || { install_packages python3-venv && python3 -m venv "$1"; }
    "$1/bin/pip" install --quiet --requirement "$2"
    cp "$2" "$1/requirements.txt"
}

# Installs Debian packages $2… (or $1) where the command $1 is missing.
need() {
    local command=$1
    shift
    command -v "$command" >/dev/null || install_packages "$@"
}

install_packages() {
    local root=()
    [ "$(id -u)" = 0 ] || root=(sudo)
    "${root[@]}" apt-get update -qq
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

table=()

run() {
    local step=$1 begin=$SECONDS took
    echo "==> $step: $(explain "$step")"
    # In a process of its own: `set -e` does not work inside a condition.
    if bash ci.sh --only "$step" </dev/null; then
        took=$((SECONDS - begin))
        table+=("$(printf '%-14s ok     %4d s' "$step" "$took")")
        echo "==> $step: ok, $took s"
    else
        took=$((SECONDS - begin))
        table+=("$(printf '%-14s FAILED %4d s' "$step" "$took")")
        echo "==> $step: FAILED after $took s; its last lines above say why" >&2
        echo "    again: ./ci.sh $step" >&2
        report
        exit 1
    fi
}

report() {
    echo
    printf '%s\n' "${table[@]}"
    printf '%-14s        %4d s\n' together "$SECONDS"
}

is_step() {
    local step
    for step in "${steps[@]}"; do
        [ "$step" = "$1" ] && return
    done
    echo "ci.sh: unknown step '$1'; ./ci.sh --list shows them" >&2
    exit 2
}

main() {
    case ${1-} in
    --only) "step_$2" ;;
    --list)
        for step in "${steps[@]}"; do
            printf '%-14s %s\n' "$step" "$(explain "$step")"
        done
        ;;
    *)
        [ $# -gt 0 ] || set -- "${steps[@]}"
        for step in "$@"; do
            is_step "$step"
        done
        for step in "$@"; do
            run "$step"
        done
        report
        ;;
    esac
}

# Read to the end before anything runs, so that editing this file does not disturb a run.
main "$@"; exit
