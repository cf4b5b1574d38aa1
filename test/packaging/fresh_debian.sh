#!/bin/sh
# fresh_debian.sh PACKAGES EXAMPLE WORK: the packages in a Debian of their own: they install with what they ask for and
# nothing else, start, and leave again. As root, with a network; the base system is kept in WORK for the next time.
set -eu
packages=$1 example=$2 work=$3
release=bookworm
mirror=${ALCES_DEBIAN_MIRROR:-http://deb.debian.org/debian}

skip() {
  echo "skipped: $1"
  exit 77
}
command -v debootstrap >/dev/null || skip "debootstrap is not installed"
[ "$(id -u)" = 0 ] || skip "a fresh Debian is made by root only"
unshare --mount true 2>/dev/null || skip "this machine does not let mounts be made (a container?)"
ls "$packages"/*.deb >/dev/null 2>&1 || skip "there are no packages in $packages"

mkdir -p "$work"
base=$work/$release.tar
root=$work/root
if [ ! -s "$base" ]; then
  rm -rf --one-file-system "$root"
  unshare --mount debootstrap --variant=minbase --include=systemd,ca-certificates,g++,pkgconf,libeigen3-dev "$release" "$root" "$mirror" \
    >"$work/debootstrap.log" 2>&1 || { tail -n 5 "$work/debootstrap.log"; skip "debootstrap could not make a Debian from $mirror"; }
  tar -C "$root" -cf "$base.part" .
  mv "$base.part" "$base"
fi
rm -rf --one-file-system "$root"
mkdir -p "$root"
tar -C "$root" -xf "$base"
mkdir -p "$root/packaging"
cp "$packages"/*.deb "$root/packaging"
cp -r "$example" "$root/packaging/example"
cp "$(dirname "$0")/inside.sh" "$root/packaging"
cp /etc/resolv.conf "$root/etc/resolv.conf"
# Mounts of a name space of its own: they are gone when the test is.
unshare --mount sh -euc 'mount -t proc proc "$1/proc"; mount --rbind /dev "$1/dev"; mount -t tmpfs tmpfs "$1/run"; exec chroot "$1" sh -eu /packaging/inside.sh' sh "$root"
