// core::ExcitationRunner for Python: one signal, as tx_node plays it.

#include "xplane_bridge/core/control/excitation.hpp"

#include <memory>
#include <stdexcept>
#include <string>

#include "xplane_bridge/bindings/python_type.hpp"

namespace xplane_bridge::bindings {
namespace {

PyObject* create(PyTypeObject* type, PyObject* arguments, PyObject* /*keywords*/) {
  return guarded([&]() -> PyObject* {
    const char* kind = nullptr;
    core::ExcitationSpec spec;
    unsigned int seed = 0;
    double sim_time = 0.0;
    if (!PyArg_ParseTuple(arguments, "sddddIddd", &kind, &spec.amplitude, &spec.duration, &spec.frequency_min,
                          &spec.frequency_max, &seed, &spec.roll_limit_deg, &spec.pitch_limit_deg, &sim_time)) {
      throw PythonError{};
    }
    const auto shape = core::excitationShapeFrom(kind);
    if (!shape) {
      throw std::invalid_argument(std::string("kind is \"") + kind + "\"; expected " + core::kExcitationShapeWords);
    }
    spec.shape = *shape;
    spec.seed = seed;
    auto runner = std::make_unique<core::ExcitationRunner>();
    runner->start({core::ExcitationSignal(spec)}, sim_time);
    return makeOwner(type, std::move(runner));
  });
}

PyObject* step(PyObject* object, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    double sim_time = 0.0, roll_deg = 0.0, pitch_deg = 0.0;
    if (!PyArg_ParseTuple(arguments, "ddd", &sim_time, &roll_deg, &pitch_deg)) throw PythonError{};
    auto& runner = ownedBy<core::ExcitationRunner>(object);
    const double value = runner.step(sim_time, roll_deg, pitch_deg).front();
    return runner.phase() == core::ExcitationPhase::kRunning ? makeNumber(value).release() : none();
  });
}

PyMethodDef methods[] = {
    {"step", method(step), METH_VARARGS,
     "step(sim_time, roll_deg, pitch_deg): what to add to the command now, or None when it has ended."},
    {nullptr, nullptr, 0, nullptr},
};

char description[] =
    "Excitation(kind, amplitude, duration, frequency_min, frequency_max, seed, roll_limit_deg, pitch_limit_deg, "
    "sim_time): tx_node's excitation of one target, which begins at `sim_time` [s] with 0. ValueError: no such signal.";

PyType_Slot slots[] = {
    {Py_tp_new, reinterpret_cast<void*>(create)},
    {Py_tp_dealloc, reinterpret_cast<void*>(destroyOwner<core::ExcitationRunner>)},
    {Py_tp_methods, methods},
    {Py_tp_doc, description},
    {0, nullptr},
};

PyType_Spec specification = {"xplane_bridge._core.Excitation", sizeof(Owner<core::ExcitationRunner>), 0,
                             Py_TPFLAGS_DEFAULT, slots};

}  // namespace

void addExcitation(PyObject* module) { addType(module, "Excitation", &specification); }

}  // namespace xplane_bridge::bindings
