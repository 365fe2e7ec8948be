# Sourced from the root of the project: makes .venv once and installs the extra "$1" into it.

python=.venv/bin/python
stamp=.venv/installed-$1
if ! { pwd; cat pyproject.toml setup.py; } | cmp -s - "$stamp"; then
    if ! "$python" -m pip --version >/dev/null 2>&1; then
        for found in python3.13 python3.12 python3.11 python3 ''; do
            "$found" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && break
        done
        [ "$found" ] || { echo "this needs Python 3.11 or later" >&2; exit 1; }
        echo "making .venv with $("$found" --version)"
        "$found" -m venv --clear .venv
    fi
    echo "installing into .venv (0.7 GB at first)"
    "$python" -m pip install --quiet --disable-pip-version-check --editable ".[$1]"
    { pwd; cat pyproject.toml setup.py; } >"$stamp"
fi
