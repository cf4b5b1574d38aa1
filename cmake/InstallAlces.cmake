# Installs the library for others: headers, libalces.a, find_package(alces) and alces.pc.
include(CMakePackageConfigHelpers)
set(alces_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/alces)

install(TARGETS alces EXPORT alcesTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(CODE "
  if(CMAKE_INSTALL_DO_STRIP)  # CMake strips programs only
    execute_process(COMMAND \"${CMAKE_STRIP}\" --strip-debug --enable-deterministic-archives
      \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/libalces.a\")
  endif()
" COMPONENT development)
install(DIRECTORY include/alces TYPE INCLUDE COMPONENT development)
install(EXPORT alcesTargets NAMESPACE alces:: DESTINATION ${alces_cmake_dir} COMPONENT development)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/alcesConfig.cmake.in alcesConfig.cmake
  INSTALL_DESTINATION ${alces_cmake_dir})
write_basic_package_version_file(alcesConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/alcesConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/alcesConfigVersion.cmake
  DESTINATION ${alces_cmake_dir} COMPONENT development)

# The prefix of alces.pc is that of the installation, which `cmake --install --prefix` may change: written then.
install(CODE "
  set(PROJECT_DESCRIPTION \"${PROJECT_DESCRIPTION}\")
  set(PROJECT_VERSION \"${PROJECT_VERSION}\")
  cmake_path(ABSOLUTE_PATH CMAKE_INSTALL_PREFIX NORMALIZE)
  cmake_path(APPEND alces_pc_libdir \"\\\${prefix}\" \"${CMAKE_INSTALL_LIBDIR}\")
  cmake_path(APPEND alces_pc_includedir \"\\\${prefix}\" \"${CMAKE_INSTALL_INCLUDEDIR}\")
  configure_file(\"${PROJECT_SOURCE_DIR}/cmake/alces.pc.in\" \"${CMAKE_CURRENT_BINARY_DIR}/alces.pc\" @ONLY)
" COMPONENT development)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/alces.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
