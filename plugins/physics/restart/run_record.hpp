// What a state says about the run that wrote it: its settings, by name, and the lengths of its output files. The run that goes on compares.
#pragma once

#include <cinttypes>
#include <cstdio>
#include <initializer_list>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "output_files.hpp"

namespace dembark::restart {

/// All digits of numbers.
template <class... Numbers>
std::string digits(const Numbers&... numbers) {
  std::string text;
  char one[32];
  for (const double number : {double(numbers)...}) text.append(one, std::size_t(std::snprintf(one, sizeof one, " %.17g", number)));
  return text.substr(1);
}

/// A text that is too long to be shown, by its hash (FNV-1a).
inline std::string hashed(const std::string& text) {
  char number[24];
  std::snprintf(number, sizeof number, "#%016" PRIx64, fnv1a(text));
  return number;
}

struct RunRecord {
  std::vector<std::pair<std::string, std::string>> facts;  ///< name, value; neither holds a tab or a line end
  std::vector<OutputFile> files;

  const std::string* find(const std::string& name) const {
    for (const auto& [own, value] : facts)
      if (own == name) return &value;
    return nullptr;
  }

  /// As lines.
  std::string text() const {
    std::ostringstream lines;
    for (const auto& [name, value] : facts) lines << "fact\t" << name << '\t' << value << '\n';
    for (const OutputFile& file : files) lines << "file\t" << file.path << '\t' << file.bytes << '\t' << file.hash << '\n';
    return lines.str();
  }
  static RunRecord read(const std::string& text) {
    RunRecord record;
    std::istringstream lines(text);
    for (std::string kind, name, value; std::getline(lines, kind, '\t') && std::getline(lines, name, '\t') && std::getline(lines, value);) {
      if (kind == "fact") record.facts.emplace_back(name, value);
      OutputFile file{name, 0, 0};
      if (kind == "file" && std::istringstream(value) >> file.bytes >> file.hash) record.files.push_back(file);
    }
    return record;
  }
};

/// Why a run is another one than that of the state, one reason an entry.
inline std::vector<std::string> differences(const RunRecord& state, const RunRecord& run) {
  std::vector<std::string> all;
  const auto add = [&all](std::initializer_list<std::string_view> words) {
    std::string& reason = all.emplace_back();
    for (const std::string_view word : words) reason += word;
  };
  for (const auto& [name, value] : run.facts) {
    const std::string* const before = state.find(name);
    if (!before) add({name, " (", value, ") is not in the state"});
    else if (*before != value && value[0] == '#') add({name, " changed"});
    else if (*before != value) add({name, " was ", *before, ", and is ", value});
  }
  for (const auto& [name, value] : state.facts)
    if (!run.find(name)) add({name, " (", value, ") of the state is missing"});
  return all;
}

}  // namespace dembark::restart
