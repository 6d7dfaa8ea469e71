#!/usr/bin/env bash
# Checks that change nothing: C++ formatting, ruff, the layer rule, clang-tidy. Runs all of them, then says which failed.
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

# Files that pull in LLVM, OpenImageIO, Embree or nanobind cost minutes each under clang-tidy: the check is for our own
# code, so it reads the core folders' sources that stand on the standard library alone.
tidy() {
    git ls-files 'src/base/*.cpp' 'src/grid/*.cpp' 'src/scene/*.cpp' 'src/store/*.cpp' |
        xargs -r grep -LE '#include <(llvm|OpenImageIO|opensubdiv|embree|nanobind|OpenEXR|Imf|gtest|tbb|nlohmann)' |
        xargs -r -P "$jobs" -n 4 clang-tidy-19 -p "$build" --quiet 2> >(grep -v 'warnings generated\|^$' >&2)
}

check "formatting of C++ (make format mends it)" format
check "formatting of Python (make format mends it)" .venv/bin/ruff format --check .
check "ruff" .venv/bin/ruff check .
check "layers" .venv/bin/python tools/check_layers.py
check "clang-tidy" tidy

echo
if ((${#failed[@]})); then
    printf 'lint: FAILED: %s\n' "${failed[@]}"
    exit 1
fi
echo "lint: clean"
