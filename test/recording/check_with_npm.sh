#!/bin/sh
# check_with_npm.sh SOURCE WORK MAKE_RECORDING: installs the readers that package-lock.json names into WORK, once, and runs
# check_recording.mjs. 77, with a sentence: this machine has no node or cannot get the packages.
set -eu
. "$(dirname "$0")/../support/npm_packages.sh"
source=$1
work=$2
make_recording=$3

npm_packages "$source" "$work" test/recording/package-lock.json
exec node "$source/check_recording.mjs" "$make_recording" "$work"
