# Installation: find_package(tangible) gives tangible::tangible (lib) and tangible::estimation.
include(CMakePackageConfigHelpers)

install(FILES "${TANGIBLE_INCLUDE_DIR}/tangible/config/jet_widths.h"
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tangible/config)
install(FILES "${PROJECT_SOURCE_DIR}/lib/tangible.h" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tangible)
install(EXPORT tangible_targets FILE tangibleTargets.cmake NAMESPACE tangible::
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tangible)
configure_package_config_file("${PROJECT_SOURCE_DIR}/lib/cmake/tangibleConfig.cmake.in"
                              "${PROJECT_BINARY_DIR}/tangibleConfig.cmake"
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tangible)
write_basic_package_version_file("${PROJECT_BINARY_DIR}/tangibleConfigVersion.cmake"
                                 COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/tangibleConfig.cmake"
              "${PROJECT_BINARY_DIR}/tangibleConfigVersion.cmake"
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tangible)
