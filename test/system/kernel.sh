# Sourced by run.sh: Debian's kernel for a processor, with the modules that a vehicle's wires need.
#
#   fetch_kernel ARCH FOLDER     downloads and unpacks, once: FOLDER/{boot,hdr,root,tools}, FOLDER/release
#   build_gpio_sim ARCH FOLDER   FOLDER/gpiosim/gpio-sim.ko: Debian builds no gpio-sim
#   kernel_image ARCH FOLDER     prints the file that QEMU boots
#   add_modules FOLDER ROOT MODULE...   copies modules and what they depend on to ROOT/modules, in load order
#
# Nothing is installed and nothing needs root: packages come through apt with a state of its own, and are
# unpacked under FOLDER. Where they cannot be had, fetch_kernel returns 1 and says why in FOLDER/apt.log.

apt_of() {  # apt_of FOLDER ARCH TOOL ARGUMENTS...
  local folder=$1 arch=$2 tool=$3; shift 3
  "apt-$tool" -o "APT::Architecture=$arch" -o "APT::Architectures::=$arch" -o "Dir::State=$folder/apt/state" \
    -o "Dir::State::status=$folder/apt/status" -o "Dir::Cache=$folder/apt/cache" -o "APT::Sandbox::User=$(id -un)" \
    -o Acquire::Languages=none -o Acquire::Retries=3 -o "Debug::NoLocking=1" "$@"
}

# Downloads packages of an architecture into FOLDER/debs; those that are there stay.
download() {  # download FOLDER ARCH PACKAGE...
  local folder=$1 arch=$2; shift 2
  mkdir -p "$folder"/debs "$folder"/apt/state/lists/partial "$folder"/apt/cache/archives/partial
  touch "$folder/apt/status"
  if [ ! -e "$folder/apt/updated-$arch" ]; then
    apt_of "$folder" "$arch" get -qq update && touch "$folder/apt/updated-$arch"
  fi
  (cd "$folder/debs" && apt_of "$folder" "$arch" get -qq download "$@")
}

fetch_kernel() {  # fetch_kernel ARCH FOLDER
  local arch=$1 folder=$2 host image release series package
  [ -e "$folder/fetched" ] && return 0
  host=$(dpkg --print-architecture)
  mkdir -p "$folder"
  (
    set -e
    download "$folder" "$arch" can-utils gpiod
    image=$(apt_of "$folder" "$arch" cache depends "linux-image-$arch" | awk '/Depends:/ {print $2; exit}')
    release=${image#linux-image-}
    series=$(echo "$release" | cut -d. -f1,2)
    download "$folder" "$arch" "$image" "linux-headers-$release" "linux-headers-${release%-"$arch"}-common" \
      busybox-static libgpiod2 libgcc-s1 libc6 libstdc++6
    # The tools that build modules run here, whatever they build for; the source is for all.
    download "$folder/host" "$host" "linux-kbuild-$series" "linux-source-$series"
    rm -rf "$folder"/{boot,hdr,tools}
    dpkg -x "$folder"/debs/"$image"_*.deb "$folder/boot"
    for package in "$folder"/debs/linux-headers-*.deb "$folder"/host/debs/linux-kbuild-*.deb; do
      dpkg -x "$package" "$folder/hdr"
    done
    for package in can-utils gpiod libgpiod2 busybox-static libgcc-s1 libc6 libstdc++6; do
      dpkg -x "$folder"/debs/${package}_*.deb "$folder/tools"
    done
    echo "$release" > "$folder/release"
    touch "$folder/fetched"
  ) > "$folder/apt.log" 2>&1
}

build_gpio_sim() {  # build_gpio_sim ARCH FOLDER
  local arch=$1 folder=$2 headers archive top cross=""
  [ -e "$folder/gpiosim/gpio-sim.ko" ] && return 0
  [ "$arch" = arm64 ] && cross=aarch64-linux-gnu-
  rm -rf "$folder/gpiosim" "$folder/src"
  mkdir -p "$folder/gpiosim" "$folder/src"
  headers=$(readlink -f "$folder/hdr/usr/src/linux-headers-$(cat "$folder/release")")
  (
    set -e
    dpkg -x "$folder"/host/debs/linux-source-*.deb "$folder/src"
    archive=$(ls "$folder"/src/usr/src/linux-source-*.tar.xz)
    top=$(basename "$archive" .tar.xz)
    # --occurrence: tar stops reading at the last of them
    tar --occurrence=1 -I 'xz -T0' -xf "$archive" --strip-components=1 -C "$folder/gpiosim" \
      "$top/drivers/gpio/gpio-sim.c" "$top/drivers/gpio/gpiolib.h" "$top/kernel/irq/irq_sim.c"
    cd "$folder/gpiosim"
    mv drivers/gpio/gpiolib.h .
    mv drivers/gpio/gpio-sim.c sim-chip.c
    # CONFIG_IRQ_SIM is off, so the simulated interrupts are built in here; irq_to_desc() is for the kernel alone,
    # and this is the same descriptor.
    sed -e 's/irq_to_desc(irqnum)/irq_data_to_desc(irq_get_irq_data(irqnum))/' \
      -e 's/#include <linux\/irq.h>/&\n#include <linux\/irqdesc.h>/' kernel/irq/irq_sim.c > sim-irq.c
    printf 'obj-m := gpio-sim.o\ngpio-sim-y := sim-chip.o sim-irq.o\n' > Kbuild
    # The headers name the folder that they are installed in.
    sed -i "s#^include /usr/src/#include $folder/hdr/usr/src/#" "$headers/Makefile"
    make -s -C "$headers" M="$folder/gpiosim" ${cross:+CROSS_COMPILE=$cross} modules
    rm -rf "$folder/src"
  ) > "$folder/gpiosim.log" 2>&1
}

kernel_image() {  # kernel_image ARCH FOLDER
  local arch=$1 folder=$2 packed
  packed=$(ls "$folder"/boot/boot/vmlinuz-*)
  # arm64's is not packed; amd64's is unpacked here, once, where it takes no emulated seconds.
  [ "$arch" = arm64 ] && { echo "$packed"; return; }
  [ -e "$folder/vmlinux" ] || python3 - "$packed" "$folder/vmlinux" <<'PY'
import subprocess, sys
data = open(sys.argv[1], 'rb').read()
for magic, tool in ((b'\xfd7zXZ\0', 'xz'), (b'\x28\xb5\x2f\xfd', 'zstd')):
    at = data.find(magic)
    if at < 0:
        continue
    # Bytes that follow the stream make the tool complain; what it wrote is complete.
    image = subprocess.run([tool, '-dc'], input=data[at:], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
    if image[:4] == b'\x7fELF':
        open(sys.argv[2], 'wb').write(image)
        sys.exit(0)
sys.exit(f'{sys.argv[1]}: no packed kernel found')
PY
  echo "$folder/vmlinux"
}

add_modules() {  # add_modules FOLDER ROOT MODULE-OR-FILE...
  local folder=$1 root=$2; shift 2
  mkdir -p "$root/modules"
  python3 - "$folder/boot/lib/modules" "$root/modules" "$@" <<'PY'
import lzma, pathlib, sys
kernel, out, wanted = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:]
def plain(name): return name.split('.ko')[0].replace('-', '_')
found = {plain(f.name): f for f in kernel.rglob('*.ko*')}
order = []
def add(name):
    path = pathlib.Path(name) if '/' in name else found.get(plain(name))
    if path is None or plain(path.name) in order:
        return  # built in, or there already
    data = path.read_bytes()
    if path.suffix == '.xz':
        data = lzma.decompress(data)
    at = data.find(b'\0depends=')
    depends = data[at + 9:data.index(b'\0', at + 1)].decode() if at >= 0 else ''
    for needed in filter(None, depends.split(',')):
        add(needed)
    (out / f'{plain(path.name)}.ko').write_bytes(data)
    order.append(plain(path.name))
for name in wanted:
    add(name)
with open(out / 'order', 'w') as listing:
    listing.write(''.join(f'{name}\n' for name in order))
PY
}
