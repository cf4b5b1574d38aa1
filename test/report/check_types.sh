#!/bin/sh
# check_types.sh SOURCE WORK: TypeScript's compiler goes over the page's sources, strictly. 77, with a sentence: this machine has
# no npm or cannot get the packages.
set -eu
. "$(dirname "$0")/../support/npm_packages.sh"
source=$1
work=$2

npm_packages "$source" "$work" offline/report/viewer/package-lock.json
rm -rf "$work/src"
cp -r "$source/src" "$source/tsconfig.json" "$work/"
cd "$work"
node node_modules/typescript/bin/tsc -p .
echo "$(ls src/*.ts | wc -l) files are of one type"
