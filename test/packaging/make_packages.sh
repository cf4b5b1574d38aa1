#!/bin/sh
# make_packages.sh BUILD PACKAGES: the packages of a finished build, and lintian's opinion of them.
set -eu
build=$1 packages=$2
for tool in dpkg-deb dpkg-shlibdeps; do
  if ! command -v "$tool" >/dev/null; then
    echo "skipped: $tool is not installed (dpkg-dev)"
    exit 77
  fi
done
rm -rf "$packages"
mkdir -p "$packages"
cpack --config "$build/CPackConfig.cmake" -B "$packages"
rm -rf "$packages/_CPack_Packages"
ls -l "$packages"/*.deb
for name in alces alcesd libalces-dev libalces-client0 libalces-client-dev; do
  ls "$packages/${name}"_*.deb >/dev/null || { echo "$name was not made"; exit 1; }
done
if ! command -v lintian >/dev/null; then
  echo "lintian is not installed: nobody looked at the packages"
  exit 0
fi
lintian --fail-on error --allow-root "$packages"/*.deb
