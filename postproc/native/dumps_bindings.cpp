// dembark._dumps: lines of text dumps, and STL files, as arrays. Private; dembark.postproc adds files, frames and messages.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>

#include "dembark/surface/stl.hpp"
#include "dumps_lines.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace dembark::dumps;

namespace {

using Text = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

const char* chars(const Text& text, std::size_t begin, std::size_t end) {
  if (begin > end || end > text.shape(0)) throw std::out_of_range("begin and end must lie in the text");
  return reinterpret_cast<const char*>(text.data());
}

nb::tuple tuple_of(const Rows& read, const char* start) {
  return nb::make_tuple(std::size_t(read.position - start), read.rows, int(read.fault), read.column);
}

nb::tuple skip(const Text& text, std::size_t begin, std::size_t end, std::size_t lines) {
  const char* start = chars(text, begin, end);
  Rows read;
  {
    nb::gil_scoped_release release;
    read = skip_lines(start + begin, start + end, lines);
  }
  return tuple_of(read, start);
}

nb::tuple parse(const Text& text, std::size_t begin, std::size_t end, const std::vector<int>& place, const Table& values, std::size_t row,
                std::size_t threads) {
  const char* start = chars(text, begin, end);
  const std::size_t width = values.shape(1);
  if (row > values.shape(0)) throw std::out_of_range("row must lie in the table");
  for (const int column : place)
    if (column >= int(width)) throw std::out_of_range("every place must be a column of the table");
  if (threads == 0) threads = std::thread::hardware_concurrency();
  Rows read;
  {
    nb::gil_scoped_release release;
    read = parse_lines(start + begin, start + end, values.shape(0) - row, place, width, values.data() + row * width, threads);
  }
  return tuple_of(read, start);
}

nb::tuple read_stl(const std::string& path, double precision) {
  dembark::StlSurface found;
  {
    nb::gil_scoped_release release;
    found = dembark::read_stl(path, precision);
  }
  const std::size_t count = found.triangles.size();
  auto* const corners = new double[9 * count];
  const nb::capsule owner(corners, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  for (std::size_t k = 0; k < 3 * count; ++k) {
    const dembark::Vec3<double>& n = found.triangles[k / 3].node[k % 3];
    corners[3 * k] = n.x, corners[3 * k + 1] = n.y, corners[3 * k + 2] = n.z;
  }
  return nb::make_tuple(nb::ndarray<nb::numpy, double, nb::ndim<3>>(corners, {count, 3, 3}, owner), found.solid, found.names, found.flat,
                        found.again);
}

}  // namespace

NB_MODULE(_dumps, module) {
  module.doc() = "Lines of text dumps, and STL files, as arrays.";
  module.def("skip", &skip, "text"_a, "begin"_a, "end"_a, "lines"_a,
             "Pass over complete lines; (position, lines, fault, column).");
  module.def("parse", &parse, "text"_a, "begin"_a, "end"_a, "place"_a, "values"_a, "row"_a, "threads"_a = 0,
             "Fill rows of `values` from `row` on; (position, rows, fault, column) with the fault of the row after them, or 0.");
  module.def("read_stl", &read_stl, "path"_a, "precision"_a,
             "Triangles of an STL file: (corners, solid of each, names, left out without area, left out as given again).");
}
