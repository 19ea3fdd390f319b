# AUTO: errors by g++ 12, which CI compiles every change with; another compiler's new warning must stop nobody. (Before a
# release, g++ 14 is tried with ON.) CI and everybody else thus compile by the same commands, and neither compiles what
# the other did again.
set(lightcuts_werror ${LIGHTCUTS_WERROR})
if(LIGHTCUTS_WERROR STREQUAL "AUTO")
  set(lightcuts_werror OFF)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION MATCHES "^12\\.")
    set(lightcuts_werror ON)
  endif()
endif()

# Warnings for our own code only.
function(lightcuts_warnings target)
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wshadow -Wconversion
    -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual>)
  # GCC 12 warns about "literal" + std::string in the standard library itself (GCC bug 105651).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-restrict>)
  endif()
  if(lightcuts_werror)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Werror>)
  endif()
endfunction()
