// Where the part of an output file ends that was written up to a step: dumps and tables of LIGGGHTS and LAMMPS that are text.
//
// | format | a frame begins with |
// |---|---|
// | dump custom, atom, local, grid | ITEM: UNITS, ITEM: TIME or ITEM: TIMESTEP |
// | dump xyz | the number of atoms, and a line Atoms. Timestep: N |
// | dump yaml | --- and timestep: N |
// | yaml of fix ave/time | the item [N, ...], or the key N: |
// | fix ave/time mode vector, ave/chunk, ave/spatial, ave/histo, ave/correlate | a row N COUNT ..., and COUNT rows follow |
// | fix ave/correlate/long | a comment # Timestep: N |
// | fix ave/time, fix print, own tables | a row N ... |
//
// Readers are strict, for what they take for a step decides what is deleted: steps are integers and grow, frames are complete but the last,
// and where two readers take a file, both have to find the same end.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace dembark::restart {

struct FileEnd {
  bool understood = false, unread = false;
  std::int64_t at = 0;  ///< bytes to keep
};

namespace formats {

inline bool starts(const std::string& text, const char* with) { return text.rfind(with, 0) == 0; }

/// Complete lines of a file; what follows the last line end is no line.
class Lines {
 public:
  explicit Lines(const std::string& path) : file_(path, std::ios::binary) {}

  bool next() {
    begin = end;
    if (!std::getline(file_, line) || file_.eof()) return false;
    end += std::int64_t(line.size()) + 1;
    return true;
  }
  bool failed() const { return !file_.is_open() || file_.bad(); }

  std::string line;
  std::int64_t begin = 0, end = 0;  ///< of the line, in bytes

 private:
  std::ifstream file_;
};

/// Fields between blanks, commas and semicolons.
inline std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> all;
  const char* const gaps = " \t,;\r";
  for (std::size_t at = line.find_first_not_of(gaps); at != std::string::npos;) {
    const std::size_t end = std::min(line.find_first_of(gaps, at), line.size());
    all.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(gaps, end);
  }
  return all;
}

/// The integer >= 0 that a text is, if it is one.
inline std::optional<long long> integer(const std::string& text) {
  if (text.empty() || text.size() > 18 || text.find_first_not_of("0123456789") != std::string::npos) return {};
  return std::strtoll(text.c_str(), nullptr, 10);
}

inline bool is_number(const std::string& text) {
  char* rest = nullptr;
  std::strtod(text.c_str(), &rest);
  return !text.empty() && !*rest;
}

inline bool are_numbers(const std::vector<std::string>& all) {
  for (const std::string& one : all)
    if (!is_number(one)) return false;
  return !all.empty();
}

inline bool is_comment(const std::string& line) {
  const std::size_t at = line.find_first_not_of(" \t\r");
  return at == std::string::npos || line[at] == '#';
}

/// Frames one after the other: where the first behind `step` begins.
class Frames {
 public:
  explicit Frames(long long step) : step_(step) {}

  /// False where the step does not follow the last one. `again`: a step may be there twice.
  bool add(const std::optional<long long>& step, std::int64_t begin, bool again = false) {
    if (!step || *step < last_ || (*step == last_ && !again)) return false;
    last_ = *step;
    begin_ = begin;
    if (last_ > step_ && cut_ < 0) cut_ = begin;
    return true;
  }
  bool any() const { return begin_ >= 0; }
  bool behind() const { return cut_ >= 0; }
  std::int64_t end(std::int64_t size, bool complete) const { return cut_ >= 0 ? cut_ : complete ? size : begin_; }

 private:
  long long step_, last_ = -1;
  std::int64_t begin_ = -1, cut_ = -1;
};

typedef std::optional<std::int64_t> End;

/// Of a text dump. Each section says its rows, or follows one that says how many there are.
inline End dump(Lines file, long long step) {
  Frames frames(step);
  long long count = -1, rows = 0;
  bool data = true;       // the section is that of the rows
  std::int64_t head = 0;  // where the frame begins
  while (file.next()) {
    if (!starts(file.line, "ITEM: ")) {
      rows += !is_comment(file.line);
      continue;
    }
    const std::string item = file.line.substr(6);
    const bool time_step = starts(item, "TIMESTEP"), opens = time_step || item == "UNITS" || item == "TIME";
    if (opens && data) head = file.begin;
    data = !opens && !starts(item, "BOX BOUNDS") && !starts(item, "LABEL") && !starts(item, "DIMENSION");
    rows = 0;
    if (starts(item, "NUMBER OF ")) {
      data = false;
      if (!file.next()) break;
      const auto number = integer(fields(file.line).empty() ? "" : fields(file.line)[0]);
      if (!number) return {};
      count = *number;
    } else if (starts(item, "GRID SIZE")) {
      data = false;
      if (!file.next()) break;
      count = 1;
      for (const std::string& number : fields(file.line)) count *= integer(number).value_or(0);
    } else if (time_step) {
      if (!file.next()) break;
      const std::vector<std::string> all = fields(file.line);
      if (all.size() != 1 || !frames.add(integer(all[0]), head, true)) return {};
      count = -1;
    }
  }
  if (!frames.any()) return {};
  const bool complete = data && rows == count;
  // A frame that begins behind the last step, and has none itself yet.
  return !complete && head > 0 && !frames.behind() ? head : frames.end(file.end, complete);
}

inline End xyz(Lines file, long long step) {
  Frames frames(step);
  const auto number = [&] { return integer(fields(file.line).size() == 1 ? fields(file.line)[0] : ""); };
  long long left = 0;
  while (file.next()) {
    const std::int64_t head = file.begin;
    const auto count = number();
    if (!count) return {};
    left = *count + 1;
    if (!file.next()) return frames.any() ? End(frames.end(head, true)) : End();
    const std::vector<std::string> all = fields(file.line);
    if (all.size() < 3 || all[0] != "Atoms." || all[1] != "Timestep:" || !frames.add(integer(all[2]), head, true)) return {};
    for (--left; left > 0 && file.next();) --left;
  }
  return frames.any() ? End(frames.end(file.end, left == 0)) : End();
}

inline End dump_yaml(Lines file, long long step) {
  Frames frames(step);
  std::int64_t head = 0;
  bool complete = true;
  while (file.next()) {
    if (file.line == "---") head = file.begin, complete = false;
    if (file.line == "...") complete = true;
    if (starts(file.line, "timestep: ") && !frames.add(integer(file.line.substr(10)), head, true)) return {};
  }
  if (!frames.any()) return {};
  return !complete && !frames.behind() ? head : frames.end(file.end, complete);
}

/// Of fix ave/time. The column of the step has a name only where each row has one.
inline End table_yaml(Lines file, long long step) {
  Frames frames(step);
  bool rows = false, data = false;
  while (file.next()) {
    const std::string& line = file.line;
    if (starts(line, "keywords: ")) rows = starts(line, "keywords: ['Step'");
    if (line == "data:" || line == "---") data = line == "data:";
    if (!data) continue;
    const std::vector<std::string> all = fields(line);
    if (rows && starts(line, "  - [")) {
      if (all.size() < 2 || !frames.add(integer(all[1].substr(1)), file.begin)) return {};
    } else if (!rows && starts(line, "  ") && all.size() == 1 && all[0].back() == ':' &&
               !frames.add(integer(all[0].substr(0, all[0].size() - 1)), file.begin))
      return {};
  }
  return frames.any() ? End(frames.end(file.end, true)) : End();
}

inline End long_correlation(Lines file, long long step) {
  Frames frames(step);
  while (file.next()) {
    if (!starts(file.line, "# Timestep: ")) {
      if (frames.any() && !is_comment(file.line) && !are_numbers(fields(file.line))) return {};
      continue;
    }
    const std::vector<std::string> all = fields(file.line);
    if (all.size() != 3 || !frames.add(integer(all[2]), file.begin)) return {};
  }
  return frames.any() ? End(frames.end(file.end, true)) : End();
}

/// Lines above the rows of a table. A run that appends writes them once more.
class Titles {
 public:
  /// Whether `line` is a comment, or a title when there are no rows yet or it was one before.
  bool take(const std::string& line, bool rows) {
    if (!rows) {
      std::string name;  // of the first column
      for (const char c : line)
        if (std::isalnum(static_cast<unsigned char>(c)) || c == '_') name += char(std::tolower(static_cast<unsigned char>(c)));
        else if (!name.empty()) break;
      names_step = names_step || name == "step" || name == "timestep";
      lines_.insert(line);
    }
    return !rows || is_comment(line) || lines_.count(line) > 0;
  }
  bool names_step = false;

 private:
  std::set<std::string> lines_;
};

/// Rows N COUNT ..., each followed by COUNT rows that count from 1 or are indented.
inline End blocks(Lines file, long long step) {
  Frames frames(step);
  Titles titles;
  bool any = false, complete = true;  // a block with rows; the last one
  while (file.next()) {
    const std::vector<std::string> head = fields(file.line);
    if (is_comment(file.line) || !are_numbers(head)) {
      if (!titles.take(file.line, frames.any())) return {};
      continue;
    }
    const auto count = integer(head.size() > 1 ? head[1] : "");
    if (!count || !frames.add(integer(head[0]), file.begin)) return {};
    complete = *count == 0;
    for (long long k = 1; k <= *count && file.next(); ++k) {
      const std::vector<std::string> row = fields(file.line);
      if (!are_numbers(row) || !integer(row[0]) || (*integer(row[0]) != k && file.line[0] != ' ')) return {};
      complete = k == *count;
    }
    any = any || (complete && *count > 0);
  }
  return any ? End(frames.end(file.end, complete)) : End();
}

/// Rows that begin with the step. That they do follows from the name of their first column, or from steps at one distance.
inline End table(Lines file, long long step) {
  Frames frames(step);
  Titles titles;
  std::size_t columns = 0;
  bool regular = true;
  long long last = -1, distance = 0;
  while (file.next()) {
    const std::vector<std::string> row = fields(file.line);
    if (is_comment(file.line) || !are_numbers(row)) {
      if (!titles.take(file.line, frames.any())) return {};
      continue;
    }
    const auto now = integer(row[0]);
    if (!now || (columns != 0 && row.size() != columns) || !frames.add(now, file.begin)) return {};
    columns = row.size();
    if (last >= 0 && distance == 0) distance = *now - last;
    if (last >= 0) regular = regular && *now - last == distance && *now % distance == 0;
    last = *now;
  }
  if (!frames.any() || !(titles.names_step || (regular && distance > 0))) return {};
  return frames.end(file.end, true);
}

}  // namespace formats

/// Where the part of `path` to keep ends: after the last complete row or frame at or before `step`.
inline FileEnd end_of_kept(const std::string& path, long long step) {
  using namespace formats;
  FileEnd end;
  Lines first(path);
  end.unread = first.failed();
  if (end.unread) return end;
  std::vector<End (*)(Lines, long long)> readers{table, blocks, long_correlation};
  while (first.next()) {
    const std::string line = first.line;
    if (line.find('\0') != std::string::npos) return end;
    if (is_comment(line) && line != "---") continue;
    if (starts(line, "ITEM: ")) readers = {dump};
    if (line == "---") readers = {dump_yaml, table_yaml};
    if (first.next() && starts(first.line.substr(std::min(first.line.find_first_not_of(' '), first.line.size())), "Atoms. Timestep:"))
      readers = {xyz};
    break;
  }
  for (const auto reader : readers) {
    const End found = reader(Lines(path), step);
    if (!found) continue;
    if (end.understood && end.at != *found) return {};
    end.understood = true;
    end.at = *found;
  }
  return end;
}

}  // namespace dembark::restart
