#!/usr/bin/env bash
# Checks for what the named parts of the build need and installs what is missing (Debian 12).
#
#   tests/setup.sh PART...      parts: build, bake, viewer, sequence, test, strict, fuzz, figures, format, bench, gis,
#                               port
#
# What bake and port list is wanted, not needed: where it cannot be installed, the tools do without (TIFF, PNG, MPI;
# shaders) and say so.
#
# gtao.h itself needs a C99 compiler and nothing else; this is for the programs and tests around it. Without the right
# to install, it prints the one line to run and exits with status 1.
set -u

usage="usage: tests/setup.sh build|bake|viewer|sequence|test|strict|fuzz|figures|format|bench|gis|port..."
optional=
missing=()

# need PACKAGE COMMAND...: the package is missing if the command fails.
need() {
    local package=$1
    shift
    "$@" >/dev/null 2>&1 || missing+=("$package")
}

tool() { command -v "$1"; }
header() { echo "#include <$1>" | cc -E -x c -; }

# links COMPILER [FLAG...]: a program that needs a C library can be linked.
links() {
    local out status
    out=$(mktemp) || return 1
    echo '#include <math.h>
int main(void) { return 0; }' | "$@" -x c - -o "$out" -lm
    status=$?
    rm -f "$out"
    return $status
}

for part in "$@"; do
    case $part in
    build)
        need gcc tool cc
        need libc6-dev links cc
        need libopenexr-dev header OpenEXR/openexr.h
        need libstb-dev header stb/stb_image_write.h
        ;;
    viewer) need libsdl2-dev header SDL2/SDL.h ;;
    sequence)
        need apngasm tool apngasm
        need gnuplot-nox tool gnuplot
        ;;
    bake)
        optional=1
        need libtiff-dev header tiffio.h
        need libpng-dev header png.h
        need libopenmpi-dev tool mpicc
        need openmpi-bin tool mpirun
        ;;
    test)
        need xvfb tool Xvfb
        need libcmocka-dev test -e /usr/include/cmocka.h
        need clang tool clang
        need gcc-i686-linux-gnu tool i686-linux-gnu-gcc
        need libc6-dev-i386-cross links i686-linux-gnu-gcc -static
        need gcc-aarch64-linux-gnu tool aarch64-linux-gnu-gcc
        need libc6-dev-arm64-cross links aarch64-linux-gnu-gcc -static
        need qemu-user tool qemu-aarch64
        need valgrind tool valgrind
        ;;
    strict)
        need g++ tool g++
        need clang tool clang++
        need gcc-i686-linux-gnu tool i686-linux-gnu-gcc
        need libc6-dev-i386-cross links i686-linux-gnu-gcc
        need gcc-aarch64-linux-gnu tool aarch64-linux-gnu-gcc
        need libc6-dev-arm64-cross links aarch64-linux-gnu-gcc
        ;;
    fuzz)
        need clang tool clang
        need libclang-rt-14-dev links clang -fsanitize=memory
        ;;
    figures) need gnuplot-nox tool gnuplot ;;
    format) need clang-format tool clang-format ;;
    bench)
        need libembree-dev header embree3/rtcore.h
        need valgrind tool valgrind
        ;;
    gis) need saga tool saga_cmd ;;
    port)
        optional=1
        need glslang-tools tool glslangValidator
        need libvulkan-dev header vulkan/vulkan.h
        need mesa-vulkan-drivers sh -c 'cat /usr/share/vulkan/icd.d/*.json || cat /etc/vulkan/icd.d/*.json'
        ;;
    *)
        echo "$usage" >&2
        exit 2
        ;;
    esac
done

[ ${#missing[@]} = 0 ] && exit 0

give_up() { # message
    echo "$1" >&2
    [ "$optional" ] && echo "setup: going on without" >&2 && exit 0
    exit 1
}

packages=$(printf '%s\n' "${missing[@]}" | sort -u | tr '\n' ' ')
if [ "$(id -u)" = 0 ]; then
    sudo=()
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    sudo=(sudo -n)
else
    give_up "missing packages; run: sudo apt-get install $packages"
fi

echo "setup: installing $packages" >&2
log=$(mktemp) || exit 1
trap 'rm -f "$log"' EXIT
install() {
    # shellcheck disable=SC2086 # one word per package
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $packages >"$log" 2>&1
}
# The package lists may be absent or out of date: refresh them only if the first try fails.
install || { "${sudo[@]}" apt-get update >"$log" 2>&1 && install; } || {
    tail -n 20 "$log" >&2
    give_up "setup: could not install; run: apt-get update && apt-get install $packages"
}
