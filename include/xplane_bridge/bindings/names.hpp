#pragma once

/// Attributes of Python objects whose names are made once.

#include "xplane_bridge/bindings/python_object.hpp"

#include <cstddef>
#include <initializer_list>
#include <vector>

namespace xplane_bridge::bindings {

class Names {
 public:
  Names(std::initializer_list<const char*> names) {
    for (const char* name : names) names_.emplace_back(PyUnicode_InternFromString(name));
  }
  std::size_t size() const { return names_.size(); }
  /// Reads as many numbers of an object.
  void read(PyObject* object, double* out) const {
    for (const Object& name : names_) *out++ = number(attribute(object, name.get()).get());
  }

 private:
  std::vector<Object> names_;
};

}  // namespace xplane_bridge::bindings
