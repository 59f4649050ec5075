#!/usr/bin/env bash
# Makes a version ready to go out: checks that all files name the same one, packs the program, packs and compiles each crate as crates.io would
# get it, and tags the commit. Nothing leaves this machine.
#
#   dist/release.sh
#
# What sends it out: `git push origin vX.Y.Z`, whose workflow packs it on three systems, and `cargo publish --workspace`.
set -euo pipefail
cd "$(dirname "$0")/.."
fail() {
    echo "error: $1" >&2
    exit 1
}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
[ -z "$(git status --porcelain)" ] || fail "files differ from the last commit: commit them first"
grep -qx "version: $version" CITATION.cff || fail "CITATION.cff does not name $version"
heading=$(grep -m 1 '^## ' CHANGELOG.md)
[[ $heading =~ ^"## $version, "[0-9]{4}-[0-9]{2}-[0-9]{2}$ ]] || fail "CHANGELOG.md begins with \`$heading\`, not with \`## $version, DATE\`"
! git rev-parse -q --verify "refs/tags/v$version" >/dev/null || fail "v$version is tagged already: raise the version of Cargo.toml"
cargo publish --dry-run --workspace --locked
dist/build.sh
git tag -a "v$version" -m "Raywright $version"
echo "tagged v$version"
