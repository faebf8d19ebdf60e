// dembark._dumps: lines of text dumps as arrays. Private; dembark.postproc.dumps adds files, frames and messages.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <stdexcept>
#include <thread>

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

}  // namespace

NB_MODULE(_dumps, module) {
  module.doc() = "Lines of text dumps as arrays.";
  module.def("skip", &skip, "text"_a, "begin"_a, "end"_a, "lines"_a,
             "Pass over whole lines; (position, lines, fault, column).");
  module.def("parse", &parse, "text"_a, "begin"_a, "end"_a, "place"_a, "values"_a, "row"_a, "threads"_a = 0,
             "Fill rows of `values` from `row` on; (position, rows, fault, column) with the fault of the row after them, or 0.");
}
