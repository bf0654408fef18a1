#!/bin/sh
# Builds the Debian package, with manual pages and completions, into target/debian/, or $CARGO_TARGET_DIR/debian/.
#
#   packaging/debian.sh
#
# Needs cargo-deb (cargo install cargo-deb). What the package holds is said in Cargo.toml.
set -eu

cd "$(dirname -- "$0")/.."
cargo build --release --locked
program=${CARGO_TARGET_DIR:-target}/release/lightmesh
# Cargo.toml names this folder.
package=target/package
rm -rf "$package"
mkdir -p "$package"
"$program" man "$package/man1"
"$program" completions bash >"$package/lightmesh.bash"
"$program" completions zsh >"$package/_lightmesh"
"$program" completions fish >"$package/lightmesh.fish"
cargo deb --no-build --locked
