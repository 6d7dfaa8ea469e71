#!/usr/bin/env bash
# Runs the C++ and the Python tests, both whatever the first says, and ends with one summary.
set -uo pipefail
cd "$(dirname "$0")/.."
build=${1:-build}
jobs=${2:-$(nproc)}

echo "== C++ unit tests"
ctest --test-dir "$build" --output-on-failure --parallel "$jobs" --progress
cpp=$?
echo "== Python tests"
.venv/bin/python -m pytest tests
py=$?

verdict() { if (($1 == 0)); then echo passed; else echo "FAILED (exit $1)"; fi; }
echo
echo "C++ unit tests: $(verdict $cpp)"
echo "Python tests:   $(verdict $py)"
exit $((cpp != 0 || py != 0))
