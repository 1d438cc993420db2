# Compile settings every C++ target of the project shares, whichever CMakeLists.txt creates it.
include_guard(GLOBAL)

option(XPLANE_BRIDGE_WERROR "Treat compiler warnings as errors (scripts/setup --test; off for users)" OFF)
set(XPLANE_BRIDGE_SANITIZE "" CACHE STRING "Sanitizers for every target, e.g. address,undefined (empty: none)")

# xplane_bridge_configure_target(<target>): C++17 without extensions, the project's warnings, the chosen sanitizers.
function(xplane_bridge_configure_target target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  set_target_properties(${target} PROPERTIES CXX_STANDARD 17 CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast -Wnon-virtual-dtor
    -Woverloaded-virtual -Wcast-align -Wformat=2
    $<$<BOOL:${XPLANE_BRIDGE_WERROR}>:-Werror>)
  if(XPLANE_BRIDGE_SANITIZE)
    target_compile_options(${target} PRIVATE
      -fsanitize=${XPLANE_BRIDGE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(${target} PRIVATE -fsanitize=${XPLANE_BRIDGE_SANITIZE})
  elseif(UNIX AND NOT APPLE)
    # A stray use of ROS in a library that does not link it must fail here, not at load time. (Sanitized libraries
    # take their run-time from the executable, hence not for those.)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "SHARED_LIBRARY")
      target_link_options(${target} PRIVATE -Wl,--no-undefined)
    endif()
  endif()
endfunction()

# xplane_bridge_message_code(<target> core|nodes <folder>... [SOURCES file...]): what cmake/message_code writes from the
# messages, made before <target>; SOURCES: those of it that <target> compiles. Files that stay the same keep their time,
# hence the stamp.
get_filename_component(XPLANE_BRIDGE_MESSAGE_CODE "${CMAKE_CURRENT_LIST_DIR}/message_code" ABSOLUTE)
function(xplane_bridge_message_code target part)
  cmake_parse_arguments(arg "" "" "SOURCES" ${ARGN})
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  get_filename_component(root "${XPLANE_BRIDGE_MESSAGE_CODE}/../.." ABSOLUTE)
  file(GLOB inputs CONFIGURE_DEPENDS
    ${XPLANE_BRIDGE_MESSAGE_CODE}/*.py ${root}/msg/*.msg ${root}/srv/*.srv)
  set(stamp "${CMAKE_CURRENT_BINARY_DIR}/message_code_${part}.stamp")
  add_custom_command(OUTPUT ${stamp} BYPRODUCTS ${arg_SOURCES}
    COMMAND ${Python3_EXECUTABLE} -B ${XPLANE_BRIDGE_MESSAGE_CODE} ${part} ${arg_UNPARSED_ARGUMENTS}
    COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
    DEPENDS ${inputs} ${root}/lib/core/state/sources.txt
    COMMENT "Writing what follows from the messages: ${part}"
    VERBATIM)
  add_custom_target(${target}_message_code DEPENDS ${stamp})
  add_dependencies(${target} ${target}_message_code)
endfunction()
