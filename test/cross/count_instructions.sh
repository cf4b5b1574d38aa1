#!/bin/sh
# count_instructions.sh PLUGIN PROGRAM SYSROOT [ARGUMENTS...]: PROGRAM (64-bit ARM) with its instructions counted.
set -eu
plugin=$1 program=$2 sysroot=$3
shift 3
if ! command -v qemu-aarch64 >/dev/null; then
  echo "skipped: qemu-aarch64 is not installed (qemu-user; qemu-user-static cannot load plugins)"
  exit 77
fi
exec qemu-aarch64 -cpu cortex-a72 -L "$sysroot" -plugin "$plugin" -d plugin "$program" "$@"
