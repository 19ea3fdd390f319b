# Every dependency comes from the distribution's packages; `./dev` installs them.
# The library is static by default, so those who link it need these too: lightcutsConfig.cmake gets the same list.
set(LIGHTCUTS_DEPENDENCIES
  "Threads" "TBB" "OpenEXR 3" "PNG" "JPEG" "fmt" "nlohmann_json 3.11" "tinyobjloader" "draco" "meshoptimizer" "xsimd")

# Debian 12's Imath mentions a Python library that its package does not hold; that is no concern of ours.
set(CMAKE_MESSAGE_LOG_LEVEL NOTICE)
foreach(dependency IN LISTS LIGHTCUTS_DEPENDENCIES)
  separate_arguments(dependency)
  find_package(${dependency} REQUIRED)
endforeach()
unset(CMAKE_MESSAGE_LOG_LEVEL)

# Debian 12 has Embree 3, later ones Embree 4; src/cpu/embree.h hides the difference.
find_package(embree 4 QUIET)
if(NOT embree_FOUND)
  find_package(embree 3.12 REQUIRED)
endif()
string(REGEX MATCH "^[0-9]+" embree_major "${embree_VERSION}")
list(APPEND LIGHTCUTS_DEPENDENCIES "embree ${embree_major}")

# The command's own.
find_package(CLI11 REQUIRED)
