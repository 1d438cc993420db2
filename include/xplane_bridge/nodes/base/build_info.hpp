#pragma once

namespace xplane_bridge {

/// Version of the package.
const char* packageVersion();
/// Commit of the sources when they were built, "+" behind it where they had changes; empty: not built from a clone.
const char* packageCommit();

}  // namespace xplane_bridge
