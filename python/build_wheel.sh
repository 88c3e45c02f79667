#!/usr/bin/env bash
# Builds what is carried to machines without a Rust toolchain, for Linux with this processor's architecture:
#
#   python/build_wheel.sh [FOLDER]      default: target/wheel
#
# FOLDER/supple-VERSION-cp311-abi3-manylinux_2_28_ARCH.whl   the Python package with the programs
# FOLDER/supple-VERSION-ARCH.tar.gz                          the programs, manual pages and completions
#
# Both need glibc 2.28 or later: zig, from PyPI, links against that version, whatever this machine has. SUPPLE_GLIBC names
# another. Everything runs on every processor of the architecture (RUSTFLAGS), unlike what `pip install ./python` builds.
set -euo pipefail
cd "$(dirname "$0")/.."

OUT=$(realpath -m "${1:-target/wheel}")
GLIBC=${SUPPLE_GLIBC:-2.28}
ARCH=$(uname -m)
HOST=$(rustc -vV | sed -n 's/^host: //p')
TOOLS=target/ci/wheel
# One folder for each part: their flags differ, and in a common one each part would compile the other's dependencies again.
PROGRAMS_TARGET=target/wheel-programs
PACKAGE_TARGET=target/wheel-package
PROGRAMS=(supple supple-report supple-ros supple-rt supple-sim supple-can supple-emu)
[[ $HOST == *-linux-gnu ]] || {
    echo "written for Linux with glibc, this is $HOST" >&2
    exit 1
}

[[ -x $TOOLS/bin/pip ]] || python3 -m venv $TOOLS
$TOOLS/bin/pip install --quiet --requirement python/requirements-wheel.txt
export PATH=$PWD/$TOOLS/bin:$PATH RUSTFLAGS=""
export CARGO_PROFILE_RELEASE_DEBUG=false CARGO_PROFILE_RELEASE_STRIP=symbols

packages=()
for program in "${PROGRAMS[@]}"; do packages+=(--bin "$program"); done
cargo zigbuild --release --locked --workspace --exclude supple-python "${packages[@]}" --target "$HOST.$GLIBC" \
    --target-dir "$PROGRAMS_TARGET"
built=$PROGRAMS_TARGET/$HOST/release

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$OUT" "$work/programs" "$work/share"
for program in "${PROGRAMS[@]}"; do cp "$built/$program" "$work/programs/"; done
"$built/supple" man "$work/share/man/man1" >/dev/null
completions() {
    mkdir -p "$work/share/$2"
    "$built/supple" completions "$1" >"$work/share/$2/$3"
}
completions bash bash-completion/completions supple
completions zsh zsh/site-functions _supple
completions fish fish/vendor_completions.d supple.fish

maturin build --release --locked --zig --compatibility "manylinux_${GLIBC/./_}" --target "$HOST" \
    --manifest-path python/Cargo.toml --target-dir "$PACKAGE_TARGET" --out "$work/wheel"
python3 python/add_programs.py "$work"/wheel/*.whl "$work" --out "$OUT"

version=$("$built/supple" --version | cut -d ' ' -f 2)
name=supple-$version-$ARCH
mkdir -p "$work/$name/bin"
cp "$work"/programs/* "$work/$name/bin/"
cp -r "$work/share" "$work/$name/"
cp LICENSE-APACHE LICENSE-MIT README.md CHANGELOG.md "$work/$name/"
tar --create --gzip --file "$OUT/$name.tar.gz" --directory "$work" --sort=name --owner=0 --group=0 "$name"
ls -l "$OUT"
