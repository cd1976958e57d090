# find_package(tumble) gives tumble::tumble, the shared library, and tumble::tumble_static.
get_filename_component(_tumble_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET tumble::tumble)
  add_library(tumble::tumble SHARED IMPORTED)
  set_target_properties(tumble::tumble PROPERTIES
    IMPORTED_LOCATION "${_tumble_prefix}/lib/libtumble.so.@SOVERSION@"
    IMPORTED_SONAME "libtumble.so.@SOVERSION@"
    INTERFACE_INCLUDE_DIRECTORIES "${_tumble_prefix}/include")
  add_library(tumble::tumble_static STATIC IMPORTED)
  set_target_properties(tumble::tumble_static PROPERTIES
    IMPORTED_LOCATION "${_tumble_prefix}/lib/libtumble.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_tumble_prefix}/include"
    INTERFACE_LINK_LIBRARIES "pthread;dl;m")
endif()
unset(_tumble_prefix)
