#!/bin/sh
# check_types.sh SOURCE WORK: TypeScript's compiler goes over the page's sources, strictly. 77, with a sentence: this machine has
# no npm or cannot get the packages.
set -eu
source=$1
work=$2

for tool in node npm; do
  command -v "$tool" >/dev/null || { echo "skipped: $tool is not installed (Debian: apt-get install nodejs npm)"; exit 77; }
done
mkdir -p "$work"
if ! cmp -s "$source/package-lock.json" "$work/installed-lock.json"; then
  cp "$source/package.json" "$source/package-lock.json" "$work/"
  if ! (cd "$work" && npm ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1); then
    tail -3 "$work/npm.log"
    echo "skipped: npm could not get the packages of offline/report/package-lock.json"
    exit 77
  fi
  cp "$source/package-lock.json" "$work/installed-lock.json"
fi
rm -rf "$work/src"
cp -r "$source/src" "$source/tsconfig.json" "$work/"
cd "$work"
node node_modules/typescript/bin/tsc -p .
echo "$(ls src/*.ts | wc -l) files are of one type"
