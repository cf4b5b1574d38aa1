#!/bin/sh
# same_poses.sh SOURCE ARCH HOST_FIRMWARE: docs/examples/firmware, built for aarch64 or armhf and run by QEMU, prints the same
# poses as on this machine, the digest of all their bits included. Builds in build/ARCH, where scripts/cross does, too.
set -eu
source=$1 architecture=$2 host=$3
if [ ! -e "$source/build/sysroot/$architecture/made_from" ]; then
  echo "skipped: there is no sysroot: scripts/sysroot $architecture makes one"
  exit 77
fi
case $architecture in
  aarch64) emulator=qemu-aarch64-static triplet=aarch64-linux-gnu ;;
  armhf) emulator=qemu-arm-static triplet=arm-linux-gnueabihf ;;
esac
for tool in "$emulator" "$triplet-g++"; do
  command -v "$tool" >/dev/null || { echo "skipped: $tool is not installed"; exit 77; }
done
cd "$source"
cmake --preset "$architecture" >/dev/null
cmake --build --preset "$architecture" --parallel "${ALCES_JOBS:-1}" --target firmware
"$emulator" -L "build/sysroot/$architecture" "build/$architecture/bin/firmware" | grep -v ' the pool of points$' >"build/$architecture/poses.txt"
"$host" | grep -v ' the pool of points$' >"build/$architecture/poses_here.txt"  # pointers are smaller on 32 bits: more pool
diff "build/$architecture/poses_here.txt" "build/$architecture/poses.txt"
echo "bit for bit the same: $(tail -n 1 "build/$architecture/poses.txt")"
