#!/bin/sh
# Builds dist/ from src/, three.js and uPlot. `./build.sh check` fails if the committed dist/ is another.
set -eu
cd "$(dirname "$0")"
npm ci --no-audit --no-fund --silent
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
npx esbuild src/main.js --bundle --minify --format=esm --target=es2022 --legal-comments=none \
    --outfile="$out/page.js" --log-level=warning
npx esbuild src/page.css --bundle --minify --outfile="$out/page.css" --log-level=warning
cp src/index.html "$out/index.html"
{
    echo "The page of supple contains these works."
    for name in three uplot; do
        printf '\n==== %s %s ====\n\n' "$name" "$(node -p "require('./node_modules/$name/package.json').version")"
        cat "node_modules/$name/LICENSE"
    done
} > "$out/licences.txt"
if [ "${1:-}" = check ]; then
    diff -r dist "$out" || { echo "page/dist is not what page/src gives: run page/build.sh" >&2; exit 1; }
else
    mkdir -p dist
    cp "$out"/* dist/
fi
