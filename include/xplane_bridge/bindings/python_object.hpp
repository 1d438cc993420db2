#pragma once

/// References to Python objects, and Python's errors as C++ exceptions.

// Python.h has to come before every other header.
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <exception>
#include <string>
#include <utility>
#include <vector>

namespace xplane_bridge::bindings {

/// Thrown when a Python exception is set: it is on its way to the caller.
struct PythonError {};

/// An owned reference; never null but when default-constructed or moved from.
class Object {
 public:
  Object() = default;
  /// Takes over a new reference, as most functions of the API return it. Throws PythonError for null.
  explicit Object(PyObject* owned) : object_(owned) {
    if (!object_) throw PythonError{};
  }
  Object(const Object& other) : object_(other.object_) { Py_XINCREF(object_); }
  Object(Object&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Object& operator=(Object other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  ~Object() { Py_XDECREF(object_); }

  /// A further reference to what its caller keeps owning.
  static Object borrowed(PyObject* object) {
    Py_XINCREF(object);
    return Object(object);
  }

  PyObject* get() const { return object_; }
  /// Gives the reference to the caller.
  PyObject* release() { return std::exchange(object_, nullptr); }

 private:
  PyObject* object_ = nullptr;
};

inline double number(PyObject* object) {
  const double value = PyFloat_AsDouble(object);
  if (value == -1.0 && PyErr_Occurred()) throw PythonError{};
  return value;
}

inline Object attribute(PyObject* object, PyObject* name) { return Object(PyObject_GetAttr(object, name)); }
inline Object attribute(PyObject* object, const char* name) { return Object(PyObject_GetAttrString(object, name)); }

inline Object makeNumber(double value) { return Object(PyFloat_FromDouble(value)); }

inline std::string text(PyObject* object) {
  const char* characters = PyUnicode_AsUTF8(object);
  if (!characters) throw PythonError{};
  return characters;
}

[[noreturn]] inline void raise(PyObject* type, const std::string& message) {
  PyErr_SetString(type, message.c_str());
  throw PythonError{};
}

/// The items of a list or tuple.
inline std::vector<Object> items(PyObject* sequence) {
  const Object fast(PySequence_Fast(sequence, "expected a list or a tuple"));
  std::vector<Object> out;
  for (Py_ssize_t i = 0; i < PySequence_Size(fast.get()); ++i) {
    out.push_back(Object(PySequence_GetItem(fast.get(), i)));
  }
  return out;
}

inline void check(int result) {
  if (result < 0) throw PythonError{};
}

/// Reads as many numbers from a list or tuple, which may be longer.
inline void readNumbers(PyObject* sequence, double* out, std::size_t count) {
  const Object fast(PySequence_Fast(sequence, "expected a list or a tuple"));
  if (static_cast<std::size_t>(PySequence_Fast_GET_SIZE(fast.get())) < count)
    raise(PyExc_ValueError, "too few numbers");
  for (std::size_t i = 0; i < count; ++i) {
    out[i] = number(PySequence_Fast_GET_ITEM(fast.get(), static_cast<Py_ssize_t>(i)));
  }
}

/// Puts them into a list.
inline void writeNumbers(PyObject* list, const double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    check(PySequence_SetItem(list, static_cast<Py_ssize_t>(i), makeNumber(values[i]).get()));
  }
}

/// Runs `body` at the border to Python: its PythonError becomes the null that says "an exception is set".
template <typename Body>
PyObject* guarded(Body&& body) {
  try {
    return body();
  } catch (const PythonError&) {
    return nullptr;
  } catch (const std::exception& error) {
    PyErr_SetString(PyExc_ValueError, error.what());
    return nullptr;
  }
}

inline PyObject* none() {
  Py_INCREF(Py_None);
  return Py_None;
}

/// A function with keywords, as PyMethodDef wants it.
template <typename Function>
PyCFunction method(Function* function) {
  return reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(function));
}

/// What is in the module; each is added by its own file.
void addArbiter(PyObject* module);
void addDatagrams(PyObject* module);
void addExcitation(PyObject* module);
void addFlightTruth(PyObject* module);
void addFlightView(PyObject* module);
void addStateReader(PyObject* module);
void addTwinLoop(PyObject* module);

}  // namespace xplane_bridge::bindings
