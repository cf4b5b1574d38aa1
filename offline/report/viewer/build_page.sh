#!/bin/sh
# build_page.sh SOURCE WORK PAGE: makes PAGE of SOURCE, with the packages of package-lock.json installed into WORK, unless it
# is up to date. Where that cannot be done PAGE holds "missing: " and why, and the exit status is 0: a build without a
# network goes on without the page.
set -eu
source=$1
work=$2
page=$3

missing() {
  echo "alces report will have no page: $1" >&2
  printf 'missing: %s\n' "$1" >"$page.new"
  cmp -s "$page.new" "$page" || cp "$page.new" "$page"
  rm -f "$page.new"
  exit 0
}

mkdir -p "$work" "$(dirname "$page")"
inputs=$(cat "$source/package-lock.json" "$source/build_page.mjs" "$source"/src/* | cksum)
if [ -s "$page" ] && [ "$(cat "$work/made-of" 2>/dev/null || true)" = "$inputs" ]; then exit 0; fi

for tool in node npm; do
  command -v "$tool" >/dev/null || missing "$tool is not installed"
done
if ! cmp -s "$source/package-lock.json" "$work/installed-lock.json"; then
  cp "$source/package.json" "$source/package-lock.json" "$work/"
  if ! (cd "$work" && timeout 240 npm ci --omit=dev --ignore-scripts --no-audit --no-fund --fetch-retries=1 >npm.log 2>&1); then
    tail -2 "$work/npm.log" >&2
    missing "npm could not get the packages of offline/report/package-lock.json"
  fi
  cp "$source/package-lock.json" "$work/installed-lock.json"
fi
if ! node "$source/build_page.mjs" "$source" "$work" "$page.new" >"$work/bundle.log" 2>&1; then
  cat "$work/bundle.log" >&2  # a mistake in our sources, not of the machine
  exit 1
fi
cmp -s "$page.new" "$page" || cp "$page.new" "$page"
rm -f "$page.new"
echo "$inputs" >"$work/made-of"
