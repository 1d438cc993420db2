#include "xplane_bridge/bindings/python_object.hpp"

namespace {

PyModuleDef definition = {
    PyModuleDef_HEAD_INIT,
    "_core",
    "Parts of xplane_bridge in C++: tx_node's arbiter, and of the emulator the state, the twin's step and the sending.",
    -1,
    nullptr,
    nullptr,
    nullptr,
    nullptr,
    nullptr,
};

}  // namespace

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming): the name is Python's
// Headers of Python before 3.9 do not say that this is to be seen from outside, and hidden it is no module.
extern "C" __attribute__((visibility("default"))) PyObject* PyInit__core();

PyMODINIT_FUNC PyInit__core() {
  return xplane_bridge::bindings::guarded([] {
    xplane_bridge::bindings::Object module(PyModule_Create(&definition));
    xplane_bridge::bindings::addArbiter(module.get());
    xplane_bridge::bindings::addDatagrams(module.get());
#ifdef XPLANE_BRIDGE_WITH_EIGEN  // left out by pip where Eigen is not there
    xplane_bridge::bindings::addExcitation(module.get());
    xplane_bridge::bindings::addFlightView(module.get());
#endif
    xplane_bridge::bindings::addFlightTruth(module.get());
    xplane_bridge::bindings::addStateReader(module.get());
    xplane_bridge::bindings::addTwinLoop(module.get());
    PyObject* out = module.get();
    Py_INCREF(out);
    return out;
  });
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)
