#!/bin/sh
# Makes the environment: sh deploy/setup.sh VENV [dev]
# On Debian as root, missing system packages are installed; otherwise they are named and the script stops.
set -eu
venv=${1:?usage: setup.sh VENV [dev]}
kind=${2:-runtime}
here=$(cd "$(dirname "$0")/.." && pwd)

fetch_debian() {
    if command -v apt-get >/dev/null 2>&1 && [ "$(id -u)" = 0 ]; then
        echo "Installing Debian packages: $*"
        apt-get install -y -qq "$@" >/dev/null 2>&1 || { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$@" >/dev/null; }
    else
        echo "Missing system packages. Install them and run this again:" >&2
        echo "    sudo apt-get install $*" >&2
        exit 1
    fi
}

python=${PYTHON:-python3}
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "cityflow needs Python 3.11 or newer; $("$python" --version) found. Name another one with PYTHON=/path/to/python3." >&2
    exit 1
}
"$python" -c 'import ensurepip, venv' 2>/dev/null || fetch_debian python3-venv

# open3d loads these at import, although no window is ever opened
missing=""
for pair in libEGL.so.1:libegl1 libGL.so.1:libgl1 libX11.so.6:libx11-6 libusb-1.0.so.0:libusb-1.0-0 libgomp.so.1:libgomp1; do
    library=${pair%%:*}
    /sbin/ldconfig -p | grep -q "$library" || missing="$missing ${pair##*:}"
done
# shellcheck disable=SC2086
[ -z "$missing" ] || fetch_debian $missing

[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check -c "$here/constraints.txt" uv
if [ "$kind" = dev ]; then
    VIRTUAL_ENV="$venv" "$venv/bin/uv" pip install --quiet -c "$here/constraints.txt" -e "$here[s3]" --group "$here/pyproject.toml:dev"
    # A reader of CityGML by others; its tests are skipped where it is not there.
    command -v citygmltest >/dev/null 2>&1 || [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null 2>&1 || fetch_debian libcitygml-bin
else
    VIRTUAL_ENV="$venv" "$venv/bin/uv" pip install --quiet -c "$here/constraints.txt" -e "$here"
fi
