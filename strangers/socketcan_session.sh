#!/usr/bin/env bash
# A real Linux CAN stack judges `socketcan:`: its own tools play the master.
#
#   strangers/socketcan_session.sh [PROGRAM] [--log FILE]
#
# Boots Debian's kernel in QEMU, with a virtual CAN interface and two emulated controllers on one
# bus, and runs socketcan_guest.sh and PROGRAM (default: target/debug/codewheel) in it; nothing of
# this machine is changed but for packages that are missing, which are installed. The kernel is kept
# in $CARGO_TARGET_DIR/socketcan. FILE gets everything that was said on the console.
set -euo pipefail
strangers=$(cd "$(dirname "$0")" && pwd)
target=$(realpath -m "${CARGO_TARGET_DIR:-$strangers/../target}")
program=$target/debug/codewheel
log=/dev/null
# A run takes some 20 s; without KVM on a busy machine some more.
LIMIT=180

while [ $# != 0 ]; do
    case $1 in
    --log)
        log=$2
        shift
        ;;
    *) program=$1 ;;
    esac
    shift
done

modules=(can can-raw can-dev vcan sja1000 kvaser_pci)
tools=(candump cansend ip)

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}

# Installs package $2 where the command $1 is missing.
need() {
    command -v "$1" >/dev/null && return
    as_root apt-get update -qq
    as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "$2" >/dev/null
}

# The kernel and its CAN modules, out of the package and not installed: the kernels of clouds, and
# the one that runs here, may have no CAN.
fetch_kernel() {
    [ -e "$kernel/vmlinuz" ] && return
    rm -rf "$kernel" && mkdir -p "$kernel"
    as_root apt-get update -qq
    local package
    package=$(apt-cache depends linux-image-amd64 | awk '/Depends: linux-image/ { print $2; exit }')
    (cd "$kernel" && apt-get download -qq -o APT::Sandbox::User=root "$package")
    dpkg-deb --fsys-tarfile "$kernel"/*.deb |
        tar -x -C "$kernel" --wildcards './boot/vmlinuz-*' '*/net/can/*'
    rm "$kernel"/*.deb
    mv "$kernel"/boot/vmlinuz-* "$kernel/vmlinuz"
}

# Puts program $1 into the machine as $2, with the libraries that it needs where it looks for them.
put() {
    install -D "$1" "$root/$2"
    { ldd "$1" 2>/dev/null || true; } | { grep -o '/[^ ]*' || true; } | while read -r library; do
        [ -e "$root$library" ] || install -D "$library" "$root$library"
    done
}

# Puts module $1 into the machine, unpacked: its loader reads no other.
put_module() {
    local file
    file=$(find "$kernel" -name "$1.ko*" -print -quit)
    case $file in
    *.xz) xz -dc "$file" ;;
    *.zst) zstd -dqc "$file" ;;
    *) cat "$file" ;;
    esac >"$root/modules/$1.ko"
}

need qemu-system-x86_64 qemu-system-x86
need candump can-utils
need ip iproute2
need busybox busybox-static
need cpio cpio

kernel=$target/socketcan/kernel
fetch_kernel

root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
mkdir -p "$root"/{proc,sys,dev,tmp,modules}
put "$(command -v busybox)" bin/busybox
for tool in "${tools[@]}"; do put "$(command -v "$tool")" "tools/$tool"; done
put "$program" tools/codewheel
# All of it lies in the memory of the machine, and debug information is most of it.
strip --strip-debug "$root/tools/codewheel"
for module in "${modules[@]}"; do put_module "$module"; done
printf '%s\n' "${modules[@]}" >"$root/modules/order"
install "$strangers/socketcan_guest.sh" "$root/init"
(cd "$root" && find . | cpio --quiet -o -H newc | gzip -1) >"$root.gz"
trap 'rm -rf "$root" "$root.gz"' EXIT

# The machine writes its verdict to a port that ends QEMU with 2·verdict + 1. It emulates, for KVM
# is not to be had everywhere.
said=$(mktemp)
trap 'rm -rf "$root" "$root.gz" "$said"' EXIT
verdict=0
timeout "$LIMIT" qemu-system-x86_64 -accel tcg -m 512 -nodefaults -no-reboot -display none \
    -serial "file:$said" -device isa-debug-exit,iobase=0xf4,iosize=1 \
    -object can-bus,id=copper -device kvaser_pci,canbus=copper -device kvaser_pci,canbus=copper \
    -kernel "$kernel/vmlinuz" -initrd "$root.gz" \
    -append "console=ttyS0 quiet panic=-1 mitigations=off" </dev/null || verdict=$?
tr -d '\r' <"$said" >"$root/said"
cat "$root/said" >"$log"
grep -E '^(ok|FAILED|    )' "$root/said" || true
case $verdict in
1) ;;
124) echo "FAILED: no verdict within $LIMIT s; what was said: $(tail -n 5 "$root/said")" ;;
*) echo "FAILED: the machine ended with $verdict; what was said last: $(tail -n 5 "$root/said")" ;;
esac
[ "$verdict" = 1 ]
