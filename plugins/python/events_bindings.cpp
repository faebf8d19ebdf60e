// dembark._physics.EventSolver: events::Solver as Python sees it. Private; dembark.physics.events adds checks, shapes, units and
// documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "dembark/events/solver.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark;
using namespace dembark::python;
using namespace dembark::events;

namespace {

using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

std::vector<Vector> vectors(const Points& points) {
  std::vector<Vector> list(points.shape(0));
  for (std::size_t i = 0; i < list.size(); ++i) list[i] = {points(i, 0), points(i, 1), points(i, 2)};
  return list;
}

CollisionLaw law(const std::array<double, 5>& n) { return {n[0], n[1], n[2], n[3], n[4]}; }

}  // namespace

void bind_events(nb::module_& m) {
  nb::class_<Solver>(m, "EventSolver")
      // Rows of grains: mass, radius, position, velocity, spin; of walls: point, normal, law, in the order of their motions.
      .def(
          "__init__",
          [](Solver* self, Table grains, int dimension, double shape, const std::array<double, 5>& between, const std::array<double, 3>& g,
             double contact_duration, const std::array<double, 6>& periods, Table walls,
             const std::vector<const PrescribedMotion*>& motions) {
            Settings s{dimension, shape, law(between), {g[0], g[1], g[2]}, contact_duration, {}, {}};
            for (std::size_t a = 0; a < 3; ++a) s.periods[a] = {periods[2 * a], periods[2 * a + 1]};
            for (std::size_t k = 0; k < walls.shape(0); ++k) {
              Wall wall;
              wall.point = {walls(k, 0), walls(k, 1), walls(k, 2)};
              wall.normal = {walls(k, 3), walls(k, 4), walls(k, 5)};
              wall.law = {walls(k, 6), walls(k, 7), walls(k, 8), walls(k, 9), walls(k, 10)};
              wall.motion = *motions.at(k);
              s.walls.push_back(wall);
            }
            std::vector<Grain> list(grains.shape(0));
            Archive in(std::vector<double>(grains.data(), grains.data() + grains.size()));
            for (Grain& each : list) in(each);
            in.end();
            new (self) Solver(s, list);
          },
          "grains"_a, "dimension"_a, "shape"_a, "law"_a, "gravity"_a, "contact_duration"_a, "periods"_a, "walls"_a, "motions"_a)
      .def(
          "run",
          [](Solver& self, double until) {
            for (bool done = false; !done;) {
              {
                const nb::gil_scoped_release others;
                done = self.run(until, 100000);
              }
              if (PyErr_CheckSignals() != 0) throw nb::python_error();
            }
          },
          "until"_a)
      .def("grains",
           [](const Solver& self) {
             std::vector<double> rows;
             for (int i = 0; i < self.size(); ++i) {
               const std::vector<double> row = to_numbers(self.grain(i));
               rows.insert(rows.end(), row.begin(), row.end());
             }
             return numpy(rows, {std::size_t(self.size()), 11});
           })
      .def("energies", &Solver::energies)
      // collisions, elastic, crossings, repeats, losses, virial in rows; then of each wall collisions, work and impulse.
      .def("account",
           [](const Solver& self) {
             Account a = self.account();
             const std::vector<WallAccount> walls = std::move(a.walls);
             a.walls.clear();
             std::vector<double> sums = to_numbers(a);
             sums.pop_back();  // the number of walls
             for (const WallAccount& wall : walls)
               for (const double number : to_numbers(wall)) sums.push_back(number);
             return numpy(sums, {sums.size()});
           })
      .def(
          "set_velocities", [](Solver& self, Points velocities, Points spins) { self.set_velocities(vectors(velocities), vectors(spins)); },
          "velocities"_a, "spins"_a)
      .def("state",
           [](const Solver& self) {
             const std::vector<double> numbers = self.state();
             return numpy(numbers, {numbers.size()});
           })
      .def(
          "restore", [](Solver& self, Array state) { self.restore(std::vector<double>(state.data(), state.data() + state.size())); },
          "state"_a)
      .def_prop_ro("overlap", &Solver::overlap)
      .def_prop_ro("time", &Solver::time);
}
