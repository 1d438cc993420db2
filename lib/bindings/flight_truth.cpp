// What a campaign keeps of each frame: campaign.flight.
#include <vector>

#include "xplane_bridge/bindings/names.hpp"
#include "xplane_bridge/bindings/python_object.hpp"

namespace xplane_bridge::bindings {
namespace {

struct Parts {
  Names place{"sim_time_s", "latitude_deg", "longitude_deg", "altitude_m"};
  Names motion{"p_rad_s",        "q_rad_s",       "r_rad_s",
               "v_north_mps",    "v_east_mps",    "v_down_mps",
               "alpha_rad",      "beta_rad",      "calibrated_airspeed_mps",
               "wind_north_mps", "wind_east_mps", "wind_down_mps",
               "mass_kg"};
  Name thrust{"thrust_n"}, rpm{"rpm"}, quaternion{"quaternion"}, surfaces{"surfaces_deg"}, engines{"engines"};
};

PyObject* truthBytes(PyObject* /*module*/, PyObject* state) {
  return guarded([&]() -> PyObject* {
    static const Parts& p = *new Parts();  // never ended: Python ends before static objects do
    std::vector<double> out(p.place.size() + 4 + p.motion.size());
    p.place.read(state, out.data());
    readNumbers(p.quaternion.of(state).get(), out.data() + p.place.size(), 4);
    p.motion.read(state, out.data() + p.place.size() + 4);
    const Object deflections(PyDict_Values(p.surfaces.of(state).get()));
    for (const Object& deflection : items(deflections.get())) out.push_back(number(deflection.get()));
    const std::vector<Object> all = items(p.engines.of(state).get());
    for (const Name* name : {&p.thrust, &p.rpm}) {
      for (const Object& engine : all) out.push_back(name->numberOf(engine.get()));
    }
    return PyBytes_FromStringAndSize(reinterpret_cast<const char*>(out.data()),
                                     static_cast<Py_ssize_t>(out.size() * sizeof(double)));
  });
}

PyMethodDef functions[] = {
    {"truth_bytes", truthBytes, METH_O,
     "truth_bytes(state) -> bytes: what the flight model really did, in doubles of this computer: what two flights "
     "must share to be the same."},
    {nullptr, nullptr, 0, nullptr},
};

}  // namespace

void addFlightTruth(PyObject* module) { check(PyModule_AddFunctions(module, functions)); }

}  // namespace xplane_bridge::bindings
