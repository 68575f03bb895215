#!/bin/sh
# Makes the environment: sh deploy/setup.sh VENV [dev]
# On Debian as root, missing system packages are installed; otherwise they are named and the script stops.
set -eu
venv=${1:?usage: setup.sh VENV [dev]}
kind=${2:-runtime}
here=$(cd "$(dirname "$0")/.." && pwd)

install_debian() {
    apt-get install -y -qq "$@" >/dev/null 2>&1 || { apt-get update -qq && apt-get install -y -qq "$@" >/dev/null; }
}

is_debian_root() {
    command -v apt-get >/dev/null 2>&1 && [ "$(id -u)" = 0 ]
}

export DEBIAN_FRONTEND=noninteractive
python=${PYTHON:-python3}
command -v "$python" >/dev/null 2>&1 || {
    echo "There is no $python here. Install Python 3.11 or newer, or name it: make demo PYTHON=/path/to/python3" >&2
    exit 1
}
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "cityflow needs Python 3.11 or newer; $python is $("$python" --version). Name another: make demo PYTHON=/path/to/python3" >&2
    exit 1
}

missing=""
"$python" -c 'import ensurepip, venv' 2>/dev/null || missing="python3-venv"
# open3d loads these at import, although no window is ever opened
for pair in libEGL.so.1:libegl1 libGL.so.1:libgl1 libX11.so.6:libx11-6 libusb-1.0.so.0:libusb-1.0-0 libgomp.so.1:libgomp1; do
    [ -x /sbin/ldconfig ] || break
    /sbin/ldconfig -p | grep -q "${pair%%:*}" || missing="$missing ${pair##*:}"
done
if [ -n "$missing" ] && is_debian_root; then
    echo "Installing Debian packages: $missing"
    # shellcheck disable=SC2086
    install_debian $missing
elif [ -n "$missing" ]; then
    echo "Missing system packages, named as in Debian. Let an administrator install them, then run this again:" >&2
    echo "    apt-get install" $missing >&2
    exit 1
fi

[ "$kind" = dev ] || echo "Installing Python packages into $venv (about 2 GB; some minutes)"
[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check -c "$here/constraints.txt" uv
if [ "$kind" = dev ]; then
    VIRTUAL_ENV="$venv" "$venv/bin/uv" pip install --quiet -c "$here/constraints.txt" -e "$here[s3]" --group "$here/pyproject.toml:dev" --group "$here/pyproject.toml:docs"
    # A reader of CityGML by others, and a browser for the view; tests are skipped where they are not there.
    if is_debian_root; then
        { command -v citygmltest >/dev/null 2>&1 && [ -e /usr/include/citygml/citygml.h ]; } || install_debian libcitygml-bin libcitygml-dev g++ || echo "no libcitygml"
        command -v chromium >/dev/null 2>&1 || install_debian chromium || echo "no chromium"
        { command -v node >/dev/null 2>&1 && command -v npm >/dev/null 2>&1; } || install_debian nodejs npm || echo "no node"
    fi
else
    VIRTUAL_ENV="$venv" "$venv/bin/uv" pip install --quiet -c "$here/constraints.txt" -e "$here"
fi
