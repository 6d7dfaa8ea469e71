#!/usr/bin/env bash
# Installs the renderers that Kanuka is measured beside, each into a virtual environment of its own, from PyPI.
#   bench/setup.sh [mitsuba] [cycles] [luxcore]      default: all that this Python can have
# KANUKA_PEERS says where (build/peers); PYTHON which Python (python3). Does only what is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
peers=${KANUKA_PEERS:-build/peers}
python=${PYTHON:-python3}
wanted=("$@")
((${#wanted[@]})) || wanted=(mitsuba luxcore cycles)

say() { printf '\033[1mpeers:\033[0m %s\n' "$*"; }

# name of the environment, module that tells whether it is complete, packages
environment() {
    local folder=$peers/$1 module=$2
    shift 2
    if [[ -x $folder/bin/python ]] && "$folder/bin/python" -c "import importlib.util as u, sys; sys.exit(not u.find_spec('$module'))"; then
        say "$folder is there"
        return
    fi
    say "making $folder with $*"
    "$python" -m venv --clear "$folder"
    "$folder/bin/python" -m pip install --quiet --disable-pip-version-check "$@"
}

for peer in "${wanted[@]}"; do
    case $peer in
    mitsuba)
        environment mitsuba mitsuba mitsuba==3.9.1 numpy
        # Its LLVM variants load this library at run time.
        if ! compgen -G '/usr/lib/*/libLLVM*19.1*' >/dev/null; then
            if ((EUID == 0)); then
                say "installing libllvm19"
                DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends libllvm19
            else
                say "Mitsuba's LLVM variants need libllvm19: sudo apt-get install libllvm19"
            fi
        fi
        ;;
    cycles)
        if "$python" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))'; then
            environment bpy bpy bpy==5.0.1
        else
            say "bpy 5.0 needs Python 3.11, this is $("$python" --version): cycles is left out (set PYTHON)"
        fi
        ;;
    luxcore) environment luxcore pyluxcore pyluxcore==2.11.2 numpy ;;
    *)
        say "unknown: $peer; there are mitsuba, cycles, luxcore" >&2
        exit 2
        ;;
    esac
done
