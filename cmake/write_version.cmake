# Run at each build. Writes OUTPUT (version.cpp) only if its text changes, so that nothing else is built again.
set(COMMIT unknown)
find_program(git git)
if(git)
  # A release unpacked inside somebody else's repository must not report that one's commit.
  execute_process(COMMAND ${git} -C ${SOURCE} rev-parse --show-toplevel OUTPUT_VARIABLE top ERROR_QUIET
    OUTPUT_STRIP_TRAILING_WHITESPACE)
  file(REAL_PATH ${SOURCE} source)
  if(top STREQUAL source)
    execute_process(COMMAND ${git} -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=* ERROR_QUIET
      OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(described)
      set(COMMIT ${described})
    endif()
  endif()
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/version.cpp.in ${OUTPUT} @ONLY)
