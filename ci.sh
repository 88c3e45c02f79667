#!/usr/bin/env bash
# The checks of this repository. `./ci.sh help` lists them.
set -euo pipefail
cd "$(dirname "$0")"

PLAIN=(fmt clippy test doctest doc)
FULL=(deny advisories page package site browser urdfs edits fuzz)
# Also of the full run: each mostly computes on one processor or waits, so they run one after the other beside those above.
BESIDE=(ur10e python impact services ros socketcan instructions fused cycles cortex-m)
CARGO_DENY_VERSION=0.20.2
CARGO_FUZZ_VERSION=0.13.2
GUNGRAUN_VERSION=0.20.0
THUMB=thumbv7em-none-eabihf

WORK=target/ci
RESULTS=$WORK/results
SKIPPED=77

# fmt: formatting
step_fmt() {
    cargo fmt --all --check
}

# clippy: lints of every target, and of the freestanding program, which needs its own profile
step_clippy() {
    # The Python package has the stable interface, for which PyO3 needs no interpreter.
    PYO3_NO_PYTHON=1 PYO3_BUILD_EXTENSION_MODULE=1 \
        cargo clippy --locked --workspace --all-targets -- -D warnings
    if [[ $(uname -sm) == "Linux x86_64" ]]; then
        cargo clippy --locked -p supple-bare --profile bare --features freestanding -- -D warnings
    fi
}

# test: unit, property and whole-system tests; among them `arrows` and `bare`
step_test() {
    cargo test --locked --workspace --exclude supple-python --lib --bins --tests
}

# arrows: dependencies between the crates, as ARCHITECTURE.md draws them (part of `test`)
step_arrows() {
    cargo test --locked --workspace --exclude supple-python --test architecture
}

# bare: the freestanding program links, prints the right bits, and refuses to allocate (part of `test`)
step_bare() {
    [[ $(uname -sm) == "Linux x86_64" ]] || skip "written for Linux on x86-64, this is $(uname -sm)"
    cargo test --locked --workspace --exclude supple-python --test bare
}

# doctest: examples in the documentation
step_doctest() {
    cargo test --locked --workspace --exclude supple-python --doc
}

# doc: the documentation builds without a warning
step_doc() {
    RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace --exclude supple-python --no-deps
}

# deny: licences, sources and bans of every dependency; installs cargo-deny under target/
step_deny() {
    cargo_deny check licenses sources bans
}

# page: the committed bundle of the live page is what its sources give, with three.js and uPlot from npm
step_page() {
    command -v npm >/dev/null || skip "there is no npm"
    crates/supple-view/page/build.sh check
}

# browser: the live page of a simulated and of an emulated arm in headless Chromium; installs Chromium and Playwright
step_browser() {
    needs_command chromium chromium
    virtual_environment browser crates/supple-view/page/requirements.txt
    build_programs
    CHROMIUM=$(command -v chromium) timeout 900 "$WORK/browser/bin/python" crates/supple-view/page/check_page.py \
        target/debug/supple $WORK/browser-screenshots
}

# advisories: known vulnerabilities, where their database can be fetched
step_advisories() {
    local log
    if ! log=$(cargo_deny fetch db 2>&1); then
        echo "$log"
        skip "the advisory database is out of reach"
    fi
    cargo_deny check --disable-fetch advisories
}

# python: logs as Python's own readers see them; installs the readers in a virtual environment
step_python() {
    virtual_environment python tests/python/requirements.txt
    SUPPLE_PYTHON=$PWD/$WORK/python/bin/python \
        cargo test --locked --workspace --exclude supple-python --test log -- --ignored python_readers
}

# package: the Python package: installation, stubs, tests beside its peers; installs those
step_package() {
    virtual_environment package python/requirements-test.txt
    local bin=$PWD/$WORK/package/bin
    # With the profile of the other tests.
    "$bin/pip" install --quiet --config-settings=build-args="--profile dev" ./python
    # The tests of a system in real time fail on a busy machine: they run when asked for.
    if [[ ${SUPPLE_LIVE:-} == 1 ]]; then
        build_programs
        export SUPPLE_PROGRAMS=$PWD/target/debug
    fi
    (
        cd python
        "$bin/python" -m mypy package/supple benchmarks examples
        "$bin/python" -m mypy.stubtest supple --mypy-config-file pyproject.toml
        "$bin/python" -m pytest
    )
}

# impact: MuJoCo still gives the impact against which the plant is tested; installs MuJoCo
step_impact() {
    virtual_environment impact crates/supple-plant/tests/requirements.txt
    "$WORK/impact/bin/python" crates/supple-plant/tests/impact_oracle.py
}

# site: the site of the documentation without a warning, its commands, figures and notebooks; uses what `package` installed, installs mkdocs and Jupyter
step_site() {
    local python=$PWD/$WORK/package/bin/python programs=target/debug made=target/site
    "$python" -c "import supple" 2>/dev/null || skip "./ci.sh package has not installed the Python package"
    virtual_environment package docs/site/requirements.txt
    build_programs
    rm -rf $made
    "$python" docs/site/check_inline.py --programs $programs
    "$python" docs/site/notebooks.py --programs $programs --out $made/notebooks >$WORK/notebooks.log 2>&1 &
    local notebooks=$!
    local status=0
    "$python" docs/site/run_commands.py --programs $programs --figures $made/figures || status=1
    wait $notebooks || status=1
    cat $WORK/notebooks.log
    [[ $status == 0 ]] || return 1
    local rustdoc=()
    [[ ! -d target/doc ]] || rustdoc=(--rustdoc target/doc)
    "$python" docs/site/build.py --programs $programs --figures $made/figures --notebooks $made/notebooks "${rustdoc[@]}"
    echo "the site is in $made/html"
}

# Builds the programs in target/debug as `test` does: with other targets cargo would select other features of dependencies and
# compile most of them again.
build_programs() {
    cargo test --locked --workspace --exclude supple-python --lib --bins --tests --no-run
}

# Makes a virtual environment of this name with these requirements.
virtual_environment() {
    needs_command python3 python3
    local environment=$WORK/$1
    if [[ ! -x $environment/bin/pip ]]; then
        python3 -m venv "$environment" || {
            needs_package python3-venv
            python3 -m venv "$environment"
        }
    fi
    "$environment/bin/pip" install --quiet --requirement "$2" ||
        skip "the packages of $2 cannot be installed"
}

# urdfs: ten public URDFs, unedited, through `supple new` and `up --plant sim`, three also through the demo; installs packages that carry them
step_urdfs() {
    virtual_environment urdfs tests/any_arm/requirements.txt
    build_programs
    "$WORK/urdfs/bin/python" tests/any_arm/run.py --programs target/debug --steps new,up
    # A demo takes minutes here: all of them are in urdfs_full.
    "$WORK/urdfs/bin/python" tests/any_arm/run.py --programs target/debug --steps demo --only ur5e,xarm7,so101
}

# urdfs_full: these and six more, identified too, with optimised programs; in no list
step_urdfs_full() {
    virtual_environment urdfs tests/any_arm/requirements-held-back.txt
    cargo build --release --locked --workspace --exclude supple-python --exclude supple-ros --bins
    "$WORK/urdfs/bin/python" tests/any_arm/run.py --programs target/release --all
}

# instructions: instruction counts of the core against committed limits, and no bounds checks; installs Valgrind and gungraun-runner
step_instructions() {
    [[ $(uname -sm) == "Linux x86_64" ]] || skip "the limits are those of Linux on x86-64, this is $(uname -sm)"
    needs_command valgrind valgrind
    [[ -e /usr/lib/debug/.build-id || -e /usr/share/doc/libc6-dbg ]] || needs_package libc6-dbg
    local root=target/tools
    gungraun_runner
    GUNGRAUN_RUNNER=$PWD/$root/bin/gungraun-runner RUSTFLAGS="" \
        cargo bench --locked -p supple-benches --bench instructions
    needs_command objdump binutils
    local programs=(target/release/deps/instructions-*[0-9a-f])
    benches/assembly.sh "$(ls -t "${programs[@]}" | head -n 1)"
}

# fused: the core's tests as built for this processor, where that has fused multiply-add
step_fused() {
    [[ $(rustc -C target-cpu=native --print cfg) == *'target_feature="fma"'* ]] ||
        skip "this processor has no fused multiply-add"
    RUSTFLAGS="-C target-cpu=native" cargo test --locked -p supple-core --tests --target-dir target/fused
}

# ur10e: identification from logs of a real UR10e, where SUPPLE_UR10E_DIR names their folder
step_ur10e() {
    local folder=${SUPPLE_UR10E_DIR:-}
    [[ -n $folder && -f $folder/ur10e.urdf ]] || skip "SUPPLE_UR10E_DIR names no folder with ur10e.urdf and the logs"
    SUPPLE_UR10E_DIR=$(realpath "$folder") \
        cargo test --locked --workspace --exclude supple-python --test ident -- --ignored ur10e
}

# edits: a scalar and a torque term are added to a copy of the tree by two edits each; its logs have them
step_edits() {
    cargo test --locked --workspace --exclude supple-python --test record_edits -- --ignored
}

# cycles: 10 million cycles of the core with random requests and inputs, as `test` builds it; SUPPLE_CYCLES for another number
step_cycles() {
    SUPPLE_CYCLES=${SUPPLE_CYCLES:-10000000} cargo test --locked --workspace --exclude supple-python --test cycles
}

# fuzz: each target of tests/fuzz for a minute, SUPPLE_FUZZ_S for another time; without a nightly compiler, seeded mutations
step_fuzz() {
    local seconds=${SUPPLE_FUZZ_S:-60}
    [[ $seconds != 0 ]] || skip "SUPPLE_FUZZ_S=0: seeded mutations of every target are part of \`test\`"
    if ! nightly_fuzz; then
        echo "no nightly compiler or no cargo-fuzz: seeded mutations on the stable compiler"
        SUPPLE_FUZZ_FACTOR=$seconds cargo test --locked --release -p supple-fuzz --test corpus
        return
    fi
    local work=$PWD/$WORK/fuzz programs=tests/fuzz/libfuzzer target
    rm -rf "$work"
    mkdir -p "$work/tmp" "$work/artifacts"
    SUPPLE_FUZZ_WRITE=$work/corpus cargo test --locked --workspace --exclude supple-python --test corpus -- \
        --ignored write_seeds
    cargo +nightly fuzz build --fuzz-dir $programs --target-dir "$PWD/target/fuzz" --sanitizer none
    for target in $(sed -n 's/^name = "\(.*\)"$/\1/p' $programs/Cargo.toml | tail -n +2); do
        # New inputs go into the first folder, which is thrown away; what fails is kept among the artifacts.
        TMPDIR=$work/tmp "$(fuzz_program "$target")" "$work/corpus/$target" "tests/fuzz/corpus/$target" \
            -artifact_prefix="$work/artifacts/$target-" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 \
            -print_final_stats=1 >"$work/$target.log" 2>&1 || {
            tail -n 40 "$work/$target.log"
            echo "target $target failed: the input is in $work/artifacts"
            return 1
        }
        echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$work/$target.log") inputs in $seconds s"
    done
}

# Whether programs for libFuzzer can be built here; installs what it takes.
nightly_fuzz() {
    cargo +nightly --version >/dev/null 2>&1 ||
        rustup toolchain install nightly --profile minimal >&2 ||
        return 1
    local root=target/tools
    if [[ $("$root/bin/cargo-fuzz" --version 2>/dev/null) != "cargo-fuzz $CARGO_FUZZ_VERSION" ]]; then
        install_tool cargo-fuzz@$CARGO_FUZZ_VERSION || return 1
    fi
    export PATH=$PWD/$root/bin:$PATH
}

fuzz_program() {
    echo "target/fuzz/$(rustc -vV | sed -n 's/^host: //p')/release/$1"
}

# cortex-m: the freestanding program on an emulated Cortex-M4; installs QEMU and the compiler's target
step_cortex-m() {
    needs_command qemu-system-arm qemu-system-arm
    if ! thumb_core && ! rustup target add $THUMB; then
        [[ -d $(rustc --print sysroot)/lib/rustlib/src/rust/library ]] ||
            rustup component add rust-src ||
            skip "neither the $THUMB target nor the core library's source can be had"
        export SUPPLE_BUILD_STD=1
    fi
    cargo test --locked --workspace --exclude supple-python --test bare -- --ignored cortex_m
}

# socketcan: the arm's bus on a CAN interface of Debian's kernel in a virtual machine; installs QEMU, fetches the kernel
step_socketcan() {
    [[ $(uname -sm) == "Linux x86_64" ]] || skip "written for Linux on x86-64, this is $(uname -sm)"
    needs_command qemu-system-x86_64 qemu-system-x86
    needs_command busybox busybox-static
    needs_command cpio cpio
    local status=0
    tests/socketcan/run.sh $WORK/socketcan | tee $WORK/socketcan.log || status=$?
    [[ $status != "$SKIPPED" ]] || skip "$(tail -n 1 $WORK/socketcan.log)"
    return $status
}

# services: the units of assets/systemd are sound and expose at most 2.0 of 10 points; installs systemd's tools
step_services() {
    needs_command systemd-analyze systemd
    local unit copy
    mkdir -p $WORK/services
    for unit in assets/systemd/*.service; do
        # Verified where the programs are not installed.
        copy=$WORK/services/$(basename "$unit")
        sed 's#^ExecStart=/usr/local/bin/[a-z-]*#ExecStart=/bin/true#' "$unit" >"$copy"
        systemd-analyze verify --man=no "$copy"
        systemd-analyze security --offline=true --no-pager --threshold=20 "$unit" | tail -n 1
    done
}

# ros: the bridge to ROS 2 with a client of other makers, on a simulated arm; installs that
step_ros() {
    virtual_environment ros tests/ros/requirements.txt
    build_programs
    "$WORK/ros/bin/python" tests/ros/run.py --programs target/debug
}

thumb_core() {
    compgen -G "$(rustc --print target-libdir --target $THUMB)/libcore-*" >/dev/null
}

cargo_deny() {
    local root=target/tools
    if [[ $("$root/bin/cargo-deny" --version 2>/dev/null) != "cargo-deny $CARGO_DENY_VERSION" ]]; then
        install_tool cargo-deny@$CARGO_DENY_VERSION
    fi
    "$root/bin/cargo-deny" "$@"
}

gungraun_runner() {
    if [[ $(target/tools/bin/gungraun-runner --version 2>/dev/null) != "gungraun-runner $GUNGRAUN_VERSION" ]]; then
        install_tool gungraun-runner@$GUNGRAUN_VERSION
    fi
}

# Builds a tool under target/tools; unoptimised and without debug information, which takes half the time and serves as well.
install_tool() {
    local root=target/tools
    # One at a time: a step beside this one may install, too.
    (
        flock 9
        CARGO_PROFILE_DEV_DEBUG=0 CARGO_PROFILE_DEV_OPT_LEVEL=0 cargo install --quiet --locked --debug --root $root --target-dir $root/build "$1" >&2 || exit 1
        rm -rf $root/build
    ) 9>"$WORK/tools.lock"
}

# Installs a package for a missing command.
needs_command() {
    command -v "$1" >/dev/null || needs_package "$2"
}

needs_package() {
    local install="apt-get install --yes --no-install-recommends $1" log=$WORK/apt-$1.log
    command -v apt-get >/dev/null || skip "needs the package $1"
    [[ $(id -u) == 0 ]] || skip "needs the package $1: sudo $install"
    export DEBIAN_FRONTEND=noninteractive
    # One at a time: a step beside this one may install, too.
    (flock 9 && apt-get update && $install) 9>"$WORK/apt.lock" >"$log" 2>&1 || {
        tail -n 5 "$log"
        skip "the package $1 cannot be installed"
    }
}

# Ends a step that cannot run here.
skip() {
    echo "$*" >"$WORK/reason-${STEP:-none}"
    exit $SKIPPED
}

# Runs one step and records how it ended.
run() {
    local step=$1 start=$SECONDS status outcome reason="" STEP=$1
    mkdir -p "$RESULTS"
    rm -f "$WORK/reason-$step"
    echo "==> $step: $(describe "$step")"
    # The log is for the summary. What a step leaves running may hold its output: nobody waits for `tee`.
    set +e
    (
        set -e
        "step_$step"
    ) > >(tee "$WORK/step-$step.log") 2>&1
    status=$?
    set -e
    case $status in
    0) outcome=passed ;;
    "$SKIPPED") outcome=skipped reason=": $(cat "$WORK/reason-$step")" ;;
    *) outcome=failed reason=": status $status" ;;
    esac
    printf '%s %s (%d s)%s\n' "$step" "$outcome" $((SECONDS - start)) "$reason" |
        tee "$RESULTS/$step"
}

# The last lines of each step that failed, one line a step (by default every step on record), then the counts; fails where a step
# failed.
summary() {
    local step passed=0 failed=0 skipped=0
    [[ $# -gt 0 ]] || set -- $(ls -tr "$RESULTS")
    # The logs of the last steps may still be written.
    sleep 1
    for step in "$@"; do
        if [[ $(cut -d ' ' -f 2 "$RESULTS/$step") == failed ]]; then
            echo "==> $step failed; its last lines:"
            grep -av '^ *\(Compiling\|Executable\|Running\) ' "$WORK/step-$step.log" | tail -n 40 || true
        fi
    done
    echo "==> summary"
    for step in "$@"; do
        cat "$RESULTS/$step"
        case $(cut -d ' ' -f 2 "$RESULTS/$step") in
        passed) passed=$((passed + 1)) ;;
        skipped) skipped=$((skipped + 1)) ;;
        *) failed=$((failed + 1)) ;;
        esac
    done
    echo "$passed passed, $failed failed, $skipped skipped"
    [[ $failed == 0 ]]
}

run_all() {
    local step
    for step in "$@"; do
        run "$step"
    done
}

describe() {
    sed -n "s/^# $1: //p" ci.sh
}

help() {
    cat <<END
./ci.sh          ${PLAIN[*]}: no root, nothing installed
./ci.sh full     ${FULL[*]}, beside them ${BESIDE[*]}: what the plain run leaves out; as root, installs packages
./ci.sh tools    builds the tools of the full run, whose steps otherwise do it
./ci.sh summary  how every step on record ended
./ci.sh STEP...  these steps:
END
    local step
    for step in $(sed -n 's/^step_\(.*\)() {$/\1/p' ci.sh); do
        printf '    %-12s %s\n' "$step" "$(describe "$step")"
    done
}

main() {
    case ${1:-plain} in
    plain)
        run_all "${PLAIN[@]}"
        echo "==> left to ./ci.sh full, which installs what they need"
        local step
        for step in "${FULL[@]}" "${BESIDE[@]}"; do
            echo "$step: $(describe "$step")"
        done
        summary "${PLAIN[@]}"
        ;;
    full)
        mkdir -p "$WORK"
        # A step that does not get to its end has no result, which the summary does not accept.
        (cd "$RESULTS" 2>/dev/null && rm -f "${FULL[@]}" "${BESIDE[@]}") || true
        run_all "${BESIDE[@]}" >"$WORK/beside.log" 2>&1 &
        local beside=$!
        run_all "${FULL[@]}"
        wait $beside || true
        cat "$WORK/beside.log"
        summary "${FULL[@]}" "${BESIDE[@]}"
        ;;
    tools)
        # Built before the steps that need them, which otherwise build them themselves.
        cargo_deny --version
        gungraun_runner
        ;;
    summary) summary ;;
    help | -h | --help) help ;;
    *)
        local step
        for step in "$@"; do
            if ! declare -F "step_$step" >/dev/null; then
                echo "no step named $step" >&2
                help >&2
                exit 2
            fi
        done
        run_all "$@"
        summary "$@"
        ;;
    esac
}

main "$@"
