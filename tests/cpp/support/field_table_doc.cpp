// Prints docs/fields.md:                   field_table_doc > docs/fields.md
// or every dataref asked for, by version:  field_table_doc --requests

#include <cstring>
#include <iostream>
#include <utility>

#include "field_table_markdown.hpp"

namespace {

void printRequests() {
  using namespace xplane_bridge::core;
  for (std::size_t group = 0; group < kFieldGroupCount; ++group) {
    for (const auto& [version, number] : {std::pair{kXPlane11, 11}, std::pair{kXPlane12, 12}}) {
      for (const DatarefRequest& request : datarefRequests(static_cast<FieldGroup>(group), Transport::kRref, version)) {
        std::cout << number << ' ' << request.path << '\n';
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::strcmp(argv[1], "--requests") == 0) {
    printRequests();
  } else {
    std::cout << xplane_bridge::core::fieldTableMarkdown();
  }
  return 0;
}
