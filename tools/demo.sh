#!/bin/sh
# Install into .venv, simulate one second of the bowl of fruit and draw its last frame.
set -eu
CDPATH='' cd -- "$(dirname -- "$0")/.."

set -- render
. tools/venv.sh

echo "simulating 60 frames of the bowl (the first run compiles the kernels, about half a minute)"
.venv/bin/warp-contact run bowl --frames 60 --out out/demo --overwrite >/dev/null # progress: stderr
.venv/bin/warp-contact render out/demo --frames=-1 --quiet
echo "USD      $PWD/out/demo/demo.usda"
echo "metrics  $PWD/out/demo/metrics.jsonl"
echo "picture  $PWD/out/demo/pictures/000060.png"
