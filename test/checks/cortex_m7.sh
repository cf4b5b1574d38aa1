#!/bin/sh
# cortex_m7.sh SOURCE BUILD: the library compiles for a microcontroller; prints what it takes of its flash and RAM.
set -eu
if ! command -v arm-none-eabi-g++ >/dev/null; then
  echo "skipped: arm-none-eabi-g++ is not installed (gcc-arm-none-eabi, libstdc++-arm-none-eabi-newlib)"
  exit 77
fi
cmake -S "$1" --preset cortex-m7 -B "$2"
cmake --build "$2" --parallel "${ALCES_JOBS:-1}"
arm-none-eabi-size --totals "$2/lib/libalces.a" "$2/drivers/libalces_drivers.a"
