#!/bin/sh
# check_bags.sh WRITER SOURCE WORK ALCES [SCANS]: scans in a folder, the same in bags by other people's writers (WRITER ros2: npm's;
# ros1: python3-rosbag of Debian): all give the same poses to the bit, and become the same folder of scans again. SCANS: a packed
# set of real scans (NAME.tar.xz) instead of a room that is made. 77, with a sentence: something for it is not there.
set -eu
. "$(dirname "$0")/../support/npm_packages.sh"
writer=$1
source=$2
work=$3
alces=$4
packed=${5:-}

npm_packages "$source" "$work/npm" test/bags/package-lock.json
work=$work/$writer${packed:+-$(basename "$packed" .tar.xz)}
rm -rf "$work"
mkdir -p "$work/bags"
if [ -n "$packed" ]; then
  [ -f "$packed" ] || { echo "skipped: no test data: $packed"; exit 77; }
  tar -xJf "$packed" -C "$work"
  "$alces" convert "$work/$(basename "$packed" .tar.xz)" "$work/scans"
else
  node "$source/make_scans.mjs" "$work/scans"
fi
case $writer in
  ros2) node "$source/write_bags.mjs" "$work/../npm" "$work/scans" "$work/bags" ;;
  ros1) /usr/bin/python3 "$source/write_ros1_bags.py" "$work/scans" "$work/bags" ;;
esac

"$alces" convert "$work/scans" "$work/plain" # as alces writes scans
"$alces" map "$work/scans" --out "$work/map" >"$work/log.txt"
failed=0
for bag in "$work"/bags/*; do
  "$alces" info "$bag" | grep -q '^a map is made of: /points in base_link, body base_link, odometry /' ||
    { echo "FAILED: info of $bag"; failed=1; }
  "$alces" map "$bag" --out "$work/map_of_bag" >"$work/log.txt" 2>&1 || { cat "$work/log.txt"; failed=1; continue; }
  for file in trajectory.tum map.ply graph.g2o; do
    cmp "$work/map/$file" "$work/map_of_bag/$file" || { echo "FAILED: map of $bag"; failed=1; }
  done
  rm -rf "$work/again"
  "$alces" convert "$bag" "$work/again" >"$work/log.txt" 2>&1 || { cat "$work/log.txt"; failed=1; continue; }
  diff -r "$work/plain" "$work/again" || { echo "FAILED: $bag became other scans"; failed=1; }
  echo "$bag: the same poses, and the same scans again"
done
[ -z "$packed" ] || rm -rf "$work"
exit $failed
