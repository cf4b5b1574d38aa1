#!/bin/bash
# The system test: alcesd and a simulated scanner, each its own process, on a real kernel's CAN, GPIO and serial lines.
#   test/system/run.sh amd64|arm64 PROGRAMS ALCES WORK [SCENARIO...]
#     PROGRAMS   folder with alcesd and alces-scanner-sim, built for that processor
#     ALCES      the companion, for this machine: it checks the recordings
#     WORK       folder for kernels (kept) and logs
#     SCENARIO   only these, of: drive faults power
# Exit status: 0 every verdict is PASS, 1 one is not or is missing, 77 cannot be run here (the last line says why).
# ALCES_SYSROOT: what the programs for arm64 were linked against, when it is not build/sysroot/aarch64.
# ALCES_KERNELS: a folder for kernels that several build trees share. See docs/system-test.md.
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
arch=$1 programs=$2 alces=$3 work=$4; shift 4
scenarios=${*:-drive faults power}
mkdir -p "$work"; work=$(cd "$work" && pwd)
kernels=${ALCES_KERNELS:-$work/kernels}/$arch
results=$work/results
. "$here/kernel.sh"

PATH=$PATH:/usr/sbin:/sbin  # mkfs.ext4
skip() { echo "SKIPPED: $1"; exit 77; }
began=$(date +%s)
lap() { echo "[$(($(date +%s) - began)) s] $1"; }

case $arch in
  amd64) qemu=qemu-system-x86_64 package=qemu-system-x86 strip=strip ;;
  arm64) qemu=qemu-system-aarch64 package=qemu-system-arm strip=aarch64-linux-gnu-strip ;;
  *) echo "usage: run.sh amd64|arm64 PROGRAMS ALCES WORK [SCENARIO...]" >&2; exit 2 ;;
esac
command -v $qemu > /dev/null || skip "$qemu is not installed (package $package)"
for tool in cpio make gcc readelf $strip mkfs.ext4 python3 dpkg apt-get; do
  command -v "$tool" > /dev/null || skip "$tool is not installed"
done
for program in alcesd alces-scanner-sim; do
  [ -x "$programs/$program" ] || skip "$programs/$program is not built"
done
exec 8> "$work/lock"; flock 8  # one run at a time in a folder

lap "kernel"
fetch_kernel "$arch" "$kernels" || skip "Debian's kernel packages cannot be had: $(tail -n 1 "$kernels/apt.log"); $kernels/apt.log"
build_gpio_sim "$arch" "$kernels" || { tail -n 5 "$kernels/gpiosim.log"; echo "FAIL gpio-sim: cannot be built"; exit 1; }
image=$(kernel_image "$arch" "$kernels") || { echo "FAIL kernel: cannot be unpacked"; exit 1; }

lap "guest"
rm -rf "$work/root"
mkdir -p "$results" "$work/root"/{bin,sbin,usr/bin,usr/sbin,proc,sys,dev,tmp,run,etc,out,disk,lib}
root=$work/root
add_modules "$kernels" "$root" vcan can-raw configfs "$kernels/gpiosim/gpio-sim.ko" virtio_pci virtio_blk 9pnet_virtio 9p \
  ext4 crc32c_generic
# Libraries: of the guest's Debian (the tools'), else where the programs were linked against.
libraries=("$kernels"/tools/usr/lib/*-linux-gnu "$kernels"/tools/lib/*-linux-gnu)
case $arch in
  amd64) libraries+=(/usr/lib/x86_64-linux-gnu /lib/x86_64-linux-gnu) ;;
  arm64) libraries+=("${ALCES_SYSROOT:-$here/../../build/sysroot/aarch64}"/usr/lib/aarch64-linux-gnu /usr/aarch64-linux-gnu/lib) ;;
esac
"$here/add_programs.py" "$root" "$strip" "${libraries[@]}" -- "$programs"/{alcesd,alces-scanner-sim} \
  "$kernels"/tools/usr/bin/{candump,cansend,canplayer,gpiomon} || exit 1
cp "$kernels/tools/bin/busybox" "$root/bin/busybox"
cp -r "$here/guest" "$root/scenarios"
"$here/hostile_trace.py" > "$root/scenarios/hostile.log"
mv "$root/scenarios/init" "$root/init"; chmod +x "$root/init"
"$alces" simulate --print-config | sed -f "$here/vehicle.sed" > "$root/etc/vehicle.toml"
cp "$root/etc/vehicle.toml" "$results/vehicle.toml"

(cd "$root" && find . | cpio -o -H newc -R 0:0 --quiet | gzip -1) > "$work/initrd.gz"

# boot SCENARIO LIMIT_CPU_S: the guest's console goes to results/SCENARIO.console. Time in the guest follows its instructions
# (one a nanosecond) and skips what it sleeps: how busy this machine is changes nothing in there. Returns when the guest
# has switched itself off, when QEMU has worked for so long (a guest that hangs works, too), or when the guest has said CUT: then its power is cut.
boot() {
  local scenario=$1 limit_cpu_s=$2 console=$results/$1.console machine began_s=$SECONDS cpu_s=0
  # Page tables of its own for the kernel would empty QEMU's with each system call: many times slower, and nobody attacks.
  local words="panic=-1 quiet mitigations=off nokaslr scenario=$scenario"
  case $arch in
    amd64) machine=(-M pc -cpu Nehalem -append "console=ttyS0 pti=off $words") ;;
    arm64) machine=(-M virt -cpu cortex-a72 -append "console=ttyAMA0 kpti=off $words") ;;
  esac
  [ -e "$work/disk.img" ] || { truncate -s 256M "$work/disk.img"; mkfs.ext4 -q -F "$work/disk.img"; }
  $qemu "${machine[@]}" -accel tcg -smp 1 -m 768 -nodefaults -no-user-config -display none -monitor none -no-reboot \
    -serial stdio -icount shift=0,sleep=off -rtc base=2026-01-01T00:00:00,clock=vm -kernel "$image" -initrd "$work/initrd.gz" \
    -virtfs "local,path=$results,mount_tag=out,security_model=none,multidevs=remap" \
    -drive "if=none,id=disk,format=raw,file=$work/disk.img" -device virtio-blk-pci,drive=disk \
    < /dev/null > "$console" 2>&1 &
  qemu_pid=$!
  while kill -0 "$qemu_pid" 2> /dev/null; do
    grep -aq '^CUT' "$console" && break
    cpu_s=$(ps -o cputimes= -p "$qemu_pid" || echo "$cpu_s")
    if [ "$cpu_s" -ge "$limit_cpu_s" ]; then
      echo "FAIL $scenario: hangs; stopped after $limit_cpu_s s of work"; failed=1
      break
    fi
    sleep 0.5
  done
  lap "$scenario: $((SECONDS - began_s)) s, of which this machine worked ${cpu_s// /} s"
  kill -KILL "$qemu_pid" 2> /dev/null
  wait "$qemu_pid" 2> /dev/null
  qemu_pid=""
  sed -i 's/\r//g' "$console"
}
qemu_pid=""
trap '[ -z "$qemu_pid" ] || kill -KILL "$qemu_pid"' EXIT
trap 'exit 1' INT TERM

# check NAME COMMAND...: a verdict of the host's, with the last line of what the command said.
check() {
  local name=$1 said; shift
  if said=$("$@" 2>&1); then
    echo "PASS $name ($(echo "$said" | tail -n 1))"
  else
    echo "FAIL $name: $(echo "$said" | tail -n 1)"; failed=1
  fi
}
replay() { "$alces" replay "$1" --out "$2" | grep 'scans mapped'; }  # pipefail: its status is that of alces, too
at_least() { echo "$1 of $2 that must be"; [ "${1:-0}" -ge "$2" ]; }

failed=0
expect() {  # expect COUNT SCENARIO: so many verdicts, and the end
  local console=$results/$2.console passed bad
  grep -aE '^(PASS|FAIL) ' "$console"
  passed=$(grep -ac '^PASS ' "$console"); bad=$(grep -ac '^FAIL ' "$console")
  [ "$bad" = 0 ] || failed=1
  if [ $((passed + bad)) != "$1" ] || ! grep -aq "^DONE $2" "$console"; then
    echo "FAIL $2: $((passed + bad)) verdicts of $1; the console's end:"; tail -n 15 "$console"; failed=1
  fi
}

rm -f "$work/disk.img"
for scenario in $scenarios; do
  rm -rf "${results:?}/$scenario" "$results/$scenario.console"
  lap "$scenario"
  . "$here/$scenario.sh"
done
lap "end"
if [ $failed = 0 ]; then echo "PASS"; else echo "FAIL; logs are kept in $results"; exit 1; fi
