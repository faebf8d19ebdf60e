#include "dumps_lines.hpp"

#include <algorithm>
#include <cstring>
#include <thread>

#include "dumps_numbers.hpp"

namespace dembark::dumps {

namespace {

constexpr char header[] = "ITEM:";
constexpr std::ptrdiff_t header_length = 5;
// Fewer bytes than this are not worth a thread.
constexpr std::size_t least_part = 1 << 17;

bool begins_header(const char* p, const char* end) {
  return *p == 'I' && end - p >= header_length && std::memcmp(p, header, std::size_t(header_length)) == 0;
}

const char* line_end(const char* p, const char* end) {
  return p == end ? nullptr : static_cast<const char*>(std::memchr(p, '\n', std::size_t(end - p)));
}

std::size_t count_lines(const char* p, const char* end) {
  constexpr std::ptrdiff_t lanes = 32;
  std::size_t total = 0;
  while (end - p >= lanes) {
    // A lane is one byte: it holds 255 at most.
    unsigned char counts[lanes] = {};
    for (std::ptrdiff_t round = std::min<std::ptrdiff_t>((end - p) / lanes, 255); round > 0; --round, p += lanes)
      for (std::ptrdiff_t lane = 0; lane < lanes; ++lane) counts[lane] = static_cast<unsigned char>(counts[lane] + (p[lane] == '\n'));
    for (const unsigned char count : counts) total += count;
  }
  return total + std::size_t(std::count(p, end, '\n'));
}

void skip_blanks(const char*& p) {
  while (*p == ' ' || *p == '\t' || *p == '\r') ++p;
}

Fault parse_line(const char*& p, const char* end, const std::vector<int>& place, double* row, std::size_t& column) {
  if (begins_header(p, end)) return Fault::header;
  for (column = 0; column < place.size(); ++column) {
    skip_blanks(p);
    if (*p == '\n') return Fault::few;
    if (place[column] < 0) {
      while (!ends_word(*p)) ++p;
      continue;
    }
    const Word word = read_number(p, end, row[place[column]]);
    if (word != Word::number) return word == Word::no_number ? Fault::word : Fault::not_finite;
  }
  skip_blanks(p);
  if (*p != '\n') return Fault::many;
  ++p;
  return Fault::none;
}

// [begin, end) consists of complete lines.
Rows parse_part(const char* begin, const char* end, std::size_t lines, const std::vector<int>& place, std::size_t width, double* values) {
  Rows read{begin, 0, Fault::none, 0};
  for (; read.rows < lines && read.position < end; ++read.rows) {
    const char* p = read.position;
    read.fault = parse_line(p, end, place, values + read.rows * width, read.column);
    if (read.fault != Fault::none) break;
    read.position = p;
  }
  return read;
}

template <class Work>
void for_each_part(std::size_t parts, const Work& work) {
  std::vector<std::thread> helpers;
  for (std::size_t part = 1; part < parts; ++part) helpers.emplace_back(work, part);
  work(0);
  for (std::thread& helper : helpers) helper.join();
}

}  // namespace

Rows skip_lines(const char* begin, const char* end, std::size_t lines) {
  Rows read{begin, 0, Fault::none, 0};
  while (read.rows < lines && read.position < end) {
    if (begins_header(read.position, end)) {
      read.fault = Fault::header;
      break;
    }
    const char* stop = line_end(read.position, end);
    if (stop == nullptr) break;
    read.position = stop + 1;
    ++read.rows;
  }
  return read;
}

Rows parse_lines(const char* begin, const char* end, std::size_t lines, const std::vector<int>& place, std::size_t width, double* values,
                 std::size_t threads) {
  while (end > begin && end[-1] != '\n') --end;
  const std::size_t parts = std::clamp<std::size_t>(std::size_t(end - begin) / least_part, 1, std::max<std::size_t>(threads, 1));
  std::vector<const char*> cuts(parts + 1, end);
  cuts[0] = begin;
  for (std::size_t part = 1; part < parts; ++part) {
    const char* stop = line_end(std::max(cuts[part - 1], begin + part * (std::size_t(end - begin) / parts)), end);
    cuts[part] = stop == nullptr ? end : stop + 1;
  }
  std::vector<std::size_t> rows(parts, 0);
  // Counting is some ten times faster than parsing, and what lies in the last part need not be known.
  for (std::size_t part = 0; part + 1 < parts; ++part) rows[part + 1] = rows[part] + count_lines(cuts[part], cuts[part + 1]);
  std::vector<Rows> read(parts);
  for_each_part(parts, [&](std::size_t part) {
    const std::size_t first = std::min(rows[part], lines);
    read[part] = parse_part(cuts[part], cuts[part + 1], lines - first, place, width, values + first * width);
  });
  Rows total{begin, 0, Fault::none, 0};
  for (const Rows& part : read) {
    if (part.rows > 0) total.position = part.position;
    total.rows += part.rows;
    total.fault = part.fault;
    total.column = part.column;
    if (part.fault != Fault::none || total.rows == lines) break;
  }
  return total;
}

}  // namespace dembark::dumps
