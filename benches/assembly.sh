#!/usr/bin/env bash
# Checks that the release code of the dynamics and the law contains no bounds check: no function, and no loop
# that calls one, may reach a panic. `./ci.sh instructions` calls it.
#
#     benches/assembly.sh [PROGRAM] by default the program that benches/peers/run.sh builds
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
        ours = name ~ /supple_core::(dynamics|law|math)::|^(peers|instructions)::/
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
        # Far fewer functions mean that the names have changed and nothing was checked.
        exit found > 0 || functions < 10 || instructions < 10000
    }'
