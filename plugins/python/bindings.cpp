// dembark._physics: the law headers as Python sees them. Private; dembark.physics adds checks, shapes, units and documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "dembark/capillary/bridge_law.hpp"
#include "dembark/contact.hpp"
#include "dembark/parameters/contact_parameters.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark;

namespace {

using Array = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Result = nb::ndarray<nb::numpy, double, nb::ndim<1>>;
using Vectors = nb::ndarray<nb::numpy, double, nb::shape<-1, 3>>;

Result make_result(std::size_t n, double*& data) {
  data = new double[n];
  return Result(data, {n}, nb::capsule(data, [](void* p) noexcept { delete[] static_cast<double*>(p); }));
}

/// value(i) for i = 0 ... n - 1.
template <class Value>
Result filled(std::size_t n, Value value) {
  double* out;
  Result result = make_result(n, out);
  for (std::size_t i = 0; i < n; ++i) out[i] = value(i);
  return result;
}

template <class Option>
Option option_of(const std::string& what, const std::vector<std::string>& names, const std::string& word) {
  Option option{};
  if (option_from_name(names, word, option)) return option;
  throw std::invalid_argument(what + " must be " + names_text(names) + ", not '" + word + "'");
}

/// Unequal spheres are solved for when they come.
capillary::BridgeLaw bridge_law(const std::string& model, double contact_angle) {
  return {option_of<capillary::Model>("capillary model", capillary::model_names(), model), contact_angle, capillary::Pairs::equal};
}
void complete_for(capillary::BridgeLaw& law, double radius_1, double radius_2) {
  if (radius_1 != radius_2) law.complete();
}

Vec3<double> vector(const nb::tuple& t) { return {nb::cast<double>(t[0]), nb::cast<double>(t[1]), nb::cast<double>(t[2])}; }
nb::tuple tuple(const Vec3<double>& v) { return nb::make_tuple(v.x, v.y, v.z); }

/// What a script gives to a law by the names of the table of parameters: numbers, and words for choices.
class Given : public ContactSource {
  nb::dict given_;

 public:
  ContactOptions options;

  explicit Given(nb::dict given) : given_(std::move(given)) {
    for (const auto [name, value] : given_) {
      const std::string key = nb::cast<std::string>(name);
      bool known = parameter(key);
      each_choice(options, [&](const char* choice, const char*, auto& option, const auto& values, const char*) {
        if (key != choice) return;
        known = true;
        std::string word;
        if (!nb::try_cast(value, word)) throw nb::type_error((key + " must be a word").c_str());
        option = option_of<std::decay_t<decltype(option)>>(key, values, word);
      });
      if (!known) throw std::invalid_argument("a contact has no parameter '" + key + "'");
    }
  }
  std::string name(const Parameter& p) const override { return p.name; }
  double given(const Parameter& p, int) const override { return given_.contains(p.name) ? nb::cast<double>(given_[p.name]) : NAN; }
  [[noreturn]] void missing(const Parameter& p, int) const override { throw std::invalid_argument(std::string(p.name) + " is missing"); }
  [[noreturn]] void wrong(const std::string& line) const override { throw std::invalid_argument(line); }
};

/// Bridge law and contact parameters with the lifetime of the Python object that uses them.
struct Contact {
  ContactParameters parameters;
  std::shared_ptr<capillary::BridgeLaw> bridge;
  ContactState state;
};

}  // namespace

void bind_events(nb::module_& m);
void bind_integration(nb::module_& m);
void bind_lcp(nb::module_& m);
void bind_impact(nb::module_& m);
void bind_liquid(nb::module_& m);
void bind_sph(nb::module_& m);
void bind_motion(nb::module_& m);

NB_MODULE(_physics, m) {
  bind_events(m);
  bind_integration(m);
  bind_lcp(m);
  bind_impact(m);
  bind_liquid(m);
  bind_sph(m);
  bind_motion(m);
  nb::set_leak_warnings(false);  // cached laws live until the interpreter is gone, which is no leak
  m.attr("unlimited_strength") = unlimited_strength;
  m.def("capillary_models", &capillary::model_names);
  m.def("cohesion_laws", &cohesion_names);
  m.def("contact_parameters", [] {
    static const char* const scopes[] = {"global", "type", "pair"};
    nb::list all;
    for (const Parameter& p : contact_parameters) {
      nb::dict row;
      row["name"] = p.name;
      row["camel_case"] = p.camel_case;
      row["liggghts"] = p.liggghts ? p.liggghts : p.camel_case;
      row["unit"] = p.unit;
      row["low"] = p.low;
      row["low_open"] = p.above_low;
      row["high"] = p.high;
      row["infinite"] = p.infinite;
      row["default"] = p.otherwise;
      row["scope"] = scopes[static_cast<int>(p.scope)];
      row["range"] = range_text(p);
      row["doc"] = p.doc;
      all.append(row);
    }
    return all;
  });
  m.def("contact_choices", [] {
    nb::list all;
    ContactOptions options;
    each_choice(options, [&](const char* name, const char* camel, auto&, const auto& values, const char* doc) {
      nb::dict row;
      row["name"] = name;
      row["camel_case"] = camel;
      row["values"] = values;
      row["doc"] = doc;
      all.append(row);
    });
    return all;
  });
  m.def("refuse_switched_off", [](const std::string& normal_law, const std::string& cohesion, const nb::dict& numbers_and_words) {
    Given given(numbers_and_words);
    given.options.normal_law = option_of<NormalLaw>("normal law", normal_law_names(), normal_law);
    given.options.cohesion = option_of<CohesionLaw>("cohesion", cohesion_names(), cohesion);
    refuse_switched_off(given.options, given);
  });
  m.def("wrong_bridge_volume", &wrong_bridge_volume);
  m.def("jkr_contact_radius", &jkr_contact_radius);
  m.def("jkr_force", &jkr_force);
  m.def("jkr_rupture_distance", &jkr_rupture_distance);
  m.def("jkr_loss", &jkr_loss);

  nb::class_<capillary::BridgeLaw>(m, "BridgeForce")
      .def(
          "__init__",
          [](capillary::BridgeLaw* self, const std::string& model, double contact_angle) {
            new (self) capillary::BridgeLaw(bridge_law(model, contact_angle));
          },
          "model"_a, "contact_angle"_a)
      .def("force",
           [](capillary::BridgeLaw& self, Array radius_1, Array radius_2, Array gap, Array volume, Array surface_tension) {
             return filled(gap.shape(0), [&](std::size_t i) {
               complete_for(self, radius_1(i), radius_2(i));
               return self.force(radius_1(i), radius_2(i), gap(i), volume(i), surface_tension(i));
             });
           })
      .def("rupture_distance", [](capillary::BridgeLaw& self, Array radius_1, Array radius_2, Array volume) {
        return filled(volume.shape(0), [&](std::size_t i) {
          complete_for(self, radius_1(i), radius_2(i));
          return self.rupture_distance(radius_1(i), radius_2(i), volume(i));
        });
      });

  m.def("viscous_resistance", [](Array radius, Array gap, Array volume, Array viscosity, Array minimum_gap) {
    const std::size_t n = radius.shape(0);
    double *normal, *tangential;
    Result normals = make_result(n, normal), tangentials = make_result(n, tangential);
    for (std::size_t i = 0; i < n; ++i) {
      const auto r = capillary::viscous_resistance(capillary::ViscousLiquid{viscosity(i), minimum_gap(i)}, radius(i), gap(i), volume(i));
      normal[i] = r.normal;
      tangential[i] = r.tangential;
    }
    return nb::make_tuple(normals, tangentials);
  });

  m.def("effective_youngs_modulus", &effective_youngs_modulus);
  m.def("effective_shear_modulus", &effective_shear_modulus);

  nb::class_<Friction>(m, "Friction")
      .def("__init__",
           [](Friction* self, const nb::dict& numbers_and_words) {
             const Given given(numbers_and_words);
             new (self) Friction(read_friction(given.options, given));
           })
      .def("friction_coefficient", [](const Friction& law, double slip) { return friction_coefficient(law, slip); })
      .def("shear_limit",
           [](const Friction& law, double mu, double normal_force, double area) { return shear_limit(law, mu, normal_force, area); })
      .def("drive",
           [](const Friction& law, Array normal_force, Array stiffness, Array area, Points path, Array time_step, const nb::tuple& plane) {
             const std::size_t n = path.shape(0);
             double* force = new double[3 * n];
             Vectors forces(force, {n, 3}, nb::capsule(force, [](void* p) noexcept { delete[] static_cast<double*>(p); }));
             double *slip, *dissipated;
             Result slips = make_result(n, slip), energies = make_result(n, dissipated);
             FrictionState<double> state;
             SlipRings rings;
             const Vec3<double> normal = vector(plane);
             Vec3<double> last{};
             for (std::size_t i = 0; i < n; ++i) {
               const Vec3<double> here{path(i, 0), path(i, 1), path(i, 2)};
               const double dt = time_step(i);
               const NormalResponse<double> response{normal_force(i), stiffness(i), 0.0, area(i), 0.0, normal_force(i)};
               const Vec3<double> t = contact_friction(law, normal, 0.0, response, (here - last) * (1.0 / dt), dt, state, &rings);
               last = here;
               force[3 * i] = -t.x;
               force[3 * i + 1] = -t.y;
               force[3 * i + 2] = -t.z;
               slip[i] = state.slip;
               dissipated[i] = state.dissipated_energy;
             }
             return nb::make_tuple(forces, slips, energies);
           });

  nb::class_<RollingResistance>(m, "RollingResistance")
      .def("__init__", [](RollingResistance* self, const std::string& model, double friction, double damping_ratio) {
        const RollingResistance law{option_of<RollingModel>("rolling resistance", rolling_names(), model), friction, damping_ratio};
        new (self) RollingResistance(law);
      });

  nb::class_<Contact>(m, "Contact")
      .def("__init__",
           [](Contact* self, const std::string& normal_law, double youngs, double shear, double restitution, double characteristic_velocity,
              bool tangential_damping, bool limit_force, const Friction& friction, const RollingResistance& rolling,
              const std::string& cohesion, double cohesive_force, double work_of_adhesion, const std::string& capillary_model,
              double contact_angle, double surface_tension, double bridge_volume, double viscosity, double minimum_gap) {
             new (self) Contact{{option_of<NormalLaw>("normal law", normal_law_names(), normal_law),
                                 {youngs, shear, restitution},
                                 characteristic_velocity,
                                 tangential_damping,
                                 limit_force,
                                 friction,
                                 {},
                                 rolling}};
             const auto law = option_of<CohesionLaw>("cohesion", cohesion_names(), cohesion);
             self->parameters.cohesion = {law, {}, cohesive_force, work_of_adhesion};
             if (law != CohesionLaw::bridge) return;
             self->bridge = std::make_shared<capillary::BridgeLaw>(bridge_law(capillary_model, contact_angle));
             self->parameters.cohesion.liquid = {self->bridge.get(), surface_tension, bridge_volume, {viscosity, minimum_gap}};
           })
      .def("step",
           [](Contact& self, const nb::tuple& separation, const nb::tuple& v1, const nb::tuple& v2, const nb::tuple& w1,
              const nb::tuple& w2, double radius_1, double radius_2, double mass_1, double mass_2, double dt, bool update) {
             ContactBodies b{vector(separation), vector(v1), vector(v2), vector(w1), vector(w2), radius_1, radius_2, mass_1, mass_2, {}};
             // The velocity of a wall is that of its surface, with what its spin has in it.
             if (std::isinf(radius_2)) std::swap(b.angular_velocity_2, b.wall_spin);
             if (self.bridge) complete_for(*self.bridge, radius_1, radius_2);
             const ContactState before = self.state;
             const ContactForce f = contact_step(self.parameters, b, dt, self.state, update);
             // A comparison with what is no number is false: such a contact would end without a word.
             if (!std::isfinite(f.overlap + f.force.x + f.force.y + f.force.z)) {
               self.state = before;
               throw std::invalid_argument(
                   "the contact has no finite force: positions, velocities, radii, masses and the time step must be finite numbers");
             }
             return nb::make_tuple(tuple(f.force), tuple(f.torque_1), tuple(f.torque_2), f.overlap, f.normal_force, f.cohesive_force,
                                   tuple(f.tangential), f.viscous_normal, tuple(f.viscous_tangential), f.interacting, tuple(f.rolling));
           })
      .def_prop_ro("slip", [](const Contact& self) { return self.state.friction.slip; })
      .def_prop_ro("dissipated_energy", [](const Contact& self) { return self.state.friction.dissipated_energy; })
      .def_prop_ro("rolling_angle", [](const Contact& self) { return tuple(self.state.rolling_angle); })
      .def_prop_ro("bridge_volume", [](const Contact& self) { return self.state.cohesion.bridge_volume; });
}
