# Every dependency comes from the distribution's packages; `./dev` installs them.
find_package(Threads REQUIRED)
find_package(TBB REQUIRED)
find_package(OpenEXR 3 REQUIRED)
find_package(PNG REQUIRED)
find_package(JPEG REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(tinyobjloader REQUIRED)
find_package(draco REQUIRED)
find_package(meshoptimizer REQUIRED)
find_package(xsimd REQUIRED)
find_package(CLI11 REQUIRED)

# Debian 12 and Ubuntu 22.04 have Embree 3, later ones Embree 4; src/cpu/embree.h hides the difference.
find_package(embree 4 QUIET)
if(NOT embree_FOUND)
  find_package(embree 3.12 REQUIRED)
endif()
