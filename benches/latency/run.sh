#!/usr/bin/env bash
# Measures the latency of the processes of a system: the simulated arm with its controller, cyclictest, a bare
# echo of datagrams of the same sizes, and the system's messages alone, alternating on one core. Rewrites
# RESULTS.md and results.json in this folder.
#
#     benches/latency/run.sh [--seconds N] [--rounds N] [--core N] [--smoke]
#
#     benches/latency/run.sh --system [--seconds N] [--rounds N]
#
# The second form runs complete systems, `supple up` with a WAM (also with viewers), OpenArm and YAM, alternating with
# cyclictest, and rewrites SYSTEM.md. With real-time permission (root) all of them use SCHED_FIFO and locked memory,
# otherwise none does. --smoke: one round of two seconds; writes no files. Installs cyclictest from the system's
# packages (as root).
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
