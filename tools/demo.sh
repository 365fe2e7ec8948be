#!/bin/sh
# Install into .venv, simulate one second of the bowl of fruit and draw its last frame.
set -eu
CDPATH='' cd -- "$(dirname -- "$0")/.."

python=.venv/bin/python
stamp=.venv/installed-render
if ! { pwd; cat pyproject.toml; } | cmp -s - "$stamp"; then
    if ! "$python" -m pip --version >/dev/null 2>&1; then
        for found in python3.13 python3.12 python3.11 python3 ''; do
            "$found" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && break
        done
        [ "$found" ] || { echo "demo.sh: this needs Python 3.11 or later" >&2; exit 1; }
        echo "making .venv with $("$found" --version)"
        "$found" -m venv --clear .venv
    fi
    echo "installing into .venv (0.7 GB at first)"
    "$python" -m pip install --quiet --disable-pip-version-check --editable '.[render]'
    { pwd; cat pyproject.toml; } >"$stamp"
fi

echo "simulating 60 frames of the bowl (the first run compiles the kernels, about a minute)"
.venv/bin/warp-contact run bowl --frames 60 --out out/bowl >/dev/null # progress: stderr
.venv/bin/warp-contact render out/bowl --frames=-1 --quiet
echo "USD      $PWD/out/bowl/bowl.usda"
echo "metrics  $PWD/out/bowl/metrics.jsonl"
echo "picture  $PWD/out/bowl/pictures/000060.png"
