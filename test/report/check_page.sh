#!/bin/sh
# check_page.sh SOURCE WORK ALCES: installs what package-lock.json names into WORK, once, and runs check_page.mjs: a report in a
# real browser. 77, with a sentence: there is no browser, no npm, or this alces was built without the page.
set -eu
source=$1
work=$2
alces=$3

for tool in node npm; do
  command -v "$tool" >/dev/null || { echo "skipped: $tool is not installed (Debian: apt-get install nodejs npm)"; exit 77; }
done
CHROMIUM=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || true)}
[ -n "$CHROMIUM" ] || { echo "skipped: chromium is not installed (Debian: apt-get install chromium)"; exit 77; }
export CHROMIUM
mkdir -p "$work"
if ! cmp -s "$source/package-lock.json" "$work/installed-lock.json"; then
  cp "$source/package.json" "$source/package-lock.json" "$work/"
  if ! (cd "$work" && npm ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1); then
    tail -3 "$work/npm.log"
    echo "skipped: npm could not get the packages of test/report/package-lock.json"
    exit 77
  fi
  cp "$source/package-lock.json" "$work/installed-lock.json"
fi
exec node "$source/check_page.mjs" "$alces" "$work"
