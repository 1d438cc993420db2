#pragma once

#include <string>
#include <vector>

/// Who records a bridge's pictures, by names alone: the master knows no more of its nodes and topics.
namespace xplane_bridge {

/// Whether a topic is one of these of a camera, or the same of another camera of its bridge, which shows the same
/// X-Plane: a further camera lies in a namespace below the bridge's.
/// @param bridge the bridge's namespace, that of its flight_state; with "/", every topic would be below it, and the
///   camera's own alone count
bool isOfBridge(const std::string& topic, const std::vector<std::string>& topics, const std::string& bridge);

/// Whether a node is a recorder. rosbag's own is record_*, that of record.launch record; launch files have
/// rosbag_record, flight_bag and the like. A garbage_detector is none.
bool isRecorder(const std::string& node);

}  // namespace xplane_bridge
