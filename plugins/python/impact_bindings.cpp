// dembark._physics.ImpactScene: impact::Scene as Python sees it. Private; dembark.physics.impact adds checks, shapes, units and
// documentation.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "dembark/impact/scene.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark;
using namespace dembark::python;
using namespace dembark::impact;

namespace {

void append(std::vector<double>& out, const std::vector<double>& more) { out.insert(out.end(), more.begin(), more.end()); }
void append(std::vector<double>& out, const Vec3<double>& v) { out.insert(out.end(), {v.x, v.y, v.z}); }

/// A row each, its fields in their order (archive.hpp).
template <class T>
std::vector<T> rows(const Table& table) {
  std::vector<T> list(table.shape(0));
  Archive in(std::vector<double>(table.data(), table.data() + table.size()));
  for (T& each : list) in(each);
  in.end();
  return list;
}
/// The other way.
template <class T>
Result table(const std::vector<T>& list, std::size_t columns) {
  std::vector<double> out;
  for (const T& each : list) append(out, table_row(each));
  return numpy(out, {list.size(), columns});
}

/// What a run stores, a sample each.
struct History {
  std::vector<double> time, position, velocity, spin, orientation, report, column;
};

void sample(Scene& scene, const StepReport& r, const std::vector<std::int64_t>& left, const std::vector<std::int64_t>& right, History& h) {
  h.time.push_back(scene.time());
  for (const Body& b : scene.bodies()) append(h.position, b.position);
  for (const auto& v : scene.velocity()) append(h.velocity, v);
  for (const auto& w : scene.spin()) append(h.spin, w);
  for (const Attitude& a : scene.attitudes()) append(h.orientation, to_numbers(a.orientation));
  append(h.report, to_numbers(r));
  h.report.push_back(scene.kinetic_energy_of_half_step());
  const auto& contacts = scene.system().contacts();
  for (std::size_t k = 0; k < left.size(); ++k) {
    double force = 0.0;
    for (const ContactResult& c : contacts)
      if (c.key_a == left[k] && c.key_b == right[k]) force = c.normal_force;
    h.column.push_back(force);
  }
}

}  // namespace

void bind_impact(nb::module_& m) {
  // About the axis and across it, a row each.
  m.def("capsule_inertia", [](Array mass, Array radius, Array length) {
    std::vector<double> out;
    for (std::size_t i = 0; i < mass.shape(0); ++i) {
      const CapsuleInertia inertia = capsule_inertia(mass.data()[i], radius.data()[i], length.data()[i]);
      out.insert(out.end(), {inertia.axial, inertia.across});
    }
    return numpy(out, {mass.shape(0), 2});
  });
  nb::class_<Scene>(m, "ImpactScene")
      .def("__init__",
           [](Scene* self, double dt, double theta, int sweeps, const std::string& method, Table materials, Table pairs, Table bodies,
              Table planes, Table drums, double reach, bool row, double period) {
             Settings settings;
             settings.dt = dt;
             settings.theta = theta;
             settings.friction_sweeps = sweeps;
             settings.lcp.method = lcp_method(method);
             settings.materials = rows<Material>(materials);
             settings.pairs = rows<ImpactPairLaw>(pairs);
             // Rows of capsules are longer than those of bodies without a length.
             const bool capsules = bodies.shape(1) > to_numbers(Body()).size();
             Scene* scene = capsules ? new (self) Scene(settings, rows<Capsule>(bodies)) : new (self) Scene(settings, rows<Body>(bodies));
             scene->reach = reach;
             scene->row = row;
             scene->around.pairs.box.periodic[2] = period > 0.0;
             scene->around.pairs.box.length.z = period;
             scene->around.planes = rows<Plane>(planes);
             scene->around.drums = rows<Drum>(drums);
           })
      // Samples the begin, every `every`-th step and the end; `left`, `right`: keys of the contacts whose normal force is a column.
      .def("run",
           [](Scene& scene, std::int64_t steps, std::int64_t every, const std::vector<std::int64_t>& left,
              const std::vector<std::int64_t>& right) {
             History h;
             std::vector<Impact> impacts;
             for (std::int64_t i = 0; i <= steps; ++i) {
               const StepReport& r = scene.forces();
               for (const Impact& ended : scene.system().take_finished()) impacts.push_back(ended);
               if (i % every == 0 || i == steps) sample(scene, r, left, right, h);
               if (i < steps) scene.advance();
               if (i % 4096 == 4095 && PyErr_CheckSignals() != 0) throw nb::python_error();
             }
             const std::size_t samples = h.time.size(), n = scene.bodies().size(), oriented = scene.attitudes().size();
             return nb::make_tuple(numpy(h.time, {samples}), numpy(h.position, {samples, n, 3}), numpy(h.velocity, {samples, n, 3}),
                                   numpy(h.spin, {samples, n, 3}), numpy(h.orientation, {samples, oriented, 4}),
                                   numpy(h.report, {samples, 14}), numpy(h.column, {samples, left.size()}), table(impacts, 17));
           })
      .def("start_error", &Scene::start_error)
      .def("contacts", [](const Scene& scene) { return table(scene.system().contacts(), 14); })
      .def("kinetic_energy_of_half_step", &Scene::kinetic_energy_of_half_step)
      .def("time", &Scene::time)
      .def("state", [](const Scene& scene) { return numpy(scene.state(), {scene.state().size()}); })
      .def("restore", [](Scene& scene, Array state) { scene.restore(std::vector<double>(state.data(), state.data() + state.shape(0))); });
}
