# Compile settings every C++ target of the project shares, whichever CMakeLists.txt creates it.
include_guard(GLOBAL)

option(XPLANE_BRIDGE_WERROR "Treat compiler warnings as errors (CI; off for users)" OFF)
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
