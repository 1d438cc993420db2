#pragma once

/// One attribute of one Python object that is read and written again and again.

#include "xplane_bridge/bindings/python_object.hpp"

#include <structmember.h>

#include <cstddef>
#include <utility>

namespace xplane_bridge::bindings {

/// Of what `__slots__` declares, the place in the object is looked up once; any other is found by its name each time.
/// The object must live as long as this.
class Attribute {
 public:
  Attribute() = default;
  Attribute(PyObject* owner, const char* name) : owner_(owner), name_(PyUnicode_InternFromString(name)) {
    PyObject* const type = reinterpret_cast<PyObject*>(Py_TYPE(owner));
    if (PyObject_HasAttr(type, name_.get()) == 0) return;
    const Object found = attribute(type, name_.get());
    if (Py_TYPE(found.get()) != &PyMemberDescr_Type) return;
    const PyMemberDef& member = *reinterpret_cast<PyMemberDescrObject*>(found.get())->d_member;
    if (member.type != T_OBJECT_EX || (member.flags & READONLY) != 0) return;
    slot_ = reinterpret_cast<PyObject**>(reinterpret_cast<char*>(owner) + member.offset);
  }

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
      const Object before = replaced(value.release());
    } else {
      check(PyObject_SetAttr(owner_, name_.get(), value.get()));
    }
  }

 private:
  // The former one ends only when the slot has its new value: its end may run code that looks there.
  Object replaced(PyObject* value) const {
    PyObject* const before = std::exchange(*slot_, value);
    return before ? Object(before) : Object();
  }

  PyObject* owner_ = nullptr;
  Object name_;
  PyObject** slot_ = nullptr;
};

}  // namespace xplane_bridge::bindings
