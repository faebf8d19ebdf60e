// Lines of numbers to rows of a table.
#pragma once

#include <cstddef>
#include <vector>

namespace dembark::dumps {

// What is wrong with a row; `header` is a line that begins the next frame.
enum class Fault { none, few, many, word, not_finite, header };

struct Rows {
  const char* position;  // behind the last row that was read
  std::size_t rows;      // that were read
  Fault fault;           // of the row after them
  std::size_t column;    // where it is, from 0
};

// How far `lines` complete lines reach from `begin`, none of them beginning a frame.
Rows skip_lines(const char* begin, const char* end, std::size_t lines);

// At most `lines` complete lines as rows of `width` numbers from `values` on. Column c of the text goes to place[c], or nowhere when that
// is negative. The result does not depend on the number of threads.
Rows parse_lines(const char* begin, const char* end, std::size_t lines, const std::vector<int>& place, std::size_t width, double* values,
                 std::size_t threads);

}  // namespace dembark::dumps
