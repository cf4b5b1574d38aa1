#!/bin/sh
# check_page.sh SOURCE WORK ALCES: installs what package-lock.json names into WORK, once, and runs check_page.mjs: a report in a
# real browser. 77, with a sentence: there is no browser, no npm, or this alces was built without the page.
set -eu
. "$(dirname "$0")/../support/npm_packages.sh"
source=$1
work=$2
alces=$3

CHROMIUM=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || true)}
[ -n "$CHROMIUM" ] || { echo "skipped: chromium is not installed (Debian: apt-get install chromium)"; exit 77; }
export CHROMIUM
npm_packages "$source" "$work" test/report/package-lock.json
exec node "$source/check_page.mjs" "$alces" "$work"
