// ControlArbiter for Python: the class that tx_node flies with, fed with numbers as they are after their way through
// ControlCommand.msg (float32) and giving them as they go to X-Plane (float32).
#include "xplane_bridge/bindings/python_type.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "xplane_bridge/core/control/control_arbiter.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"

namespace xplane_bridge::bindings {
namespace {

struct Arbiter {
  core::ControlArbiter arbiter;
  std::array<Object, core::kChannelCount> names;  // of its channels

  Arbiter(const core::ArbiterOptions& options, double now) : arbiter(options, now) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      names[i] = Object(PyUnicode_InternFromString(core::channelName(static_cast<core::Channel>(i)).c_str()));
    }
  }
};

Arbiter& self(PyObject* object) { return ownedBy<Arbiter>(object); }

double rounded(double value) { return static_cast<double>(static_cast<float>(value)); }

core::Failsafe failsafeOf(const std::string& word, const std::string& key) {
  if (word == "neutral") return core::Failsafe::kNeutral;
  if (word == "hold") return core::Failsafe::kHold;
  if (word == "manual") return core::Failsafe::kManual;
  throw std::invalid_argument(key + " is \"" + word + "\": expected neutral, hold or manual");
}

core::FlightMode modeOf(long number) {
  if (number == static_cast<long>(core::FlightMode::kManual)) return core::FlightMode::kManual;
  if (number == static_cast<long>(core::FlightMode::kAuto)) return core::FlightMode::kAuto;
  throw std::invalid_argument("mode is " + std::to_string(number) + ": expected 1 (MANUAL) or 2 (AUTO)");
}

long whole(PyObject* object) {
  const long value = PyLong_AsLong(object);
  if (value == -1 && PyErr_Occurred()) throw PythonError{};
  return value;
}

// A dictionary whose keys are all to be used.
class Table {
 public:
  Table(PyObject* dictionary, std::string path) : dictionary_(dictionary), path_(std::move(path)) {
    if (!PyDict_Check(dictionary)) throw std::invalid_argument(path_ + ": expected a dictionary");
  }
  PyObject* find(const char* key) {
    PyObject* value = PyDict_GetItemString(dictionary_, key);
    if (value) ++used_;
    return value;
  }
  PyObject* find(const Object& key) {
    PyObject* value = PyDict_GetItemWithError(dictionary_, key.get());
    if (value) ++used_;
    if (!value && PyErr_Occurred()) throw PythonError{};
    return value;
  }
  double number(const char* key, double fallback) {
    PyObject* value = find(key);
    return value ? bindings::number(value) : fallback;
  }
  void refuseRest(std::string_view expected) const {
    if (used_ == PyDict_Size(dictionary_)) return;
    throw std::invalid_argument(path_ + " has " + std::to_string(PyDict_Size(dictionary_) - used_) +
                                " unknown keys; expected some of " + std::string(expected));
  }

 private:
  PyObject* dictionary_;
  std::string path_;
  Py_ssize_t used_ = 0;
};

void readChannels(PyObject* dictionary, core::Failsafe failsafe, bool reverse_thrust, core::ArbiterOptions& out) {
  Table channels(dictionary, "channels");
  std::string names;
  for (const core::ChannelSection& section : core::kChannelSections) {
    core::ChannelOptions options = core::channelDefaults(section, failsafe, reverse_thrust);
    if (PyObject* given = channels.find(section.name)) {
      const std::string path = std::string("channels.") + section.name;
      Table in(given, path);
      options.low = in.number("low", options.low);
      options.high = in.number("high", options.high);
      options.slew = in.number("slew", options.slew);
      if (PyObject* word = in.find("failsafe")) options.failsafe = failsafeOf(text(word), path + ".failsafe");
      options.neutral = in.number("neutral", std::clamp(0.0, options.low, std::max(options.low, options.high)));
      in.refuseRest("low, high, slew, failsafe, neutral");
    } else {
      options.neutral = std::clamp(0.0, options.low, options.high);
    }
    for (std::size_t i = core::index(section.first); i <= core::index(section.last); ++i) out.channels[i] = options;
    names += std::string(names.empty() ? "" : ", ") + section.name;
  }
  channels.refuseRest(names);
}

core::ArbiterOptions readOptions(PyObject* dictionary) {
  core::ArbiterOptions out;
  Table in(dictionary, "options");
  out.engines = static_cast<int>(in.number("engines", out.engines));
  out.command_timeout = in.number("command_timeout", out.command_timeout);
  out.resume_grace = in.number("resume_grace", out.resume_grace);
  out.transition_rate = in.number("transition_rate", out.transition_rate);
  out.takeover_threshold = in.number("takeover_threshold", out.takeover_threshold);
  if (PyObject* mode = in.find("initial_mode")) out.initial_mode = modeOf(whole(mode));
  core::Failsafe failsafe = core::Failsafe::kNeutral;
  if (PyObject* word = in.find("failsafe")) failsafe = failsafeOf(text(word), "failsafe");
  const bool reverse = in.number("reverse_thrust", 0.0) != 0.0;
  PyObject* channels = in.find("channels");
  const Object empty(PyDict_New());
  readChannels(channels ? channels : empty.get(), failsafe, reverse, out);
  in.refuseRest(
      "engines, command_timeout, resume_grace, transition_rate, takeover_threshold, initial_mode, failsafe, "
      "reverse_thrust, channels");
  return out;
}

void readEngines(PyObject* sequence, std::uint32_t field, std::array<double, core::kMaxEngines>& values,
                 core::ControlCommand& out) {
  const std::vector<Object> given = items(sequence);
  if (given.size() > values.size()) throw std::invalid_argument("more throttles than engines: expected at most 8");
  for (std::size_t i = 0; i < given.size(); ++i) values[i] = rounded(number(given[i].get()));
  out.engine_count = static_cast<int>(given.size());
  out.fields |= field;
}

/// Of a command's values: a flight looks for each in each of its frames.
struct CommandKeys {
  std::vector<Object> scalars;  // in the order of core::kScalarChannels
  Object throttle{PyUnicode_InternFromString("throttle")};
  Object engine_throttles{PyUnicode_InternFromString("engine_throttles")};
  Object motors{PyUnicode_InternFromString("motors")};

  CommandKeys() {
    for (const core::ScalarChannel& scalar : core::kScalarChannels) {
      scalars.emplace_back(PyUnicode_InternFromString(scalar.name));
    }
  }
};

core::ControlCommand readCommand(PyObject* dictionary) {
  static const CommandKeys& keys = *new CommandKeys();  // never ended: Python ends before static objects do
  core::ControlCommand out;
  Table in(dictionary, "command");
  auto key = keys.scalars.begin();
  for (const core::ScalarChannel& scalar : core::kScalarChannels) {
    PyObject* value = in.find(*key++);
    if (!value) continue;
    out.*scalar.value = rounded(number(value));
    out.fields |= scalar.field;
  }
  if (PyObject* value = in.find(keys.throttle)) {
    out.throttle = rounded(number(value));
    out.fields |= core::kFieldThrottle;
  }
  if (PyObject* value = in.find(keys.engine_throttles)) {
    readEngines(value, core::kFieldEngineThrottles, out.engine_throttles, out);
  }
  if (PyObject* value = in.find(keys.motors)) readEngines(value, core::kFieldMotors, out.motors, out);
  in.refuseRest("the values of ControlCommand.msg");
  return out;
}

// Those of an axis as excitations name it: "throttle" is every lever.
core::ChannelSet channelsOf(const std::string& axis) {
  core::ChannelSet out;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    const auto channel = static_cast<core::Channel>(i);
    const bool lever = axis == "throttle" && core::isLever(channel);
    if (lever || core::channelName(channel) == axis) out.set(i);
  }
  if (out.none()) throw std::invalid_argument("\"" + axis + "\" is no channel");
  return out;
}

PyObject* create(PyTypeObject* type, PyObject* arguments, PyObject* /*keywords*/) {
  return guarded([&]() -> PyObject* {
    PyObject* options = nullptr;
    double now = 0.0;
    if (!PyArg_ParseTuple(arguments, "Od", &options, &now)) throw PythonError{};
    return makeOwner(type, std::make_unique<Arbiter>(readOptions(options), now));
  });
}

PyObject* command(PyObject* object, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    long mode = 0;
    PyObject* values = nullptr;
    double now = 0.0;
    if (!PyArg_ParseTuple(arguments, "lOd", &mode, &values, &now)) throw PythonError{};
    const auto refusal = self(object).arbiter.onCommand(modeOf(mode), readCommand(values), now);
    return refusal ? PyUnicode_FromString(refusal->text.c_str()) : none();
  });
}

PyObject* setMode(PyObject* object, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    long mode = 0;
    const char *who = nullptr, *reason = nullptr;
    double now = 0.0;
    if (!PyArg_ParseTuple(arguments, "lssd", &mode, &who, &reason, &now)) throw PythonError{};
    self(object).arbiter.setMode(modeOf(mode), who, reason, now);
    return none();
  });
}

PyObject* commands(PyObject* object, PyObject* axis) {
  return guarded([&]() -> PyObject* {
    const core::ChannelSet commanded = self(object).arbiter.commanded();
    return PyBool_FromLong((commanded & channelsOf(text(axis))).any() ? 1 : 0);
  });
}

PyObject* step(PyObject* object, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    double now = 0.0, value = 0.0;
    PyObject* excited = Py_None;
    if (!PyArg_ParseTuple(arguments, "d|Od", &now, &excited, &value)) throw PythonError{};
    core::ChannelExcitation excitation;
    if (excited != Py_None) {
      excitation.channels = channelsOf(text(excited));
      excitation.values.fill(value);
    }
    const core::ArbitratedControls& controls = self(object).arbiter.step(now, excitation);
    Object out(PyDict_New());
    for (std::size_t i = 0; i < core::kChannelCount; ++i) {
      if (!controls.active.test(i)) continue;
      const Object sent = makeNumber(core::wireValue(static_cast<core::Channel>(i), controls.values[i]));
      check(PyDict_SetItem(out.get(), self(object).names[i].get(), sent.get()));
    }
    return out.release();
  });
}

PyObject* getMode(PyObject* object, void* /*closure*/) {
  return PyLong_FromLong(static_cast<long>(self(object).arbiter.status().mode));
}

PyObject* getFailsafe(PyObject* object, void* /*closure*/) {
  return PyBool_FromLong(self(object).arbiter.status().failsafe ? 1 : 0);
}

PyObject* getReason(PyObject* object, void* /*closure*/) {
  return PyUnicode_FromString(self(object).arbiter.status().reason.c_str());
}

PyMethodDef methods[] = {
    {"command", method(command), METH_VARARGS,
     "command(mode, values, now): a command on control/manual (1) or control/auto (2); why it is refused, or None."},
    {"set_mode", method(setMode), METH_VARARGS, "set_mode(mode, who, reason, now)"},
    {"commands", method(commands), METH_O,
     "commands(axis): whether what flies commands it now (roll, pitch, yaw, throttle, or another channel)."},
    {"step", method(step), METH_VARARGS,
     "step(now, excited=None, value=0.0): what goes to X-Plane now, by channel; `excited`: to which `value` is added."},
    {nullptr, nullptr, 0, nullptr},
};

PyGetSetDef properties[] = {
    {"mode", getMode, nullptr, "1 MANUAL, 2 AUTO", nullptr},
    {"failsafe", getFailsafe, nullptr, "whether the failsafe flies", nullptr},
    {"reason", getReason, nullptr, "of the last change, in words", nullptr},
    {nullptr, nullptr, nullptr, nullptr, nullptr},
};

char description[] =
    "ControlArbiter(options, now): tx_node's arbiter. `options`: keys of config/tx.yaml and config/aircraft/*.yaml.\n\n"
    "Times are seconds of one clock. Numbers are rounded to float32 on the way in and out, as on the bridge's way.";

PyType_Slot slots[] = {
    {Py_tp_new, reinterpret_cast<void*>(create)},
    {Py_tp_dealloc, reinterpret_cast<void*>(destroyOwner<Arbiter>)},
    {Py_tp_methods, methods},
    {Py_tp_getset, properties},
    {Py_tp_doc, description},
    {0, nullptr},
};

PyType_Spec specification = {"xplane_bridge._core.ControlArbiter", sizeof(Owner<Arbiter>), 0, Py_TPFLAGS_DEFAULT,
                             slots};

}  // namespace

void addArbiter(PyObject* module) { addType(module, "ControlArbiter", &specification); }

}  // namespace xplane_bridge::bindings
