#pragma once

/// One attribute of one Python object that is read and written again and again.

#include "xplane_bridge/bindings/names.hpp"
#include "xplane_bridge/bindings/python_object.hpp"

#include <utility>

namespace xplane_bridge::bindings {

/// Of what `__slots__` declares, the place in the object is looked up once; any other is found by its name each time.
/// The object must live as long as this.
class Attribute {
 public:
  Attribute() = default;
  Attribute(PyObject* owner, const char* name)
      : owner_(owner),
        name_(PyUnicode_InternFromString(name)),
        slot_(slotAt(owner, slotOffset(Py_TYPE(owner), name_.get()))) {}

  Object get() const {
    if (slot_ && *slot_) return Object::borrowed(*slot_);
    return attribute(owner_, name_.get());  // of an empty slot, Python's own error
  }
  double getNumber() const {
    if (slot_ && *slot_ && PyFloat_CheckExact(*slot_)) return PyFloat_AS_DOUBLE(*slot_);
    return number(get().get());
  }
  void set(Object value) const {
    if (slot_) {
      putInto(slot_, std::move(value));
    } else {
      check(PyObject_SetAttr(owner_, name_.get(), value.get()));
    }
  }

 private:
  PyObject* owner_ = nullptr;
  Object name_;
  PyObject** slot_ = nullptr;
};

}  // namespace xplane_bridge::bindings
