# 32-bit ARM under Linux, by Debian's cross compiler. Tests run through qemu-user-static where it is installed.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-linux-gnueabihf-gcc)
set(CMAKE_CXX_COMPILER arm-linux-gnueabihf-g++)
find_program(ALCES_EMULATOR qemu-arm-static)
if(ALCES_EMULATOR)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${ALCES_EMULATOR} -L /usr/arm-linux-gnueabihf)
endif()
