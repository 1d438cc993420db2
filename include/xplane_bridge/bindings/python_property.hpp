#pragma once

/// Python functions that are called again and again, and constants.

#include "xplane_bridge/bindings/python_object.hpp"

#include <cstddef>

namespace xplane_bridge::bindings {

/// A function that is called again and again, such as JSBSim's getters and setters; a bound method is called without
/// the step that binds it.
class Property {
 public:
  Property() = default;
  explicit Property(const Object& callable) : function_(callable) {
    if (PyMethod_Check(callable.get())) {
      function_ = Object::borrowed(PyMethod_Function(callable.get()));
      self_ = Object::borrowed(PyMethod_Self(callable.get()));
    }
  }

  double get() const { return number(call().get()); }
  void set(double value) const { (void)call(makeNumber(value).get()); }
  Object call(PyObject* argument = nullptr, PyObject* second = nullptr) const {
    PyObject* const arguments[] = {self_.get(), argument, second};
    const std::size_t first = self_.get() ? 0 : 1, end = second ? 3 : argument ? 2 : 1;
    return Object(vectorcall(function_.get(), arguments + first, end - first));
  }

 private:
  static PyObject* vectorcall(PyObject* function, PyObject* const* arguments, std::size_t count) {
#if PY_VERSION_HEX >= 0x03090000
    return PyObject_Vectorcall(function, arguments, count, nullptr);
#else
    return _PyObject_Vectorcall(function, arguments, count, nullptr);
#endif
  }

  Object function_, self_;
};

inline Property property(PyObject* owner, const char* name) { return Property(attribute(owner, name)); }
/// Those of a list or tuple.
inline std::vector<Property> properties(PyObject* owner, const char* name) {
  const std::vector<Object> methods = items(attribute(owner, name).get());
  return {methods.begin(), methods.end()};
}

inline double constant(const Object& owner, const char* name) { return number(attribute(owner.get(), name).get()); }

}  // namespace xplane_bridge::bindings
