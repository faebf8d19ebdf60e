// dembark._physics.ImpactScene: impact::Scene as Python sees it. Private; dembark.physics.impact adds checks, shapes, units and
// documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <vector>

#include "dembark/impact/scene.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark;
using namespace dembark::impact;

namespace {

using Array = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

nb::object numpy(const std::vector<double>& values, std::initializer_list<std::size_t> shape) {
  double* data = new double[values.size() + 1];
  std::copy(values.begin(), values.end(), data);
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, double>(data, shape.size(), shape.begin(), owner));
}

Vec3<double> vector(const Table& t, std::size_t row, std::size_t at) { return {t(row, at), t(row, at + 1), t(row, at + 2)}; }
void append(std::vector<double>& out, const Vec3<double>& v) { out.insert(out.end(), {v.x, v.y, v.z}); }

/// bodies, a row each: mass, inertia, radius, material, then position, velocity, spin, force, torque.
std::vector<Body> bodies_of(const Table& t) {
  std::vector<Body> bodies(t.shape(0));
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Body& b = bodies[i];
    b.id = std::int64_t(i);
    b.mass = t(i, 0), b.inertia = t(i, 1), b.radius = t(i, 2), b.material = int(t(i, 3));
    b.position = vector(t, i, 4), b.velocity = vector(t, i, 7), b.spin = vector(t, i, 10);
    b.force = vector(t, i, 13), b.torque = vector(t, i, 16);
  }
  return bodies;
}

/// materials: stiffness, damping; pairs: n x n laws and n x n rows of tangential ratio, contact damping, contact area.
Settings settings_of(double dt, double theta, int sweeps, const std::string& method, const Table& materials, const nb::list& friction,
                     const Table& pairs) {
  Settings s;
  s.dt = dt;
  s.theta = theta;
  s.friction_sweeps = sweeps;
  s.lcp.method = lcp_method(method);
  s.materials.resize(materials.shape(0));
  for (std::size_t i = 0; i < s.materials.size(); ++i) s.materials[i] = {materials(i, 0), materials(i, 1)};
  s.pairs.resize(pairs.shape(0));
  for (std::size_t i = 0; i < s.pairs.size(); ++i) {
    s.pairs[i].friction = nb::cast<const FinnieRabinowicz&>(friction[i]);
    s.pairs[i].tangential_stiffness_ratio = pairs(i, 0);
    s.pairs[i].contact_damping = pairs(i, 1);
    s.pairs[i].contact_area = pairs(i, 2);
  }
  return s;
}

/// What a run stores, a sample each.
struct History {
  std::vector<double> time, position, velocity, spin, report, column;
};

void sample(Scene& scene, const StepReport& r, const std::vector<std::int64_t>& left, const std::vector<std::int64_t>& right, History& h) {
  h.time.push_back(scene.time());
  for (const Body& b : scene.bodies()) append(h.position, b.position);
  for (const auto& v : scene.velocity()) append(h.velocity, v);
  for (const auto& w : scene.spin()) append(h.spin, w);
  const auto values = r.values();
  h.report.insert(h.report.end(), values.begin(), values.end());
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
  nb::class_<Scene>(m, "ImpactScene")
      .def("__init__",
           [](Scene* self, double dt, double theta, int sweeps, const std::string& method, Table materials, nb::list friction, Table pairs,
              Table bodies, Table planes, Table drums, double reach, bool row) {
             Scene* scene = new (self) Scene(settings_of(dt, theta, sweeps, method, materials, friction, pairs), bodies_of(bodies));
             scene->reach = reach;
             scene->row = row;
             for (std::size_t i = 0; i < planes.shape(0); ++i) {
               Plane p;
               p.id = wall_key(std::int64_t(planes(i, 0)));
               p.material = int(planes(i, 1));
               p.stiffness = planes(i, 2);
               p.point = vector(planes, i, 3), p.normal = vector(planes, i, 6), p.velocity = vector(planes, i, 9);
               scene->planes.push_back(p);
             }
             for (std::size_t i = 0; i < drums.shape(0); ++i) {
               Drum d;
               d.id = wall_key(std::int64_t(drums(i, 0)));
               d.material = int(drums(i, 1));
               d.stiffness = drums(i, 2);
               d.point = vector(drums, i, 3), d.axis = vector(drums, i, 6);
               d.radius = drums(i, 9), d.omega = drums(i, 10);
               scene->drums.push_back(d);
             }
           })
      // Samples the begin, every `every`-th step and the end; `left`, `right`: keys of the contacts whose normal force is a column.
      .def("run",
           [](Scene& scene, std::int64_t steps, std::int64_t every, const std::vector<std::int64_t>& left,
              const std::vector<std::int64_t>& right) {
             History h;
             std::vector<double> impacts;
             for (std::int64_t i = 0; i <= steps; ++i) {
               const StepReport& r = scene.forces();
               for (const Impact& f : scene.system().take_finished()) {
                 impacts.insert(impacts.end(), {double(f.a), double(shown_id(f.b)), f.time, f.duration, f.peak_force, f.impulse,
                                                f.relative_speed, f.dissipated});
                 append(impacts, f.point);
               }
               if (i % every == 0 || i == steps) sample(scene, r, left, right, h);
               if (i < steps) scene.advance();
               if (i % 4096 == 4095 && PyErr_CheckSignals() != 0) throw nb::python_error();
             }
             const std::size_t samples = h.time.size(), n = scene.bodies().size();
             return nb::make_tuple(numpy(h.time, {samples}), numpy(h.position, {samples, n, 3}), numpy(h.velocity, {samples, n, 3}),
                                   numpy(h.spin, {samples, n, 3}), numpy(h.report, {samples, 14}), numpy(h.column, {samples, left.size()}),
                                   numpy(impacts, {impacts.size() / 11, 11}));
           })
      // Rows: a, b, gap, N, D, tangential, normal, point.
      .def("contacts",
           [](const Scene& scene) {
             std::vector<double> out;
             const auto& contacts = scene.system().contacts();
             for (const ContactResult& c : contacts) {
               out.insert(out.end(), {double(c.key_a), double(shown_id(c.key_b)), c.gap, c.normal_force, c.deformed_gap});
               append(out, c.tangential);
               append(out, c.normal);
               append(out, c.point);
             }
             return numpy(out, {contacts.size(), 14});
           })
      .def("kinetic_energy_of_half_step", &Scene::kinetic_energy_of_half_step)
      .def("time", &Scene::time)
      .def("state",
           [](const Scene& scene) {
             const std::vector<double> s = scene.state();
             return numpy(s, {s.size()});
           })
      .def("restore", [](Scene& scene, Array state) { scene.restore(std::vector<double>(state.data(), state.data() + state.shape(0))); });
}
