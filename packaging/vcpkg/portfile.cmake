# SHA512 is that of GitHub's archive of the tag, which exists only after the release: docs/releasing.md.
vcpkg_from_github(
  OUT_SOURCE_PATH SOURCE_PATH
  REPO OWNER/gltf-meshlet
  REF "v${VERSION}"
  SHA512 0
  HEAD_REF main
)
vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}")  # with BUILD_SHARED_LIBS as the triplet wants
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME gltf_meshlet CONFIG_PATH lib/cmake/gltf_meshlet)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share"
  "${CURRENT_PACKAGES_DIR}/share/licenses")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
