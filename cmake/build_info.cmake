# Writes FILE, with the definitions of nodes/base/build_info.hpp: cmake -DROOT=... -DVERSION=... -DFILE=... -P this.
# Only what is new is written, so that a build without a new commit compiles nothing.
set(commit "")
execute_process(COMMAND ${CMAKE_COMMAND} -E env GIT_OPTIONAL_LOCKS=0 git describe --always --abbrev=40 --exclude=* --dirty=+
  WORKING_DIRECTORY "${ROOT}" OUTPUT_VARIABLE commit ERROR_QUIET RESULT_VARIABLE failed
  OUTPUT_STRIP_TRAILING_WHITESPACE)
execute_process(COMMAND git rev-parse --show-toplevel
  WORKING_DIRECTORY "${ROOT}" OUTPUT_VARIABLE top ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
get_filename_component(root "${ROOT}" REALPATH)
if(failed OR NOT top STREQUAL root)  # a copy inside another repository is not of its commit
  set(commit "")
endif()
set(text "#include \"xplane_bridge/nodes/base/build_info.hpp\"

namespace xplane_bridge {

const char* packageVersion() { return \"${VERSION}\"; }
const char* packageCommit() { return \"${commit}\"; }

}  // namespace xplane_bridge
")
set(written "")
if(EXISTS "${FILE}")
  file(READ "${FILE}" written)
endif()
if(NOT written STREQUAL text)
  file(WRITE "${FILE}" "${text}")
endif()
