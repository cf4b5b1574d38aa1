# 64-bit ARM under Linux, by Debian's cross compiler. Tests run through qemu-user-static where it is installed.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
find_program(ALCES_EMULATOR qemu-aarch64-static)
if(ALCES_EMULATOR)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${ALCES_EMULATOR} -L /usr/aarch64-linux-gnu)
endif()
