#!/usr/bin/env bash
# Brings everything that understudy needs on Debian 12 or 13 (x86-64): system packages, a look at the Rust toolchain,
# and the models, clips and scans that models/manifest.toml and recordings/manifest.toml pin by SHA-256.
# Run it as often as you like: what is there already is left alone. It ends with exit code 1 when something required
# is missing, and says what.
#
#   UNDERSTUDY_ASSETS   where the assets go (default: $XDG_DATA_HOME/understudy or ~/.local/share/understudy)
set -euo pipefail
export PYTHONUTF8=1

here=$(cd "$(dirname "$0")" && pwd)
assets=${UNDERSTUDY_ASSETS:-${XDG_DATA_HOME:-$HOME/.local/share}/understudy}
wanted_rust=1.95
packages=(
    libopencv-dev libclang-dev clang pkg-config g++ make ffmpeg
    libvulkan1 mesa-vulkan-drivers libegl1 libgl1
    python3 python3-venv ca-certificates
)
problems=()

ok() { printf '  ✓ %s\n' "$*"; }
busy() { printf '  … %s\n' "$*"; }
problem() {
    printf '  ✗ %s\n' "$*"
    problems+=("$*")
}

# Runs apt-get as root, or through sudo where sudo may be used.
as_root() {
    if [ "$(id -u)" = 0 ]; then
        env DEBIAN_FRONTEND=noninteractive "$@"
    elif command -v sudo >/dev/null && { [ -t 0 ] || sudo -n true 2>/dev/null; }; then
        sudo env DEBIAN_FRONTEND=noninteractive "$@"
    else
        return 126
    fi
}

installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

# apt PACKAGE...: installs what is not there yet.
apt() {
    local missing=() package log status=0
    for package in "$@"; do
        installed "$package" || missing+=("$package")
    done
    if [ ${#missing[@]} = 0 ]; then
        ok "$*: already there"
        return
    fi
    busy "${missing[*]}: installing with apt-get"
    log=$(mktemp)
    {
        as_root apt-get update -q </dev/null &&
            as_root apt-get install -q -y --no-install-recommends "${missing[@]}" </dev/null
    } >"$log" 2>&1 || status=$?
    if [ "$status" = 0 ]; then
        ok "${missing[*]}: installed"
    elif [ "$status" = 126 ]; then
        problem "not root and no sudo; run: apt-get update && apt-get install --no-install-recommends ${missing[*]}"
    else
        tail -n 5 "$log" >&2
        problem "apt-get could not install ${missing[*]}"
    fi
    rm -f "$log"
}

# Is a Rust compiler of at least the wanted version on the PATH?
look_for_rust() {
    local version
    if ! command -v cargo >/dev/null && [ -x "$HOME/.cargo/bin/cargo" ]; then
        PATH="$HOME/.cargo/bin:$PATH"
    fi
    if ! command -v cargo >/dev/null && [ -n "$(apt-cache search --names-only '^rustup$' 2>/dev/null)" ]; then
        apt rustup
        if command -v rustup >/dev/null; then
            busy "Rust: rustup default stable"
            rustup default stable >/dev/null 2>&1 || true
        fi
    fi
    version=$(rustc --version 2>/dev/null | cut -d' ' -f2) || true
    if [ -z "$version" ]; then
        problem "Rust $wanted_rust or newer is missing: install it with rustup, then run: rustup default stable"
    elif [ "$(printf '%s\n' "$wanted_rust" "$version" | sort -V | head -n 1)" != "$wanted_rust" ]; then
        problem "Rust $wanted_rust or newer is wanted, $version was found: run: rustup update stable"
    else
        ok "Rust $version: already there"
    fi
}

# A Python that can read the manifests (3.11 or newer) and make a virtual environment.
look_for_python() {
    local candidate
    for candidate in python3 /usr/bin/python3; do
        if "$candidate" -c 'import ensurepip, tomllib, venv' 2>/dev/null; then
            python=$candidate
            return
        fi
    done
    problem "Python 3.11 or newer with venv is missing: run: apt-get install python3 python3-venv"
}

echo "System packages"
if ! command -v dpkg-query >/dev/null; then
    problem "this is not Debian: install by other means what these Debian packages hold: ${packages[*]} npm"
else
    apt "${packages[@]}"
    if command -v npm >/dev/null; then ok "npm $(npm --version): already there"; else apt npm; fi
fi

echo "Toolchain"
look_for_rust
if [ "$(uname -m)" != x86_64 ]; then
    problem "the ONNX Runtime that is pinned here is for x86_64, this machine is $(uname -m)"
fi

echo "Assets in $assets"
python=
look_for_python
if [ -n "$python" ]; then
    "$python" "$here/fetch_assets.py" "$assets" || problems+=("not every asset is in place (see above)")
fi

if [ ${#problems[@]} != 0 ]; then
    echo "Set-up is not complete:"
    printf '  ✗ %s\n' "${problems[@]}"
    exit 1
fi
echo "Set-up is complete: $(du -sh "$assets" | cut -f1) of assets in $assets"
printf '  %-14s %s\n' \
    models "$assets/models" "canonical face" "$assets/canonical_face.json" \
    "ONNX Runtime" "$assets/onnxruntime" clips "$assets/clips" scans "$assets/scans"
