# `cmake --install` gives the command, the library, the public headers, and what find_package(lightcuts) needs.
include(CMakePackageConfigHelpers)
set(lightcuts_package ${CMAKE_INSTALL_LIBDIR}/cmake/lightcuts)

install(TARGETS lightcuts EXPORT lightcutsTargets)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/lightcuts DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS lightcuts_command)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/apps/lightcuts/bench_study/study_report
  DESTINATION ${CMAKE_INSTALL_DATADIR}/lightcuts FILES_MATCHING PATTERN "*.py")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

set(find_dependencies)
foreach(dependency IN LISTS LIGHTCUTS_DEPENDENCIES)
  string(APPEND find_dependencies "find_dependency(${dependency})\n")
endforeach()
if(LIGHTCUTS_HAS_CUDA)
  string(APPEND find_dependencies "find_dependency(CUDAToolkit)\n")
endif()
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/lightcutsConfig.cmake.in
  ${PROJECT_BINARY_DIR}/lightcutsConfig.cmake INSTALL_DESTINATION ${lightcuts_package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/lightcutsConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(EXPORT lightcutsTargets NAMESPACE lightcuts:: DESTINATION ${lightcuts_package})
install(FILES ${PROJECT_BINARY_DIR}/lightcutsConfig.cmake ${PROJECT_BINARY_DIR}/lightcutsConfigVersion.cmake
  DESTINATION ${lightcuts_package})
