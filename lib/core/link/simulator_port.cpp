#include "xplane_bridge/core/link/simulator_port.hpp"

#include <array>
#include <cmath>
#include <variant>

namespace xplane_bridge::core {
namespace {

/// Sends what an encoder has written to `buffer`.
SendStatus sendEncoded(SimulatorPort* port, const std::uint8_t* buffer, const EncodeResult& size) {
  return size.ok() ? port->send(ByteView(buffer, *size)) : SendStatus::kNotEncoded;
}

}  // namespace

const char* toString(SendStatus status) {
  switch (status) {
    case SendStatus::kSent:
      return "sent";
    case SendStatus::kNoPeer:
      return "X-Plane has not been found";
    case SendStatus::kNotEncoded:
      return "not a valid message";
    case SendStatus::kSocketError:
      return "refused by the operating system";
  }
  return "invalid";
}

Subscription SimulatorPort::subscribe(RrefGroup group, RrefHandler handler) {
  return subscribe(std::move(group), std::move(handler), nullptr);
}

SendStatus SimulatorPort::write(std::string_view dataref, float value) {
  std::array<std::uint8_t, kDrefSize> buffer;
  return sendEncoded(this, buffer.data(), encodeDref(buffer, dataref, value));
}

SendStatus SimulatorPort::command(std::string_view path) {
  std::array<std::uint8_t, kMaxCmndSize> buffer;
  return sendEncoded(this, buffer.data(), encodeCmnd(buffer, path));
}

SendStatus SimulatorPort::sendUndo(const UndoOperation& operation) {
  std::array<std::uint8_t, kMaxUndoSize> buffer;
  return sendEncoded(this, buffer.data(), encodeUndo(buffer, operation));
}

std::vector<DatarefValue> SimulatorPort::read(std::vector<std::string> paths, double timeout_s) {
  return readUntil(std::move(paths), timeout_s, {});
}

std::pair<bool, DatarefValue> SimulatorPort::waitForDataref(const std::string& path, float expected, float tolerance,
                                                            double timeout_s) {
  const auto shown = [expected, tolerance](const std::vector<DatarefValue>& values) {
    return values[0].has_value() && std::abs(*values[0] - expected) <= tolerance;
  };
  const std::vector<DatarefValue> values = readUntil({path}, timeout_s, shown);
  return {shown(values), values[0]};
}

bool SimulatorPort::undo(const std::vector<UndoOperation>& operations, double timeout_s) {
  bool sent = true;
  for (const UndoOperation& operation : operations) {
    sent = sendUndo(operation) == SendStatus::kSent && sent;
  }
  return sent && waitUntilUndone(operations, timeout_s);
}

bool SimulatorPort::waitUntilUndone(const std::vector<UndoOperation>& operations, double timeout_s) {
  constexpr float kTolerance = 1e-3F;
  std::vector<std::string> paths;
  std::vector<float> expected;
  for (const UndoOperation& operation : operations) {
    if (const auto* dref = std::get_if<UndoDref>(&operation); dref != nullptr && dref->confirm) {
      paths.push_back(dref->path);
      expected.push_back(dref->value);
    }
  }
  if (paths.empty()) {
    return true;
  }
  const auto shown = [expected](const std::vector<DatarefValue>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!values[i].has_value() || !(std::abs(*values[i] - expected[i]) <= kTolerance)) {
        return false;
      }
    }
    return true;
  };
  return shown(readUntil(std::move(paths), timeout_s, shown));
}

}  // namespace xplane_bridge::core
