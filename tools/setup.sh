#!/usr/bin/env bash
# Makes this checkout ready to build: Debian packages, .venv, the Python packages, the `kanuka` command.
# Does only what is missing, so a second call costs a fraction of a second.
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\033[1msetup:\033[0m %s\n' "$*"; }
fail() { printf 'setup: %s\n' "$*" >&2; exit 1; }

# ---- Debian packages ------------------------------------------------------------------------------------------------
mapfile -t wanted < <(sed -e 's/#.*//' -e '/^[[:space:]]*$/d' -e 's/[[:space:]]//g' tools/packages-apt.txt)
installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' 2>/dev/null | sed -n 's/^installed //p')
mapfile -t missing < <(printf '%s\n' "${wanted[@]}" | grep -Fxv -f <(printf '%s\n' "$installed") || true)

if ((${#missing[@]})); then
    as_root=()
    if ((EUID != 0)); then
        command -v sudo >/dev/null || fail "these packages are missing and neither root nor sudo is at hand: ${missing[*]}"
        as_root=(sudo)
    fi
    apt_get() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=600 -q "$@"; }
    install_missing() { apt_get install -y --no-install-recommends "${missing[@]}"; }
    say "installing ${#missing[@]} Debian packages: ${missing[*]}"
    # Package lists may be absent (a bare container) or stale: refresh them, then install, never both at once.
    if ! apt-cache show "${missing[@]}" >/dev/null 2>&1; then
        apt_get update
        install_missing
    elif ! install_missing; then
        apt_get update
        install_missing
    fi
fi

# ---- Python environment ---------------------------------------------------------------------------------------------
python=${PYTHON:-python3}
if [[ ! -x .venv/bin/python ]] || ! .venv/bin/python -c 'import sys' 2>/dev/null; then
    say "making .venv with $("$python" --version)"
    rm -rf .venv
    "$python" -m venv .venv
fi

stamp=.venv/.kanuka-stamp
state=$({ pwd; cat tools/requirements.txt pyproject.toml setup.py; } | sha256sum)
if [[ ! -f $stamp || $(<"$stamp") != "$state" ]]; then
    say "installing Python packages"
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --requirement tools/requirements.txt
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
    printf '%s\n' "$state" >"$stamp"
fi
