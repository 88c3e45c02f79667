#!/usr/bin/env bash
# Our dynamics beside Pinocchio and beside C generated for each arm by CasADi: same arms, same states,
# same law, in turn on one core. Rewrites RESULTS.md, results.json and growth.svg beside this file; fails
# where the outputs differ.
#
#     benches/peers/run.sh [--rounds N] [--core N]
#
# Installs what it needs: Python packages in target/peers, clang from the system's packages (as root).
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=target/peers

if ! command -v clang++ >/dev/null; then
    [[ $(id -u) == 0 ]] || {
        echo "needs clang++: sudo apt-get install --no-install-recommends clang" >&2
        exit 1
    }
    apt-get update
    DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends clang
fi
mkdir -p $folder
if [[ ! -x $folder/python/bin/pip ]]; then
    python3 -m venv $folder/python
fi
$folder/python/bin/pip install --quiet --requirement benches/peers/requirements.txt

export PYTHONDONTWRITEBYTECODE=1
RUSTFLAGS="-C target-cpu=native" \
    cargo build --locked --release --package supple-benches --bin peers --target-dir $folder/cargo
exec $folder/python/bin/python benches/peers/run.py --folder $folder "$@"
