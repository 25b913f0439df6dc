# Installing: find_package(carpool CONFIG) gives carpool::scheduler, `pkg-config carpool` the flags.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/carpool)

install(TARGETS carpool_scheduler EXPORT carpoolTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/carpool DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT carpoolTargets NAMESPACE carpool:: DESTINATION ${package_folder})

configure_file(cmake/carpoolConfig.cmake.in carpoolConfig.cmake @ONLY)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/carpoolConfigVersion.cmake
  VERSION ${PROJECT_VERSION} COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/carpoolConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/carpoolConfigVersion.cmake
  DESTINATION ${package_folder})

# Relative to where the file lies, so that the whole prefix may be moved.
file(RELATIVE_PATH prefix_from_pc /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cmake/carpool.pc.in carpool.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/carpool.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
