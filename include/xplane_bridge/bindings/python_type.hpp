#pragma once

/// Python types whose objects own one of C++.

#include "xplane_bridge/bindings/python_object.hpp"

#include <memory>
#include <utility>

namespace xplane_bridge::bindings {

template <class Owned>
struct Owner {
  PyObject base;
  Owned* owned;
};

template <class Owned>
Owned& ownedBy(PyObject* object) {
  return *reinterpret_cast<Owner<Owned>*>(object)->owned;
}

/// A new object of a type whose size is that of Owner<Owned>.
template <class Owned>
PyObject* makeOwner(PyTypeObject* type, std::unique_ptr<Owned> owned) {
  Object object(type->tp_alloc(type, 0));
  reinterpret_cast<Owner<Owned>*>(object.get())->owned = owned.release();
  return object.release();
}

/// For Py_tp_dealloc.
template <class Owned>
void destroyOwner(PyObject* object) {
  delete reinterpret_cast<Owner<Owned>*>(object)->owned;
  PyTypeObject* type = Py_TYPE(object);
  type->tp_free(object);
  Py_DECREF(type);
}

inline void addType(PyObject* module, const char* name, PyType_Spec* specification) {
  Object type(PyType_FromSpec(specification));
  check(PyModule_AddObject(module, name, type.get()));
  (void)type.release();  // the module has it now
}

}  // namespace xplane_bridge::bindings
