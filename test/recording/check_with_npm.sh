#!/bin/sh
# check_with_npm.sh SOURCE WORK MAKE_RECORDING: installs the readers that package-lock.json names into WORK, once, and runs
# check_recording.mjs. 77, with a sentence: this machine has no node or cannot get the packages.
set -eu
source=$1
work=$2
make_recording=$3

for tool in node npm; do
  command -v "$tool" >/dev/null || { echo "skipped: $tool is not installed (Debian: apt-get install nodejs npm)"; exit 77; }
done
mkdir -p "$work"
if ! cmp -s "$source/package-lock.json" "$work/installed-lock.json"; then
  cp "$source/package.json" "$source/package-lock.json" "$work/"
  if ! (cd "$work" && npm ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1); then
    tail -3 "$work/npm.log"
    echo "skipped: npm could not get the packages of test/recording/package-lock.json"
    exit 77
  fi
  cp "$source/package-lock.json" "$work/installed-lock.json"
fi
exec node "$source/check_recording.mjs" "$make_recording" "$work"
