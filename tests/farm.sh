# What the tests of farm/ share: a scene, the picture that one process makes of it, and a program that fails once.
# Sourced by tests/slurm.sh and tests/openjd.sh, which set `here`, the repository, `what`, for messages, and `program`.
#
# Python packages, OpenEXR and openjd-cli, are installed from PyPI into target/farm-python, or the folder that FARM_PYTHON
# names, which is reused by later runs.

skip() {
    echo "SKIPPED: $what: $1" >&2
    exit 77
}

fail() {
    echo "FAILED: $what: $1" >&2
    exit 1
}

for needed in python3 "$program"; do
    command -v "$needed" >/dev/null || skip "no $needed"
done
python=${FARM_PYTHON:-$here/target/farm-python}
if ! [ -e "$python/complete" ]; then
    {
        rm -rf "$python" && python3 -m venv "$python" &&
            "$python/bin/pip" install --quiet --disable-pip-version-check 'openjd-cli==0.8.*' 'openexr==3.*'
    } >&2 || skip "cannot install OpenEXR and openjd-cli from PyPI (Debian package python3-venv)"
    touch "$python/complete"
fi
program=$(realpath -- "$program")
work=$(mktemp -d)

# The scene, $work/scene/forest.toml, and $work/whole.exr.
prepare() {
    "$program" generate forest --triangles 3000 --lights 20 -o "$work/scene"
    sed -i 's/^resolution = .*/resolution = [96, 80]/' "$work/scene/forest.toml"
    "$program" render "$work/scene/forest.toml" -o "$work/whole.exr" --float --quiet
}

# flaky TILE MARKER: a program that ends with 1 for a tile, as long as MARKER can be made.
flaky() {
    cat >"$work/flaky" <<SCRIPT
#!/bin/sh
case " \$* " in
*" --tile $1 "*)
    if mkdir "$2" 2>/dev/null; then
        echo "this tile fails" >&2
        exit 1
    fi
    ;;
esac
exec "$program" "\$@"
SCRIPT
    chmod +x "$work/flaky"
    echo "$work/flaky"
}

# same FILE: whether a picture is the one that one process makes, by our own reader and by OpenEXR's.
same() {
    "$program" compare "$1" "$work/whole.exr" --fail-above differing_pixels=0 --fail-above max_abs=0 >&2 || return 1
    "$python/bin/python" - "$1" "$work/whole.exr" <<'SCRIPT'
import sys
import OpenEXR

def pixels(name):
    file = OpenEXR.InputFile(name)
    header = file.header()
    channels = sorted(header["channels"])
    return str(header["dataWindow"]), channels, [bytes(data) for data in file.channels(channels)]

one, other = map(pixels, sys.argv[1:])
assert one == other, f"{sys.argv[1]} differs from {sys.argv[2]}"
assert sum(map(len, one[2])) == 96 * 80 * 3 * 4, "three channels of floats"
SCRIPT
}
