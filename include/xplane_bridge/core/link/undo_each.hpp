#pragma once

#include <vector>

#include "xplane_bridge/core/link/simulator_port.hpp"

/// Undoes what several journal entries name side by side: one that X-Plane does not show holds up no other.
namespace xplane_bridge::core {

/// What undoes one entry, in the order in which it is carried out.
using UndoOperations = std::vector<UndoOperation>;

/// Sends what undoes one entry; returns whether all of it was sent.
bool sendUndo(SimulatorPort* link, const UndoOperations& operations);

/// Waits until X-Plane shows what each of several, which were sent, has written; returns of which it has. What has
/// nothing to be read back counts as shown where X-Plane answers, or where none of them has.
std::vector<bool> awaitEach(SimulatorPort* link, const std::vector<UndoOperations>& each, double timeout_s);

/// Carries out the operations of each of several; returns of which X-Plane has shown them. Waits up to `timeout_s`.
std::vector<bool> undoEach(SimulatorPort* link, std::vector<UndoOperations> each, double timeout_s);

/// Takes out what is only to be written right before a release, which is not read back, of those that X-Plane shows
/// released already: it was restarted since, and its flight has levers of its own. Waits up to `timeout_s`.
void dropPreparationsOfReleased(SimulatorPort* link, std::vector<UndoOperations>* each, double timeout_s);

}  // namespace xplane_bridge::core
