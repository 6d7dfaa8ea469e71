#!/usr/bin/env bash
# What reads foreign bytes, under AddressSanitizer and UndefinedBehaviorSanitizer: the unit tests of parsers, stores,
# geometry and readers, then whole renders of mutated input (tests/fuzz/render_fuzz.cpp) and of random calls from Python
# (tests/fuzz/python_fuzz.py), the same seeds every time.
# Integrators are built for paths alone, without UBSan: they read no files, and cost as much as all the rest.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build-sanitize}
jobs=${2:-$(nproc)}
# OpenImageIO deletes its texture system by a base class without a virtual destructor: harmless, and not ours.
export ASAN_OPTIONS=detect_leaks=0:new_delete_type_mismatch=0:quarantine_size_mb=64 UBSAN_OPTIONS=print_stacktrace=1

folders=(base scene ingest store hierarchy geom dice film)
# Kinds of input, and cases: one or two minutes each on one core.
kinds=(scenes:400 shaders:60 slo:400 cache:15 textures:150 pages:3000 found:100 python:60)

[[ -f $build/build.ninja ]] ||
    cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DKANUKA_UNITY=ON -DKANUKA_SANITIZE=address,undefined
targets=(kanuka_render_fuzz kanuka_native)
for folder in "${folders[@]}"; do
    targets+=("kanuka_${folder}_test")
done
ninja -C "$build" -j "$jobs" "${targets[@]}"

# The interpreter is none of ours: the sanitizer's library has to come first, and with it the one whose throwing it watches.
watched="$(gcc -print-file-name=libasan.so) $(gcc -print-file-name=libstdc++.so)"

run() { # a folder's tests, or a kind of input and its number
    if [[ $1 == python:* ]]; then
        LD_PRELOAD=$watched PYTHONPATH=$build/python .venv/bin/python tests/fuzz/python_fuzz.py \
            --count "${1##*:}" --seconds 90 --keep "$build/found"
    elif [[ $1 == *:* ]]; then
        "$build/tests/fuzz/kanuka_render_fuzz" "${1%%:*}" --count "${1##*:}" --seconds 90 --folder tests/fuzz/found --keep "$build/found"
    else
        "$build/src/$1/kanuka_$1_test" --gtest_brief=1
    fi
}
export -f run
export build watched
# All of them, whatever one says; output comes whole.
printf '%s\n' "${folders[@]}" "${kinds[@]}" |
    xargs -P "$jobs" -I{} bash -c 'out=$(run {} 2>&1) && rc=0 || rc=$?; printf "== %s\n%s\n" {} "$out"; exit $((rc != 0))'
