#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace xplane_bridge {

/// What `lockstep_recorder` is to do.
struct LockstepRecording {
  enum class Compression { kNone, kLz4, kBz2 };

  std::string bag;  ///< file to write; `<file>.active` until it is complete
  Compression compression = Compression::kNone;
  std::uint32_t chunk_size = 768 * 1024;  ///< [bytes] of messages until they are compressed and written
  std::vector<std::string> topics;        ///< absolute names
  std::string bridge = "/xplane";         ///< namespace of the bridge

  /// Reads `--output-name=FILE` or `--output-prefix=START` (and the date), `--lz4`, `--bz2`, `--chunksize=KB` and
  /// topics, as `rosbag record` takes them, and `--bridge=NAMESPACE`.
  /// @throws std::invalid_argument an option that it does not know, no file, no topic
  static LockstepRecording parse(const std::vector<std::string>& arguments);
};

/// The program `lockstep_recorder`: records topics of a flight in lock-step until ROS ends, and answers each frame, so
/// that the flight waits for a recorder that is slow or stands: `rosbag record`, which the flight does not wait for,
/// drops what exceeds 100 waiting messages of a topic. Times of receipt are the simulator's (`use_sim_time`).
/// @returns the exit code; 1 with a reason on stderr: an argument, a file that cannot be written, a message that could
/// not
int runLockstepRecorder(int argc, char** argv);

}  // namespace xplane_bridge
