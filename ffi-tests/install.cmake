# What `cmake --install` puts under a prefix: headers, both libraries, and what pkg-config and find_package read.
include(GNUInstallDirs)

install(DIRECTORY "${SKEP_ROOT}/include/" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}"
    FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp" PATTERN cmake EXCLUDE)

# The file carries the full version; programs ask for the SONAME at run time, linkers for the bare name.
set(SKEP_SHARED_FILE "libskep.so.${SKEP_VERSION}")
install(PROGRAMS "${SKEP_TARGET_DIR}/libskep.so" DESTINATION "${CMAKE_INSTALL_LIBDIR}" RENAME "${SKEP_SHARED_FILE}")
file(MAKE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/installed")
foreach(name "${SKEP_SONAME}" libskep.so)
    file(CREATE_LINK "${SKEP_SHARED_FILE}" "${CMAKE_CURRENT_BINARY_DIR}/installed/${name}" SYMBOLIC)
    install(FILES "${CMAKE_CURRENT_BINARY_DIR}/installed/${name}" DESTINATION "${CMAKE_INSTALL_LIBDIR}")
endforeach()
install(FILES "${SKEP_TARGET_DIR}/libskep.a" DESTINATION "${CMAKE_INSTALL_LIBDIR}")

set(folder "${CMAKE_INSTALL_LIBDIR}/cmake/skep")
configure_file("${SKEP_ROOT}/include/cmake/skep-config-version.cmake.in" installed/skep-config-version.cmake @ONLY)
install(FILES
    "${SKEP_ROOT}/include/cmake/skep-config.cmake"
    "${SKEP_ROOT}/include/cmake/skep-native-libraries.cmake"
    "${CMAKE_CURRENT_BINARY_DIR}/installed/skep-config-version.cmake"
    DESTINATION "${folder}")

# Relative to each other, whatever folders were chosen.
set(folder "${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig")
file(RELATIVE_PATH SKEP_PREFIX_FROM_PC "${folder}" "${CMAKE_INSTALL_PREFIX}")
file(RELATIVE_PATH SKEP_INCLUDE_FROM_PREFIX "${CMAKE_INSTALL_PREFIX}" "${CMAKE_INSTALL_FULL_INCLUDEDIR}")
file(RELATIVE_PATH SKEP_LIB_FROM_PREFIX "${CMAKE_INSTALL_PREFIX}" "${CMAKE_INSTALL_FULL_LIBDIR}")
string(REGEX REPLACE "/$" "" SKEP_PREFIX_FROM_PC "${SKEP_PREFIX_FROM_PC}")
list(TRANSFORM skep_native_libraries PREPEND "-l" OUTPUT_VARIABLE SKEP_NATIVE_FLAGS)
list(JOIN SKEP_NATIVE_FLAGS " " SKEP_NATIVE_FLAGS)
configure_file("${SKEP_ROOT}/include/cmake/skep.pc.in" installed/skep.pc @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/installed/skep.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
