#!/usr/bin/env bash
# Runs once, when the autograder is built: an environment with statemachine in it.
set -e
root="${AUTOGRADER:-/autograder}"
python=""
for each in python3.12 python3.11 python3.13 python3; do
    if "$each" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
        python="$each"
        break
    fi
done
if [ -z "$python" ]; then
    apt-get update -qq
    apt-get install -y -qq python3.11 python3.11-venv
    python=python3.11
fi
"$python" -m venv "$root/env"
"$root/env/bin/python" -m pip install -q --disable-pip-version-check \
    -c "$root/source/constraints.txt" "$root"/source/*.whl
