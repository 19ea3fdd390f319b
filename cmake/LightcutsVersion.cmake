# Gives the library its version() and commit(): one small file, written anew at each build if the commit changed.
set(lightcuts_version_cpp ${PROJECT_BINARY_DIR}/generated/version.cpp)
if(LIGHTCUTS_HAS_CUDA)
  set(built_with_cuda true)
else()
  set(built_with_cuda false)
endif()
add_custom_target(lightcuts_version
  COMMAND ${CMAKE_COMMAND} -D SOURCE=${PROJECT_SOURCE_DIR} -D OUTPUT=${lightcuts_version_cpp}
    -D VERSION=${PROJECT_VERSION} -D BUILT_WITH_CUDA=${built_with_cuda}
    -P ${CMAKE_CURRENT_LIST_DIR}/write_version.cmake
  BYPRODUCTS ${lightcuts_version_cpp}
  COMMENT "Asking git for the commit")
add_dependencies(lightcuts lightcuts_version)
target_sources(lightcuts PRIVATE ${lightcuts_version_cpp})
