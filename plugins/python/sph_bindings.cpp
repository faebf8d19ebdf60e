// dembark._physics.SphSolver: sph::Solver as Python sees it. Private; dembark.physics.sph adds checks, shapes, units and documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "dembark/sph/best_loops.hpp"
#include "dembark/sph/solver.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark;
using namespace dembark::sph;

namespace {

using Array = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Column = nb::ndarray<nb::numpy, double, nb::ndim<1>>;
using Rows3 = nb::ndarray<nb::numpy, double, nb::shape<-1, 3>>;
typedef std::array<double, 3> Three;

int option(const std::string& what, const std::vector<std::string>& names, const std::string& word) {
  int found = 0;
  if (option_from_name(names, word, found)) return found;
  throw std::invalid_argument(what + " must be " + names_text(names) + ", not '" + word + "'");
}

Vector vector(const Three& v) { return {v[0], v[1], v[2]}; }
Three three(const Vector& v) { return {v.x, v.y, v.z}; }

std::vector<Vector> vectors(const Points& points) {
  std::vector<Vector> list(points.shape(0));
  for (std::size_t i = 0; i < list.size(); ++i) list[i] = {points(i, 0), points(i, 1), points(i, 2)};
  return list;
}

/// value(i) at the place at(i), for i = 0 ... n - 1.
template <class At, class Value>
Column column(std::size_t n, At at, Value value) {
  auto* data = new double[n + 1];
  for (std::size_t i = 0; i < n; ++i) data[at(i)] = value(i);
  return Column(data, {n}, nb::capsule(data, [](void* p) noexcept { delete[] static_cast<double*>(p); }));
}
template <class At, class Value>
Rows3 rows(std::size_t n, At at, Value value) {
  auto* data = new double[3 * n + 1];
  for (std::size_t i = 0; i < n; ++i) {
    const Vector v = value(i);
    double* const row = data + 3 * at(i);
    row[0] = v.x, row[1] = v.y, row[2] = v.z;
  }
  return Rows3(data, {n, 3}, nb::capsule(data, [](void* p) noexcept { delete[] static_cast<double*>(p); }));
}

template <class Kernel>
nb::tuple kernel_table(const Kernel& kernel, const Array& r) {
  const auto same = [](std::size_t i) { return i; };
  return nb::make_tuple(column(r.shape(0), same, [&](std::size_t i) { return kernel.value(r(i)); }),
                        column(r.shape(0), same, [&](std::size_t i) { return kernel.slope(r(i)); }));
}

}  // namespace

void bind_sph(nb::module_& m) {
  m.def("sph_kernels", &kernel_names);
  m.def("sph_boundaries", &boundary_names);
  m.def("sph_moments", &moment_names);
  // W and W'(r)/r.
  m.def(
      "sph_kernel",
      [](const std::string& name, int dimension, double h, Array r) {
        return option("kernel", kernel_names(), name) == 0 ? kernel_table(WendlandC2(dimension, h), r)
                                                           : kernel_table(CubicSpline(dimension, h), r);
      },
      "name"_a, "dimension"_a, "h"_a, "distance"_a);
  // p or rho.
  m.def(
      "sph_tait",
      [](double density, double sound_speed, double gamma, bool tension, bool inverse, Array values) {
        const Tait state{density, sound_speed, gamma, tension};
        if (const char* const wrong = state.error()) throw std::invalid_argument(wrong);
        return column(
            values.shape(0), [](std::size_t i) { return i; },
            [&](std::size_t i) { return inverse ? initial_density(state, values(i)) : state.pressure(values(i)); });
      },
      "density"_a, "sound_speed"_a, "gamma"_a, "tension"_a, "inverse"_a, "values"_a);

  nb::class_<Solver>(m, "SphSolver")
      .def(
          "__init__",
          [](Solver* self, Points positions, Array densities, Points velocities, int dimension, double spacing, double smoothing,
             const std::string& kernel, double density, double sound_speed, double gamma, bool tension, double alpha, double delta,
             const Three& gravity, const std::string& boundary, bool no_slip, double shifting, double contact_stiffness,
             int contact_exponent, double skin, int threads, double slit_pressure, double xsph, int shepard, const std::string& moment,
             const std::string& instruction_set) {
            const Settings settings{dimension,
                                    spacing,
                                    smoothing,
                                    {density, sound_speed, gamma, tension},
                                    alpha,
                                    delta,
                                    vector(gravity),
                                    KernelName(option("kernel", kernel_names(), kernel)),
                                    Boundary(option("boundary", boundary_names(), boundary)),
                                    no_slip,
                                    {shifting},
                                    {contact_stiffness, contact_exponent},
                                    skin,
                                    threads,
                                    slit_pressure,
                                    {xsph},
                                    shepard,
                                    Moment(option("moment", moment_names(), moment))};
            new (self) Solver(settings, vectors(positions), std::vector<double>(densities.data(), densities.data() + densities.size()),
                              vectors(velocities), instruction_set == "best" ? best_loops() : portable_loops());
          },
          "positions"_a, "densities"_a, "velocities"_a, "dimension"_a, "spacing"_a, "smoothing"_a, "kernel"_a, "density"_a, "sound_speed"_a,
          "gamma"_a, "tension"_a, "alpha"_a, "delta"_a, "gravity"_a, "boundary"_a, "no_slip"_a, "shifting"_a, "contact_stiffness"_a,
          "contact_exponent"_a, "skin"_a, "threads"_a, "slit_pressure"_a, "xsph"_a, "shepard"_a, "moment"_a, "instruction_set"_a)
      .def(
          "add",
          [](Solver& self, Points points, bool free, double mass, const Three& inertia, const Three& position) {
            Body b;
            b.free = free;
            b.mass = mass;
            b.inertia = vector(inertia);
            b.position = vector(position);
            return self.add(b, vectors(points));
          },
          "points"_a, "free"_a, "mass"_a, "inertia"_a, "position"_a)
      .def(
          "add_box",
          [](Solver& self, int number, const Three& edges, const std::array<int, 3>& count) { self.add_box(number, vector(edges), count); },
          "number"_a, "edges"_a, "count"_a)
      .def(
          "add_plane", [](Solver& self, const Three& point, const Three& normal) { self.add_plane(vector(point), vector(normal)); },
          "point"_a, "normal"_a)
      .def(
          "run",
          [](Solver& self, long steps, double step) {
            for (long k = 0; k < steps; ++k) {
              {
                const nb::gil_scoped_release others;
                self.step(step);
              }
              if (PyErr_CheckSignals() != 0) throw nb::python_error();
            }
          },
          "steps"_a, "step"_a)
      .def("prepare", &Solver::prepare)
      .def_prop_ro("time", &Solver::time)
      .def_prop_ro("steps", &Solver::steps)
      .def_prop_ro("searches", &Solver::searches)
      .def_prop_ro("smoothing_length", [](const Solver& self) { return self.scene().settings.h(); })
      .def_prop_ro("longest_step", [](const Solver& self) { return self.scene().settings.longest_step(); })
      .def_prop_ro("particle_mass", [](const Solver& self) { return self.scene().settings.mass(); })
      // Positions, velocities, densities and pressures of the fluid, in the order in which it was given.
      .def("fluid",
           [](const Solver& self) {
             const FluidParticles& f = self.scene().fluid;
             const auto at = [&](std::size_t i) { return std::size_t(f.id[i]); };
             const std::size_t n = f.id.size();
             return nb::make_tuple(
                 rows(n, at, [&](std::size_t i) { return f.position[i]; }), rows(n, at, [&](std::size_t i) { return f.velocity[i]; }),
                 column(n, at, [&](std::size_t i) { return f.density[i]; }), column(n, at, [&](std::size_t i) { return f.pressure[i]; }));
           })
      // Positions, pressures and forces of the particles of a wall or body, in the order in which they were given.
      .def(
          "solids",
          [](const Solver& self, int body) {
            std::vector<Vector> positions, forces;
            std::vector<double> pressures;
            const double mass = self.scene().settings.mass();
            for (const Solids& set : self.scene().solids)
              for (int k = 0; k < set.size(); ++k)
                if (set.body[k] == body) {
                  positions.push_back(set.position[k]);
                  pressures.push_back(set.pressure[k]);
                  forces.push_back(mass * Vector{set.sum[k].x, set.sum[k].y, set.sum[k].z});
                }
            const auto at = [](std::size_t i) { return i; };
            return nb::make_tuple(rows(positions.size(), at, [&](std::size_t i) { return positions[i]; }),
                                  column(positions.size(), at, [&](std::size_t i) { return pressures[i]; }),
                                  rows(positions.size(), at, [&](std::size_t i) { return forces[i]; }));
          },
          "body"_a)
      .def(
          "body",
          [](Solver& self, int number) {
            const Body& b = self.body(number);
            const Rotation& q = b.orientation;
            return nb::make_tuple(three(b.position), nb::make_tuple(q.w, q.x, q.y, q.z), three(b.velocity), three(b.spin), three(b.force),
                                  three(b.torque), three(b.acceleration), three(b.spin_acceleration), three(b.load), three(b.load_torque),
                                  three(b.film));
          },
          "number"_a)
      .def(
          "set_motion",
          [](Solver& self, int number, const Three& velocity, const Three& spin, const Three& acceleration,
             const Three& spin_acceleration) {
            Body& b = self.body(number);
            b.velocity = vector(velocity);
            b.spin = vector(spin);
            b.acceleration = vector(acceleration);
            b.spin_acceleration = vector(spin_acceleration);
          },
          "number"_a, "velocity"_a, "spin"_a, "acceleration"_a, "spin_acceleration"_a)
      .def(
          "set_load",
          [](Solver& self, int number, const Three& force, const Three& torque) {
            self.body(number).load = vector(force);
            self.body(number).load_torque = vector(torque);
          },
          "number"_a, "force"_a, "torque"_a)
      .def("energies",
           [](const Solver& self) {
             const Energies e = self.energies();
             return nb::make_tuple(e.kinetic, e.potential, e.compression, e.bodies, e.contact, e.viscous, e.diffusive, e.boundary, e.work);
           })
      .def("state",
           [](Solver& self) {
             const std::vector<double> numbers = self.state();
             return column(numbers.size(), [](std::size_t i) { return i; }, [&](std::size_t i) { return numbers[i]; });
           })
      .def(
          "restore", [](Solver& self, Array state) { self.restore(std::vector<double>(state.data(), state.data() + state.size())); },
          "state"_a);
}
