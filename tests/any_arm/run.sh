#!/bin/sh
# Public URDFs, unedited: installs packages that carry them by name, and runs the demo's sinusoid on each for 60 s with two
# perturbed models. Fails if an arm does not load, ends with a fault, or errs more than 15 mm RMS, or more than that in
# proportion to its weight at the tip where it is heavier there than the WAM (23 N).
set -eu
here=$(cd "$(dirname "$0")" && pwd)
repository=$(cd "$here/../.." && pwd)
venv="${CARGO_TARGET_DIR:-$repository/target}/any_arm"
[ -d "$venv" ] || python3 -m venv "$venv"
"$venv/bin/pip" install -q example-robot-data==6.0.0 airo-models==0.0.12 pybullet
packages=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])')
cases=$(sed -e "s#^PACKAGES#$packages#" -e "s#^REPOSITORY#$repository#" "$here/cases.txt")
cd "$repository"
# shellcheck disable=SC2086 # one argument per case, no case has a space
cargo run --release -q -p supple-experiment --example any_arm -- $cases > "$venv/results.txt"
cat "$venv/results.txt"
awk -v wanted="$(wc -l < "$here/cases.txt")" '
    / FAILED: / { print "failed: " $0; bad = 1; next }
    {
        for (i = 1; i <= NF; i++) {
            if ($i == "mm,") error = $(i - 1)
            if ($i == "faults") faults = $(i - 1)
            if ($i == "N,") weight = $(i - 1)
        }
        allowed = 15 * (weight > 23 ? weight / 23 : 1)
        if (faults > 0 || error > allowed) { print "not allowed (" allowed " mm): " $0; bad = 1 }
    }
    END {
        if (NR != wanted) { print NR " of " wanted " arms"; bad = 1 }
        exit bad
    }
' "$venv/results.txt"
