// The words of a term of a motion: its kind, then keywords with their values in any order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "../keyword_reader.hpp"
#include "../vec3.hpp"

namespace dembark {
namespace motion {

inline std::vector<std::string> split(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

struct Keyword {
  std::string name;
  std::size_t count;  ///< of values
  bool required;
};

/// The keywords of one kind of term.
struct Grammar {
  std::string kind;
  std::vector<Keyword> keywords;

  std::string known() const {
    std::string line;
    for (const Keyword& k : keywords) line += (line.empty() ? "" : ", ") + k.name;
    return line;
  }
};

/// A term as it was given. All messages are std::invalid_argument.
class Given {
 public:
  /// Reads from `at`, the first word behind the kind, to the next word that `ends` a term.
  template <class Ends>
  Given(const Grammar& grammar, const std::vector<std::string>& words, std::size_t& at, Ends ends) : kind_(grammar.kind) {
    while (at < words.size() && !ends(words[at])) {
      const std::string& name = words[at++];
      const auto keyword =
          std::find_if(grammar.keywords.begin(), grammar.keywords.end(), [&name](const Keyword& k) { return k.name == name; });
      if (keyword == grammar.keywords.end()) refuse("there is no keyword '" + name + "'; it has " + grammar.known());
      if (has(name)) refuse(name + " is given twice");
      if (words.size() - at < keyword->count)
        refuse(name + " must have " + std::to_string(keyword->count) + (keyword->count > 1 ? " numbers" : " value"));
      for (std::size_t k = 0; k < keyword->count; ++k) values_[name].push_back(words[at++]);
    }
    for (const Keyword& k : grammar.keywords)
      if (k.required && !has(k.name)) refuse(k.name + " is missing; it has " + grammar.known());
  }

  const std::string& kind() const { return kind_; }
  bool has(const std::string& name) const { return values_.count(name) > 0; }
  const std::string& word(const std::string& name) const { return values_.at(name)[0]; }
  double number(const std::string& name, std::size_t k = 0) const {
    const std::string& given = values_.at(name)[k];
    double value;
    if (!keywords::Reader::is_number(given, value)) refuse(name + " '" + given + "' is not a number");
    return value;
  }
  double number_or(const std::string& name, double otherwise) const { return has(name) ? number(name) : otherwise; }
  double positive(const std::string& name) const {
    const double value = number(name);
    if (!(value > 0.0)) refuse(name + " " + number_text(value) + " must be > 0");
    return value;
  }
  Vec3<double> vector(const std::string& name) const {
    return has(name) ? Vec3<double>{number(name, 0), number(name, 1), number(name, 2)} : Vec3<double>{};
  }
  [[noreturn]] void refuse(const std::string& what) const { throw std::invalid_argument("motion " + kind_ + ": " + what); }

 private:
  std::string kind_;
  std::map<std::string, std::vector<std::string>> values_;
};

}  // namespace motion
}  // namespace dembark
