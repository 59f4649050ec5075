#!/usr/bin/env bash
# Makes a release for this system: a program that needs no libraries (Linux), its manual pages, completions and licences, packed, with a checksum.
#
#   dist/build.sh [FOLDER]     # default: target/dist, or dist in CARGO_TARGET_DIR
#
# Needs a Rust toolchain, Python 3 and tar. On Linux the program is tried in a root folder that holds nothing else. Where maturin is installed,
# the wheel for Python is made too.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
folder=${1:-$target/dist}
host=$(rustc -vV | sed -n 's/^host: //p')
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
name=raywright-$version-$host
out=$folder/$name

# With a target of its own, procedural macros and build scripts keep the flags of the host.
case $host in
*-linux-gnu) RUSTFLAGS="${RUSTFLAGS:-} -C target-feature=+crt-static" cargo build --profile distribution --locked --target "$host" ;;
*) cargo build --profile distribution --locked --target "$host" ;;
esac
program=$target/$host/distribution/raywright
[ -e "$program" ] || program=$program.exe

rm -rf "$out"
mkdir -p "$out/man" "$out/completions"
cp "$program" "$out/"
cp README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE dist/raywright.thumbnailer "$out/"
python3 dist/licences.py "$host" >"$out/THIRD-PARTY.md"
"$program" man >"$out/man/raywright.1"
for command in $("$program" --help | awk '/^Commands:/ { on = 1; next } on && /^$/ { exit } on && /^  [a-z]/ && $1 != "help" { print $1 }'); do
    "$program" man "$command" >"$out/man/raywright-$command.1"
done
for shell in bash zsh fish; do
    "$program" completions "$shell" >"$out/completions/raywright.$shell"
done

# Nothing but the program: what it needs beside itself would be missing here.
if [ "$(uname)" = Linux ]; then
    root=$(mktemp -d)
    trap 'rm -rf "$root"' EXIT
    cp "$program" "$root/"
    enter=(chroot "$root")
    [ "$(id -u)" = 0 ] || enter=(unshare --map-root-user chroot "$root")
    "${enter[@]}" /raywright preset:whitted --size 64x36 -o /whitted.png
    test -s "$root/whitted.png"
fi

tar -C "$folder" -czf "$folder/$name.tar.gz" "$name"
sum=$(command -v sha256sum || echo "shasum -a 256")
(cd "$folder" && $sum "$name.tar.gz" >"$name.tar.gz.sha256" && cat "$name.tar.gz.sha256")
if command -v maturin >/dev/null; then
    maturin build --profile distribution --locked -m crates/python/Cargo.toml -o "$folder"
fi
