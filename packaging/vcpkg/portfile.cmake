# vcpkg: the C library, built by cargo and installed as scripts/library.sh makes it, with its files for CMake and
# pkg-config. scripts/recipes.sh fills in the version and the archive of the sources. Rust has to be installed.
vcpkg_download_distfile(ARCHIVE
  URLS "@ARCHIVE_URL@"
  FILENAME "tumble-@VERSION@.tar.gz"
  SHA512 @SHA512@)
vcpkg_extract_source_archive(SOURCE_PATH ARCHIVE "${ARCHIVE}")
find_program(CARGO cargo REQUIRED)

vcpkg_execute_required_process(
  COMMAND "${CMAKE_COMMAND}" -E env "CARGO_TARGET_DIR=${CURRENT_BUILDTREES_DIR}/target" bash scripts/library.sh
  WORKING_DIRECTORY "${SOURCE_PATH}"
  LOGNAME "library-${TARGET_TRIPLET}")
file(GLOB LIBRARY LIST_DIRECTORIES true "${CURRENT_BUILDTREES_DIR}/target/library/libtumble-@VERSION@-*-linux-gnu")

file(INSTALL "${LIBRARY}/include/" DESTINATION "${CURRENT_PACKAGES_DIR}/include")
if(VCPKG_LIBRARY_LINKAGE STREQUAL "dynamic")
  file(GLOB FILES "${LIBRARY}/lib/libtumble.so*")
else()
  set(FILES "${LIBRARY}/lib/libtumble.a")
endif()
file(INSTALL ${FILES} "${LIBRARY}/lib/pkgconfig" "${LIBRARY}/lib/cmake" DESTINATION "${CURRENT_PACKAGES_DIR}/lib")
# There is no build for debugging.
set(VCPKG_POLICY_MISMATCHED_NUMBER_OF_BINARIES enabled)
set(VCPKG_POLICY_SKIP_MISPLACED_CMAKE_FILES_CHECK enabled)
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE-MIT" "${SOURCE_PATH}/LICENSE-APACHE")
