#!/usr/bin/env bash
# The same bits on every processor: every preset in both precisions, rendered here and under emulated processors that lack AVX-512, AVX2, FMA or AVX,
# and on an emulated 64-bit ARM where its build is given. Needs qemu-user (Debian: `apt-get install qemu-user`).
#
#     cargo build --release
#     rustup target add aarch64-unknown-linux-musl
#     CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER=rust-lld cargo build --release --target aarch64-unknown-linux-musl
#     benches/processors.sh target/release/raywright [target/aarch64-unknown-linux-musl/release/raywright]
#
# Prints a line a processor, and ends with exit code 1 if any picture differs by a bit.
set -euo pipefail
native=$(realpath "$1")
arm=${2:+$(realpath "$2")}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"

# What tells the processors apart; `max` of an emulator that has no AVX-512 is its widest.
processors=(
    "without AVX-512|qemu-x86_64 -cpu max $native"
    "with AVX2, without FMA|qemu-x86_64 -cpu Haswell,-fma $native"
    "with AVX, without AVX2|qemu-x86_64 -cpu SandyBridge $native"
    "SSE4.2, without AVX|qemu-x86_64 -cpu Nehalem $native"
    "SSE2 alone|qemu-x86_64 -cpu qemu64 $native"
)
[ -z "$arm" ] || processors+=("64-bit ARM|qemu-aarch64 $arm")

presets=$("$native" presets | awk '{print $1}')
# The file keeps the command, which is the same here and there.
pictures() { # program...
    for scene in $presets; do
        for precision in robust reference; do
            "$@" render "$scene" --size 48x27 --spp 4 --precision "$precision" --aov albedo,normal,depth,stderr -q -o picture.exr 2>/dev/null
            sha256sum <picture.exr
        done
    done
}
pictures "$native" >native.txt
echo "$(wc -l <native.txt) pictures on this processor: $(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2-)"
failed=0
for each in "${processors[@]}"; do
    # shellcheck disable=SC2086 # the command and its arguments
    pictures ${each#*|} >there.txt 2>/dev/null || true
    same=$(diff --unchanged-line-format='=' --old-line-format='' --new-line-format='' native.txt there.txt | wc -c || true)
    echo "${each%%|*}: $same of $(wc -l <native.txt) have the same bits"
    [ "$same" = "$(wc -l <native.txt)" ] || failed=1
done
exit $failed
