# 32-bit ARM under Linux with a floating-point unit, ARMv7: BeagleBone, i.MX 6, Raspberry Pi 2 and the like.
set(name armhf)
set(processor arm)
set(triplet arm-linux-gnueabihf)
set(emulator qemu-arm-static)
include(${CMAKE_CURRENT_LIST_DIR}/linux.cmake)
