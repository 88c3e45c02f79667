# What commands.toml uses in place of a second terminal.

# Starts a system, once the one before has ended, and waits until it tracks.
background() {
    local pid attempt
    while [[ -f .pid ]] && kill -0 "$(cat .pid)" 2>/dev/null; do
        sleep 0.1
    done
    "$@" >.background 2>&1 &
    pid=$!
    echo $pid >.pid
    for attempt in $(seq 600); do
        if supple status 2>/dev/null | grep -q '^mode *track'; then
            return 0
        fi
        kill -0 $pid 2>/dev/null || break
        sleep 0.1
    done
    cat .background
    echo "does not track: $*"
    return 1
}

# Starts a server, fetches the page whose URL it prints, and ends it.
serves() {
    : >.served
    "$@" >.served 2>&1 &
    local pid=$! url=""
    for _ in $(seq 300); do
        url=$(grep -o -m 1 'http://127\.0\.0\.1:[^ ]*' .served || true)
        [[ -z $url ]] || break
        kill -0 $pid 2>/dev/null || break
        sleep 0.1
    done
    python -c 'import sys, urllib.request as r; assert b"supple" in r.urlopen(sys.argv[1], timeout=60).read()' "$url" || {
        cat .served
        return 1
    }
    kill -INT $pid
    wait $pid || [[ $? == 130 ]]
}
