#!/usr/bin/env bash
# No bounds check is left in the dynamics and the law: none of their functions, and none of the loops that
# call them, as compiled for release, can reach a panic. Fails where one can. `./ci.sh instructions` calls it.
#
#     benches/assembly.sh [PROGRAM]       by default the one that benches/peers/run.sh has built
set -euo pipefail
cd "$(dirname "$0")/.."
command -v objdump >/dev/null || {
    echo "needs objdump: sudo apt-get install binutils" >&2
    exit 1
}
program=${1:-target/peers/cargo/release/peers}
[[ -x $program ]] || {
    echo "no program $program: benches/peers/run.sh builds it" >&2
    exit 1
}
objdump --disassemble --demangle --no-show-raw-insn "$program" | awk '
    /^[0-9a-f]+ <.*>:$/ {
        name = $0
        sub(/^[0-9a-f]+ </, "", name)
        sub(/>:$/, "", name)
        ours = name ~ /supple_core::(dynamics|operational|factors|linalg|lanes|sincos)|^(peers|instructions)::/
        if (ours) { functions++; seen[name] = 1 }
        next
    }
    ours { instructions++ }
    ours && /call/ && /panic|_fail|unwrap/ {
        print name ": " substr($0, index($0, "<"))
        found++
    }
    END {
        for (name in seen) { kinds++ }
        printf "%d functions (%d names), %d instructions, %d calls that panic\n", functions, kinds, instructions, found
        # Far fewer would mean that the names have changed and nothing was looked at.
        exit found > 0 || functions < 10 || instructions < 10000
    }'
