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

inline std::string markdownDataref(const DatarefSource& source) {
  std::string text;
  if (source.path11 != nullptr) text += "`" + std::string(source.path11) + "`" + markdownConversion(source.conversion);
  if (source.path12 != nullptr) {
    text += std::string(text.empty() ? "" : "<br>") + "12: `" + source.path12 + "`" +
            markdownConversion(source.conversion12);
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
          "* **Dataref**: transport `rref`. `{a,b}` stands for several datarefs, `[*]` for every element; `12:` is\n"
          "  another name in X-Plane 12. Datarefs of fields without a row are asked for with transport `data` too.\n"
          "* **Row**: transport `data`, `row.slot`. In brackets: unit on the wire and factor into the field's unit.\n"
          "* **[?]** marks what only a live simulator can settle.\n\n"
          "Datarefs are checked against Laminar's published lists (X-Plane/XPlane2Blender,\n"
          "`io_xplane2blender/resources/DataRefs.txt`, versions 11.10 and 12.08); rows are those of X-Plane 11's Data\n"
          "Output screen.\n";
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
    page << " | " << field.unit << " | " << markdownDataref(field.dataref) << " | " << markdownRow(field.row) << " | "
         << field.remark << " |\n";
  }
  return page.str();
}

}  // namespace xplane_bridge::core
