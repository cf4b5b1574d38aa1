#!/bin/sh
# same_poses_without_fma.sh ALCES WORK: a recording replays to the same poses, bit for bit, on a processor that has fused
# multiply-add and on one that has not: there glibc's mathematics takes other functions.
set -eu
alces=$1 work=$2
grep -qw fma /proc/cpuinfo || { echo "skipped: this processor has no FMA to do without"; exit 77; }
older="glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"
mkdir -p "$work"
"$alces" simulate --scans 40 --seed 4 --out "$work/drive.mcap" >/dev/null
for tunables in "" "$older"; do
  rm -rf "$work/map"
  GLIBC_TUNABLES=$tunables "$alces" replay "$work/drive.mcap" --out "$work/map" >/dev/null
  mv "$work/map/trajectory.tum" "$work/trajectory${tunables:+_older}.tum"
done
cmp "$work/trajectory.tum" "$work/trajectory_older.tum"
echo "bit for bit the same: $(grep -vc '^#' "$work/trajectory.tum") poses"
