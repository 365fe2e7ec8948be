#!/bin/sh
# On a machine with a GPU: tools/gpu.sh [DEVICE] [FOLDER] writes into FOLDER, of cuda:0 into out/gpu,
#   bits.txt       whether two runs of tools/fingerprint.py have the same bits
#   scenes.txt     the first frames of each scene, against the same on the CPU
#   bench.txt      where the time goes
#   suite.txt      the tests
# Each part has a longest time, ten minutes in all. The exit status is 1 where a part failed.
set -eu
CDPATH='' cd -- "$(dirname -- "$0")/.."

device=${1:-cuda:0} out=${2:-out/gpu} failed=0
install() { . tools/venv.sh; }
install test
python=.venv/bin/python
mkdir -p "$out"
"$python" -c 'import sys, warp; print(warp.get_device(sys.argv[1]).name)' "$device" | tail -n 1

part() { # name, longest time [s], command
    name=$1 seconds=$2
    shift 2
    if timeout "$seconds" "$@" >"$out/$name.txt" 2>"$out/$name.log"; then
        echo "$name: ok"
    else
        echo "$name: failed, see $out/$name.txt and .log"
        failed=1
    fi
}

part first 80 "$python" tools/fingerprint.py --device "$device"
part bits 40 "$python" tools/fingerprint.py --device "$device" --against "$out/first.txt"
part scenes 90 "$python" tools/devices.py "$device"
part bench 120 "$python" tools/bench.py two_bodies membrane_stack bowl \
    pile_1000 pile_10000 pile_100000 worlds_1 worlds_16 worlds_256 \
    --device "$device" --repeats 3
part suite 270 "$python" -P -m pytest -q -k "$device"
exit "$failed"
