# 64-bit ARM under Linux: Raspberry Pi 3 to 5, Jetson, i.MX 8 and the like.
set(name aarch64)
set(processor aarch64)
set(triplet aarch64-linux-gnu)
set(emulator qemu-aarch64-static)
include(${CMAKE_CURRENT_LIST_DIR}/linux.cmake)
