#!/bin/sh
# example.sh EXAMPLE WORK LIBDIR COMPILER: the example builds against WORK/installed, by CMake and by pkg-config, and runs.
set -eu
example=$1 work=$2 libdir=$3 compiler=$4
cmake -S "$example" -B "$work/example" -G Ninja --fresh -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_PREFIX_PATH="$work/installed"
cmake --build "$work/example"
"$work/example/two_scans" >"$work/by_cmake.txt"
cat "$work/by_cmake.txt"

export PKG_CONFIG_PATH="$work/installed/$libdir/pkgconfig"
# shellcheck disable=SC2046  # the flags are words
"$compiler" -std=c++20 -O2 "$example/main.cpp" -o "$work/by_pkg_config" $(pkg-config --cflags --libs alces)
"$work/by_pkg_config" >"$work/by_pkg_config.txt"
cmp "$work/by_cmake.txt" "$work/by_pkg_config.txt"
echo "find_package and pkg-config ($(pkg-config --modversion alces)) give the same program"
