#!/bin/sh
# Install into .venv and run the tests; arguments go to pytest.
set -eu
CDPATH='' cd -- "$(dirname -- "$0")/.."

install() { . tools/venv.sh; } # its own "$1", so that the arguments stay
install test

exec .venv/bin/python -P -m pytest "$@"
