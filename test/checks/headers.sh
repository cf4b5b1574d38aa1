#!/bin/sh
# headers.sh PREFIX COMPILER: every installed header can be included first.
set -eu
flags="-std=c++20 -fsyntax-only -Wall -Wextra -Werror -fno-exceptions -fno-rtti $(pkg-config --cflags eigen3)"
for header in "$1"/include/alces/*.h; do
  name=alces/$(basename "$header")
  # shellcheck disable=SC2086
  echo "#include \"$name\"" | "$2" $flags -I "$1/include" -x c++ - || { echo "$name does not compile alone"; exit 1; }
  echo "$name"
done
