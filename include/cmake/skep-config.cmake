# find_package(skep) gives
#   skep::skep    the shared library
#   skep::static  the static library, with the system's libraries it needs
# each where it is installed; find_package(skep COMPONENTS shared static) insists on them.
#
# An installed tree may be moved as a whole: everything is found from where this file lies, the prefix being the
# nearest folder above it that has include/skep.h.
get_filename_component(_skep_prefix "${CMAKE_CURRENT_LIST_DIR}" REALPATH)
while(_skep_prefix AND NOT EXISTS "${_skep_prefix}/include/skep.h")
    string(REGEX REPLACE "/[^/]*$" "" _skep_prefix "${_skep_prefix}")
endwhile()

include("${CMAKE_CURRENT_LIST_DIR}/skep-native-libraries.cmake")

# Systems differ in where libraries lie under a prefix. When this file lies among them, they are there.
set(_skep_folders lib lib64)
if(CMAKE_LIBRARY_ARCHITECTURE)
    list(INSERT _skep_folders 0 "lib/${CMAKE_LIBRARY_ARCHITECTURE}")
endif()
get_filename_component(_skep_folder "${CMAKE_CURRENT_LIST_DIR}/../.." REALPATH)
file(RELATIVE_PATH _skep_folder "${_skep_prefix}/" "${_skep_folder}")
list(INSERT _skep_folders 0 "${_skep_folder}")

foreach(_skep_folder IN LISTS _skep_folders)
    set(_skep_file "${_skep_prefix}/${_skep_folder}/libskep${CMAKE_SHARED_LIBRARY_SUFFIX}")
    if(NOT TARGET skep::skep AND _skep_prefix AND EXISTS "${_skep_file}")
        add_library(skep::skep SHARED IMPORTED)
        set_target_properties(skep::skep PROPERTIES
            IMPORTED_LOCATION "${_skep_file}"
            INTERFACE_INCLUDE_DIRECTORIES "${_skep_prefix}/include")
    endif()
    set(_skep_file "${_skep_prefix}/${_skep_folder}/libskep.a")
    if(NOT TARGET skep::static AND _skep_prefix AND EXISTS "${_skep_file}")
        add_library(skep::static STATIC IMPORTED)
        set_target_properties(skep::static PROPERTIES
            IMPORTED_LOCATION "${_skep_file}"
            INTERFACE_LINK_LIBRARIES "${skep_native_libraries}"
            INTERFACE_INCLUDE_DIRECTORIES "${_skep_prefix}/include")
    endif()
endforeach()

set(skep_shared_FOUND FALSE)
if(TARGET skep::skep)
    set(skep_shared_FOUND TRUE)
endif()
set(skep_static_FOUND FALSE)
if(TARGET skep::static)
    set(skep_static_FOUND TRUE)
endif()
if(NOT skep_shared_FOUND AND NOT skep_static_FOUND)
    set(skep_FOUND FALSE)
    set(skep_NOT_FOUND_MESSAGE "include/skep.h and libskep should lie in folders above ${CMAKE_CURRENT_LIST_DIR}")
endif()
foreach(_skep_component IN LISTS skep_FIND_COMPONENTS)
    if(skep_FIND_REQUIRED_${_skep_component} AND NOT skep_${_skep_component}_FOUND)
        set(skep_FOUND FALSE)
        set(skep_NOT_FOUND_MESSAGE "the component '${_skep_component}' is not installed under ${_skep_prefix}")
    endif()
endforeach()

unset(_skep_prefix)
unset(_skep_folders)
unset(_skep_folder)
unset(_skep_file)
unset(_skep_component)
