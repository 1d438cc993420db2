// Prints docs/fields.md: field_table_doc > docs/fields.md

#include <iostream>

#include "field_table_markdown.hpp"

int main() {
  std::cout << xplane_bridge::core::fieldTableMarkdown();
  return 0;
}
