#!/usr/bin/env bash
# Checks that change nothing: C++ formatting, ruff, the layer rule, sizes, clang-tidy. Runs all of them, then says which
# failed.
set -uo pipefail
cd "$(dirname "$0")/.."
build=${1:-build}
jobs=${2:-$(nproc)}
failed=()

check() {
    local name=$1
    shift
    echo "== $name"
    "$@" || failed+=("$name")
}

format() { git ls-files '*.cpp' '*.h' | xargs -r clang-format-19 --dry-run -Werror; }

check "formatting of C++ (make format mends it)" format
check "formatting of Python (make format mends it)" .venv/bin/ruff format --check .
check "ruff" .venv/bin/ruff check .
check "layers" .venv/bin/python tools/check_layers.py
check "sizes" .venv/bin/python tools/check_sizes.py
check "clang-tidy" .venv/bin/python tools/tidy.py "$build" --jobs "$jobs"

echo
if ((${#failed[@]})); then
    printf 'lint: FAILED: %s\n' "${failed[@]}"
    exit 1
fi
echo "lint: clean"
