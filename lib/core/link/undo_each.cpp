#include "xplane_bridge/core/link/undo_each.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

namespace xplane_bridge::core {
namespace {

constexpr float kSame = 1e-3F;

/// What X-Plane is to show of several.
struct Expected {
  std::vector<std::string> paths;
  std::vector<std::pair<std::size_t, float>> values;  // of each path: of which entry, and what

  void add(std::size_t entry, const UndoOperations& operations) {
    for (const UndoOperation& operation : operations) {
      const auto* dref = std::get_if<UndoDref>(&operation);
      if (dref == nullptr || !dref->confirm) continue;
      paths.push_back(dref->path);
      values.emplace_back(entry, dref->value);
    }
  }

  bool isShown(std::size_t path, const std::vector<DatarefValue>& shown) const {
    return shown[path] && std::abs(*shown[path] - values[path].second) <= kSame;
  }
};

bool isPreparation(const UndoOperation& operation) {
  const auto* dref = std::get_if<UndoDref>(&operation);
  return dref != nullptr && !dref->confirm;
}

}  // namespace

bool sendUndo(SimulatorPort* link, const UndoOperations& operations) {
  bool sent = true;
  for (const UndoOperation& operation : operations) sent = link->sendUndo(operation) == SendStatus::kSent && sent;
  return sent;
}

std::vector<bool> awaitEach(SimulatorPort* link, const std::vector<UndoOperations>& each, double timeout_s) {
  Expected expected;
  for (std::size_t i = 0; i < each.size(); ++i) expected.add(i, each[i]);
  if (expected.paths.empty()) return std::vector<bool>(each.size(), true);
  const auto missing = [expected](const std::vector<DatarefValue>& values) {
    std::set<std::size_t> out;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (!expected.isShown(k, values)) out.insert(expected.values[k].first);
    }
    return out;
  };
  const auto values =
      link->readUntil(expected.paths, timeout_s, [missing](const auto& answers) { return missing(answers).empty(); });
  const bool answered = std::any_of(values.begin(), values.end(), [](const auto& value) { return value.has_value(); });
  std::vector<bool> shown(each.size(), answered || link->status().up());
  for (const std::size_t i : missing(values)) shown[i] = false;
  return shown;
}

std::vector<bool> undoEach(SimulatorPort* link, std::vector<UndoOperations> each, double timeout_s) {
  std::set<std::size_t> not_sent;
  for (std::size_t i = 0; i < each.size(); ++i) {
    if (!sendUndo(link, each[i])) not_sent.insert(i);
  }
  for (const std::size_t i : not_sent) each[i].clear();  // there is nothing to wait for
  std::vector<bool> shown = awaitEach(link, each, timeout_s);
  for (const std::size_t i : not_sent) shown[i] = false;
  return shown;
}

void dropPreparationsOfReleased(SimulatorPort* link, std::vector<UndoOperations>* each, double timeout_s) {
  Expected released;
  for (std::size_t i = 0; i < each->size(); ++i) {
    const UndoOperations& operations = (*each)[i];
    if (std::any_of(operations.begin(), operations.end(), isPreparation)) released.add(i, operations);
  }
  if (released.paths.empty()) return;
  const auto shown = link->read(released.paths, timeout_s);
  for (std::size_t k = 0; k < shown.size(); ++k) {
    // Of one that does not answer nothing is known: better its levers than motors that stop.
    if (!released.isShown(k, shown)) continue;
    UndoOperations& operations = (*each)[released.values[k].first];
    operations.erase(std::remove_if(operations.begin(), operations.end(), isPreparation), operations.end());
  }
}

}  // namespace xplane_bridge::core
