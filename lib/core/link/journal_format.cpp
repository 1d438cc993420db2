#include "journal_format.hpp"

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <variant>

#include "xplane_bridge/core/base/whole_number.hpp"

namespace xplane_bridge::core {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "xplane_bridge journal";

/// JSON has no other numbers: with null in the place of one the whole file could not be read any more.
void requireFinite(const std::string& what, float value) {
  if (!std::isfinite(value)) {
    throw JournalError("the journal cannot hold " + std::to_string(value) + " as what " + what +
                       " is to be put back to: expected a finite number");
  }
}

json toJson(const UndoOperation& operation) {
  struct Writer {
    json operator()(const UndoDref& dref) const {
      requireFinite(dref.path, dref.value);
      json out = {{"op", "dref"}, {"path", dref.path}, {"value", dref.value}};
      if (!dref.confirm) {
        out["confirm"] = false;
      }
      return out;
    }
    json operator()(const UndoData& data) const {
      for (const float value : data.row.values) {
        requireFinite("row " + std::to_string(data.row.index), value);
      }
      return {{"op", "data"}, {"row", data.row.index}, {"values", data.row.values}};
    }
    json operator()(const UndoUsel& usel) const { return {{"op", "usel"}, {"rows", usel.rows}}; }
    json operator()(const UndoIse4& ise4) const {
      return {{"op", "ise4_off"}, {"target", ise4.target}, {"address", ise4.address}, {"port", ise4.port}};
    }
    json operator()(const UndoPause&) const { return {{"op", "resume"}}; }
  };
  return std::visit(Writer{}, operation);
}

UndoOperation operationFrom(const json& document) {
  const std::string op = document.at("op");
  if (op == "dref") {
    return UndoDref{document.at("path"), document.at("value"), document.value("confirm", true)};
  }
  if (op == "data") {
    return UndoData{DataRow{wholeNumber<std::int32_t>(document.at("row")), document.at("values")}};
  }
  if (op == "usel") {
    UndoUsel usel;
    for (const json& row : document.at("rows")) {
      usel.rows.push_back(wholeNumber<std::int32_t>(row));
    }
    return usel;
  }
  if (op == "ise4_off") {
    return UndoIse4{wholeNumber<std::int32_t>(document.at("target")), document.at("address"),
                    wholeNumber<std::uint16_t>(document.at("port"))};
  }
  if (op == "resume") {
    return UndoPause{};
  }
  throw JournalError("unknown operation '" + op + "'");
}

json toJson(const JournalEntry& entry) {
  json undo = json::array();
  for (const UndoOperation& operation : entry.undo) {
    undo.push_back(toJson(operation));
  }
  json document = {{"id", entry.id},
                   {"purpose", entry.purpose},
                   {"owner",
                    {{"node", entry.owner.node},
                     {"pid", entry.owner.pid},
                     {"start_ticks", entry.owner.start_ticks},
                     {"boot_id", entry.owner.boot_id},
                     {"computer", entry.owner.computer}}},
                   {"undo", undo}};
  if (!entry.left.empty()) {
    document["left"] = entry.left;
  }
  for (const JournalSubscription& subscription : entry.subscriptions) {
    document["subscriptions"].push_back(
        {{"port", subscription.port}, {"datarefs", subscription.datarefs}, {"rpos", subscription.rpos}});
  }
  return document;
}

JournalEntry entryFrom(const json& document) {
  JournalEntry entry;
  entry.id = document.at("id");
  entry.purpose = document.at("purpose");
  const json& owner = document.at("owner");
  entry.owner.node = owner.at("node");
  entry.owner.pid = wholeNumber<std::int64_t>(owner.at("pid"));
  entry.owner.start_ticks = wholeNumber<std::int64_t>(owner.at("start_ticks"));
  entry.owner.boot_id = owner.at("boot_id");
  entry.owner.computer = owner.at("computer");
  for (const json& operation : document.at("undo")) {
    entry.undo.push_back(operationFrom(operation));
  }
  entry.left = document.value("left", "");
  for (const json& subscription : document.value("subscriptions", json::array())) {
    entry.subscriptions.push_back({wholeNumber<std::uint16_t>(subscription.at("port")),
                                   subscription.at("datarefs").get<std::vector<std::string>>(),
                                   subscription.at("rpos")});
  }
  return entry;
}

}  // namespace

JournalContent parseJournal(const std::string& text) {
  JournalContent content;
  try {
    const json document = json::parse(text);
    if (document.at("format") != kFormat) {
      content.damage = "format is not '" + std::string(kFormat) + "'";
      return content;
    }
    content.version = wholeNumber<int>(document.at("version"));
    if (content.version == kJournalVersion) {
      for (const json& entry : document.at("entries")) {
        content.entries.push_back(entryFrom(entry));
      }
    }
  } catch (const json::exception& error) {
    content.damage = error.what();
  } catch (const JournalError& error) {
    content.damage = error.what();
  } catch (const std::out_of_range& error) {
    content.damage = error.what();
  }
  return content;
}

std::string toText(const std::vector<JournalEntry>& entries) {
  json document = {{"format", kFormat}, {"version", kJournalVersion}, {"entries", json::array()}};
  for (const JournalEntry& entry : entries) {
    document["entries"].push_back(toJson(entry));
  }
  return document.dump(2) + "\n";
}

}  // namespace xplane_bridge::core
