#!/bin/sh
# check_can_utils.sh MAKE_RECORDING ALCES WORK: a recording, converted to candump's form, read by can-utils' log2asc: the
# frames that it shows are those that were recorded. canplayer, which needs a CAN interface, must at least take the file. 77,
# with a sentence: can-utils is not installed.
set -eu
make_recording=$1
alces=$2
work=$3

command -v log2asc >/dev/null || { echo "skipped: log2asc is not installed (Debian: apt-get install can-utils)"; exit 77; }
rm -rf "$work"
mkdir -p "$work"
"$make_recording" "$work/drive.mcap" 2000 >"$work/drive.json"
"$alces" convert "$work/drive.mcap" "$work/traces"
frames=$(cat "$work"/traces/can?.log | wc -l)
for bus in 0 1; do
  log2asc -I "$work/traces/can$bus.log" -O "$work/can$bus.asc" "can$bus"
done

# log2asc: "   0.001234 1  181             Rx   d 8 21 04 ...", ErrorFrame, "CANFD   1 Rx ..."
shown=$(cat "$work"/can?.asc | grep -cE 'Rx|Tx|ErrorFrame')
[ "$shown" = "$frames" ] || { echo "log2asc shows $shown of $frames frames"; exit 1; }

# Both as "id, direction, length, bytes": classical data frames of bus 0 and 1.
for bus in 0 1; do
  awk '$3 ~ /^...#[0-9A-F]*$/ { n = split($3, part, "#"); data = part[2]; bytes = ""
         for (i = 1; i < length(data); i += 2) bytes = bytes " " substr(data, i, 2)
         print part[1], $4 == "T" ? "Tx" : "Rx", length(data) / 2 bytes }' "$work/traces/can$bus.log" >"$work/ours$bus.txt"
  awk '$4 ~ /^[RT]x$/ && $5 == "d" && $3 !~ /x$/ { line = $3 " " $4 " " $6; for (i = 7; i <= NF; i++) line = line " " $i; print line }' \
    "$work/can$bus.asc" >"$work/theirs$bus.txt"
  [ -s "$work/ours$bus.txt" ] || { echo "no frames on bus $bus"; exit 1; }
  cmp "$work/ours$bus.txt" "$work/theirs$bus.txt"
done

# And back: the recording that comes of the traces holds the same events.
"$alces" convert "$work/traces" "$work/again.mcap"
"$alces" convert "$work/again.mcap" "$work/again"
for file in "$work"/traces/*; do
  cmp "$file" "$work/again/$(basename "$file")"
done
echo "log2asc reads all $frames frames; recording -> traces -> recording -> traces changes no byte"
