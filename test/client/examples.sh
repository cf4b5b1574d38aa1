#!/bin/sh
# examples.sh BUILD WITH_PAGE EXAMPLES LIBDIR CC: libalces-client as it is installed, and its examples on a live page.
set -eu
build=$1 with_page=$2 examples=$3 libdir=$4 cc=$5
for tool in pkg-config python3; do
  command -v "$tool" >/dev/null || { echo "skipped: $tool is not installed"; exit 77; }
done
test -d /dev/shm || { echo "skipped: there is no /dev/shm"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for component in client client_development; do
  cmake --install "$build" --prefix "$work" --component "$component" >/dev/null
done
export PKG_CONFIG_PATH="$work/$libdir/pkgconfig" LD_LIBRARY_PATH="$work/$libdir"
for language in "c -std=c11" "c++ -std=c++11"; do
  for header in client page; do
    # shellcheck disable=SC2086  # the flags are words
    echo "#include <alces/$header.h>" |
      "$cc" -x $language -Wall -Wextra -Wpedantic -Werror -fsyntax-only $(pkg-config --cflags alces-client) -
  done
done
# shellcheck disable=SC2046
"$cc" -std=c11 -O1 -Wall -Wextra -Werror -D_GNU_SOURCE "$examples/follow.c" $(pkg-config --cflags --libs alces-client) -lm \
  -o "$work/follow"

expect() {  # expect TEXT: what the example said has it
  grep -qF "$1" "$work/said" || { echo "nothing says: $1"; cat "$work/said"; exit 1; }
}
for example in "$work/follow" "python3 $examples/follow.py"; do
  echo "$example"
  # shellcheck disable=SC2016  # PAGE is with_page's
  "$with_page" sh -c "$example \"\$PAGE\" 3" >"$work/said"
  expect "loop 17-402 closed, moved 0.34 m"
  expect "    1.25    -2.50     0.50 m, +-0.14 m, 0.0"
  $example "$work/none" 1 >"$work/said"
  expect "no pose: there is no page"
done
