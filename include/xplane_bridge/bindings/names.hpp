#pragma once

/// Attributes of Python objects whose names are made once.

#include "xplane_bridge/bindings/python_object.hpp"

#include <structmember.h>

#include <cstddef>
#include <initializer_list>
#include <utility>
#include <vector>

namespace xplane_bridge::bindings {

/// Where objects of a type keep what it declares in `__slots__`: bytes from their beginning; 0 for any other attribute.
inline Py_ssize_t slotOffset(PyTypeObject* type, PyObject* name) {
  PyObject* const owner = reinterpret_cast<PyObject*>(type);
  if (PyObject_HasAttr(owner, name) == 0) return 0;
  const Object found = attribute(owner, name);
  if (Py_TYPE(found.get()) != &PyMemberDescr_Type) return 0;
  if (PyType_IsSubtype(type, PyDescr_TYPE(found.get())) == 0) return 0;  // another type's
  const PyMemberDef& member = *reinterpret_cast<PyMemberDescrObject*>(found.get())->d_member;
  return member.type == T_OBJECT_EX && (member.flags & READONLY) == 0 ? member.offset : 0;
}

inline PyObject** slotAt(PyObject* owner, Py_ssize_t offset) {
  return offset == 0 ? nullptr : reinterpret_cast<PyObject**>(reinterpret_cast<char*>(owner) + offset);
}

/// Puts a value into a slot. The former one ends only then: its end may run code that looks there.
inline void putInto(PyObject** slot, Object value) {
  PyObject* const before = std::exchange(*slot, value.release());
  Py_XDECREF(before);
}

/// A name that is looked up in many objects. Of what `__slots__` declares, the place is looked up once for each type
/// that comes after another; any other is found by its name each time.
class Name {
 public:
  Name(const char* text) : text_(PyUnicode_InternFromString(text)) {}  // NOLINT(google-explicit-constructor)

  Object of(PyObject* owner) const {
    PyObject* const* const slot = slotIn(owner);
    if (slot && *slot) return Object::borrowed(*slot);
    return attribute(owner, text_.get());  // of an empty slot, Python's own error
  }
  double numberOf(PyObject* owner) const {
    PyObject* const* const slot = slotIn(owner);
    if (slot && *slot && PyFloat_CheckExact(*slot)) return PyFloat_AS_DOUBLE(*slot);
    return number(of(owner).get());
  }
  bool trueFor(PyObject* owner) const {
    const int answer = PyObject_IsTrue(of(owner).get());
    check(answer);
    return answer == 1;
  }
  void set(PyObject* owner, PyObject* value) const {
    if (PyObject** const slot = slotIn(owner)) {
      putInto(slot, Object::borrowed(value));
    } else {
      check(PyObject_SetAttr(owner, text_.get(), value));
    }
  }
  void set(PyObject* owner, double value) const { set(owner, makeNumber(value).get()); }
  void set(PyObject* owner, bool value) const { set(owner, value ? Py_True : Py_False); }

 private:
  PyObject** slotIn(PyObject* owner) const {
    PyTypeObject* const type = Py_TYPE(owner);
    if (reinterpret_cast<PyObject*>(type) != type_.get()) {
      const Py_ssize_t offset = slotOffset(type, text_.get());  // may throw, or run code that looks here
      Object before = Object::borrowed(reinterpret_cast<PyObject*>(type));
      std::swap(type_, before);  // which ends last
      offset_ = offset;
    }
    return slotAt(owner, offset_);
  }

  Object text_;
  // Kept, so that no other type comes to stand at its address.
  mutable Object type_;
  mutable Py_ssize_t offset_ = 0;
};

class Names {
 public:
  Names(std::initializer_list<const char*> names) : names_(names.begin(), names.end()) {}
  std::size_t size() const { return names_.size(); }
  /// Reads as many numbers of an object.
  void read(PyObject* object, double* out) const {
    for (const Name& name : names_) *out++ = name.numberOf(object);
  }

 private:
  std::vector<Name> names_;
};

}  // namespace xplane_bridge::bindings
