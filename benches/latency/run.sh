#!/usr/bin/env bash
# How soon the processes of a system wake and answer: the simulated arm with its controller, cyclictest, a bare
# echo of datagrams of the same sizes, and the system's messages alone, in turn on one core. Rewrites RESULTS.md
# and results.json beside this file.
#
#     benches/latency/run.sh [--seconds N] [--rounds N] [--core N] [--smoke]
#
#     benches/latency/run.sh --system [--seconds N] [--rounds N]
#
# The second runs whole systems, `supple up --plant sim` and `--plant emu`, in turn with cyclictest, and rewrites
# SYSTEM.md. As root all of them have SCHED_FIFO and locked memory; without the right none has. --smoke: two seconds, one
# round, and nothing is written. Installs cyclictest from the system's packages (as root).
set -euo pipefail
cd "$(dirname "$0")/../.."

if ! command -v cyclictest >/dev/null; then
    [[ $(id -u) == 0 ]] || {
        echo "needs cyclictest: sudo apt-get install --no-install-recommends rt-tests" >&2
        exit 1
    }
    apt-get update
    DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends rt-tests
fi
export PYTHONDONTWRITEBYTECODE=1
programs=${CARGO_TARGET_DIR:-target}/release
if [[ ${1:-} == --system ]]; then
    shift
    cargo build --locked --release --workspace --exclude supple-python \
        --bin supple --bin supple-rt --bin supple-sim --bin supple-can --bin supple-emu
    exec python3 benches/latency/system.py --programs "$programs" "$@"
fi
cargo build --locked --release --package supple-rt --package supple-sim --package supple-latency
exec python3 benches/latency/run.py --programs "$programs" "$@"
