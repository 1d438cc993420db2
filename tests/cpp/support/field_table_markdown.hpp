#pragma once

#include <sstream>
#include <string>

#include "xplane_bridge/core/state/field_table.hpp"

/// The field table as the Markdown page docs/fields.md.
namespace xplane_bridge::core {

inline std::string markdownNumber(double value) {
  std::ostringstream text;
  text.precision(10);
  text << value;
  return text.str();
}

inline std::string markdownConversion(const Conversion& conversion) {
  const bool plain = conversion.factor == 1.0 && conversion.offset == 0.0;
  if (plain) return "";
  std::string text = " (" + std::string(conversion.wire_unit) + ": x " + markdownNumber(conversion.factor);
  if (conversion.offset != 0.0) text += " + " + markdownNumber(conversion.offset);
  return text + ")";
}

inline std::string markdownSlots(int row, int slot, const RowSource& source) {
  std::string text = std::to_string(row) + "." + std::to_string(slot);
  if (source.bitfield) return text + " (bits)";
  if (source.count > 1) text += "-" + std::to_string(slot + source.count - 1);
  return text;
}

/// 120800 -> 12.08, 120000 -> 12.
inline std::string markdownVersion(std::int32_t first) {
  const std::int32_t minor = first / 100 % 100;
  return std::to_string(first / 10000) + (minor == 0 ? "" : (minor < 10 ? ".0" : ".") + std::to_string(minor));
}

inline std::string markdownVersions(const VersionRange& versions) {
  if (versions.isAll()) return "";
  if (versions.first == 0) return "before " + markdownVersion(versions.end) + ": ";
  return "from " + markdownVersion(versions.first) + ": ";
}

inline std::string markdownDatarefs(const FieldSpec& field) {
  std::string text;
  for (const DatarefSource& source : field.datarefs) {
    if (source.path == nullptr) continue;
    text += (text.empty() ? "" : "<br>") + markdownVersions(source.versions) + "`" + source.path + "`" +
            markdownConversion(source.conversion);
  }
  return text;
}

inline std::string markdownRow(const RowSource& source) {
  if (source.row11 < 0) return "";
  std::string text = markdownSlots(source.row11, source.slot11, source) + markdownConversion(source.conversion11);
  const std::string text12 =
      markdownSlots(source.row12, source.slot12, source) + markdownConversion(source.conversion12);
  if (text12 != text) text += "<br>12: " + text12;
  if (source.may_be_blank) text += "; -999 is blank";
  return text;
}

inline std::string fieldTableMarkdown() {
  std::ostringstream page;
  page << "# Where every field comes from\n\n"
          "Generated from the messages and `lib/core/state/sources.txt` by `field_table_doc`; do not edit.\n\n"
          "* **Field**: as in the message, or an input that fields are computed from. `[n]`: elements.\n"
          "* **Dataref**: transport `rref`. `{a,b}` stands for several datarefs, `[*]` for every element; `from "
          "12.08:`\n"
          "  and `before 12:` say which versions of X-Plane have it. Datarefs of fields without a row are asked for "
          "with\n"
          "  transport `data` too.\n"
          "* **Row**: transport `data`, `row.slot`. In brackets: unit on the wire and factor into the field's unit.\n"
          "* **[? id]** marks what only a live simulator can settle: see docs/setups/doctor.md.\n\n"
          "Datarefs are checked against Laminar's lists of 11.40, 11.55, 12.00, 12.08 and 12.10\n"
          "(`src/xplane_bridge/xplane_names`); rows are those of X-Plane 11's Data Output screen.\n";
  const FieldSpec* previous = nullptr;
  for (const FieldSpec& field : fieldTable()) {
    if (previous == nullptr || previous->group != field.group) {
      const int rate = defaultRate(field.group);
      page << "\n## " << toString(field.group) << ": " << messageName(field.group) << ".msg\n\nDefault rate: "
           << (rate == kEveryFrame ? std::string("every frame") : std::to_string(rate) + "/s") << ".\n\n"
           << "| Field | Unit | Dataref | Row | Remarks |\n|---|---|---|---|---|\n";
    }
    previous = &field;
    page << "| " << field.field;
    if (field.count > 1 && field.store != nullptr) page << "[" << field.count << "]";
    page << " | " << field.unit << " | " << markdownDatarefs(field) << " | " << markdownRow(field.row) << " | "
         << field.remark << " |\n";
  }
  return page.str();
}

}  // namespace xplane_bridge::core
