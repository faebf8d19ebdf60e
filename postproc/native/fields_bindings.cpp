// dembark._fields: the compiled part of coarse graining. Private; dembark.postproc.fields.deposit adds checks, units and documentation.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>

#include "fields_deposit.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark::fields;

namespace {

using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Pairs = nb::ndarray<const std::int64_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<const bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Field = nb::ndarray<double, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

void require(bool fits) {
  if (!fits) throw std::invalid_argument("arrays whose shapes do not belong together");
}

const double* maybe(const std::optional<Vector>& values, std::size_t count) {
  if (!values) return nullptr;
  require(values->shape(0) == count);
  return values->data();
}

// Where and how lines are spread: the grid, the kernel and the box. Fields are (nx, ny, columns, nz).
class Target {
 public:
  Target(Vector low, Vector high, Vector shape, Rows edges, Vector periodic, Vector box_periodic, int kind, double width, double reach,
         bool closed, Vector cell_place, Vector cell_weight, int threads)
      : threads_(threads) {
    require(low.shape(0) == 3 && high.shape(0) == 3 && shape.shape(0) == 3 && edges.shape(0) == 3 && edges.shape(1) == 3 &&
            periodic.shape(0) == 3 && box_periodic.shape(0) == 3 && cell_place.shape(0) == cell_weight.shape(0) &&
            cell_place.shape(0) <= max_cell_nodes && kind >= 0 && kind <= 2);
    double total = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      cells_.low[axis] = low.data()[axis];
      cells_.high[axis] = high.data()[axis];
      cells_.shape[axis] = int(shape.data()[axis]);
      cells_.spacing[axis] = (cells_.high[axis] - cells_.low[axis]) / cells_.shape[axis];
      cells_.per_metre[axis] = 1.0 / cells_.spacing[axis];
      cells_.periodic[axis] = periodic.data()[axis] != 0.0;
      box_.periodic[axis] = box_periodic.data()[axis] != 0.0;
      for (int other = 0; other < 3; ++other) box_.edge[axis][other] = edges.data()[3 * axis + other];
      total *= cells_.shape[axis];
    }
    if (total >= std::numeric_limits<std::int32_t>::max()) throw std::invalid_argument("more than 2^31 cells");
    kernel_.kind = static_cast<KernelKind>(kind);
    kernel_.width = width;
    kernel_.reach = reach;
    kernel_.closed = closed;
    kernel_.cell_nodes = int(cell_place.shape(0));
    for (int n = 0; n < kernel_.cell_nodes; ++n) {
      kernel_.cell_place[n] = cell_place.data()[n];
      kernel_.cell_weight[n] = cell_weight.data()[n];
    }
  }

  void grains(Rows places, Vector masses, Vector radii, Rows velocities, Rows peculiar, Vector touches, std::optional<Vector> liquid,
              Vector middle, Field out) const {
    const std::size_t n = places.shape(0);
    require(masses.shape(0) == n && radii.shape(0) == n && velocities.shape(0) == n && velocities.shape(1) == 3 &&
            peculiar.shape(0) == n && peculiar.shape(1) == 3 && touches.shape(0) == n && middle.shape(0) == 3);
    require(places.shape(1) == 3);
    const GrainSource source{std::int64_t(n),  places.data(),    masses.data(),  radii.data(),
                             velocities.data(), peculiar.data(), touches.data(), maybe(liquid, n),
                             {middle.data()[0], middle.data()[1], middle.data()[2]}};
    add(one_node(), source, out);
  }

  void contacts(Rows first, Rows branch, Rows forces, Pairs pairs, Flags touching, Vector radii, Rows velocities,
                std::optional<Rows> omegas, std::optional<Vector> liquid, std::optional<Vector> power, Vector place, Vector weight,
                Field out) const {
    const std::size_t m = first.shape(0), n = radii.shape(0);
    require(first.shape(1) == 3 && branch.shape(0) == m && branch.shape(1) == 3 && forces.shape(0) == m && forces.shape(1) == 3 &&
            pairs.shape(0) == m && pairs.shape(1) == 2 && touching.shape(0) == m && velocities.shape(0) == n &&
            velocities.shape(1) == 3 && n < (std::size_t(1) << 31) && (!omegas || (omegas->shape(0) == n && omegas->shape(1) == 3)));
    Buffer<Motion> motions;
    if (omegas) motions = motions_of(std::int64_t(n), radii.data(), velocities.data(), omegas->data(), std::max(1, threads_));
    const ContactSource source{std::int64_t(m), first.data(), branch.data(), forces.data(), pairs.data(), touching.data(),
                               motions.get(), maybe(liquid, m), maybe(power, m)};
    add(nodes_of(place, weight), source, out);
  }

  void lines(Rows first, Rows branch, Rows values, Vector place, Vector weight, Field out) const {
    const std::size_t m = first.shape(0);
    require(first.shape(1) == 3 && branch.shape(0) == m && branch.shape(1) == 3 && values.shape(0) == m);
    add(nodes_of(place, weight), PlainSource{std::int64_t(m), first.data(), branch.data(), int(values.shape(1)), values.data()}, out);
  }

 private:
  static Nodes one_node() {
    static const double place = 0.0, weight = 1.0;
    return {1, &place, &weight};
  }

  static Nodes nodes_of(const Vector& place, const Vector& weight) {
    require(place.shape(0) == weight.shape(0));
    return {int(place.shape(0)), place.data(), weight.data()};
  }

  template <class Source>
  void add(const Nodes& nodes, const Source& source, Field& out) const {
    require(int(out.shape(0)) == cells_.shape[0] && int(out.shape(1)) == cells_.shape[1] && int(out.shape(2)) == source.columns &&
            int(out.shape(3)) == cells_.shape[2] && source.count < (std::int64_t(1) << 31));
    nb::gil_scoped_release release;
    deposit(cells_, box_, kernel_, nodes, source, threads_, out.data());
  }

  Cells cells_{};
  Box box_{};
  Kernel kernel_{};
  int threads_;
};

}  // namespace

NB_MODULE(_fields, module) {
  module.doc() = "Grains and contacts on a grid.";
  module.def("instruction_set", &instruction_set);
  nb::class_<Target>(module, "Target")
      .def(nb::init<Vector, Vector, Vector, Rows, Vector, Vector, int, double, double, bool, Vector, Vector, int>(), "low"_a, "high"_a,
           "shape"_a, "edges"_a, "periodic"_a, "box_periodic"_a, "kind"_a, "width"_a, "reach"_a, "closed"_a, "cell_place"_a,
           "cell_weight"_a, "threads"_a)
      .def("grains", &Target::grains, "places"_a, "masses"_a, "radii"_a, "velocities"_a, "peculiar"_a, "touches"_a, "liquid"_a.none(),
           "middle"_a, "out"_a)
      .def("contacts", &Target::contacts, "first"_a, "branch"_a, "forces"_a, "pairs"_a, "touching"_a, "radii"_a, "velocities"_a,
           "omegas"_a.none(), "liquid"_a.none(), "power"_a.none(), "place"_a, "weight"_a, "out"_a)
      .def("lines", &Target::lines, "first"_a, "branch"_a, "values"_a, "place"_a, "weight"_a, "out"_a);
}
