// Words of an input line, a keyword and its values, read one after the other. Wrong ones throw std::invalid_argument with one line: what,
// where, what would be right.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "message_text.hpp"

namespace dembark::keywords {

[[noreturn]] inline void refuse(const std::string& line) { throw std::invalid_argument(line); }

inline std::string text(double value) { return number_text(value, 15); }

/// `of`: the keyword that they belong to; `what`: what is wanted, for messages.
class Reader {
 public:
  explicit Reader(std::vector<std::string> words) : words_(std::move(words)) {}

  bool left() const { return at_ < words_.size(); }
  std::size_t count_left() const { return words_.size() - at_; }
  bool next_is(const char* word) const { return left() && words_[at_] == word; }
  bool next_is_number() const {
    double ignored;
    return left() && is_number(words_[at_], ignored);
  }

  std::string word(const std::string& of, const std::string& what) {
    if (!left()) refuse(of + ": " + what + " is missing");
    return words_[at_++];
  }
  double number(const std::string& of, const std::string& what) {
    const std::string found = word(of, what);
    double value;
    if (!is_number(found, value)) refuse(of + ": " + what + " must be a number, not '" + found + "'");
    return value;
  }
  double at_least(double lowest, const std::string& of, const std::string& what) {
    const double value = number(of, what);
    if (!(value >= lowest)) refuse(of + ": " + what + " must be >= " + text(lowest) + ", not " + text(value));
    return value;
  }
  long integer(const std::string& of, const std::string& what) {
    const double value = number(of, what);
    if (value != std::floor(value) || std::abs(value) > 1e9) refuse(of + ": " + what + " must be an integer, not " + text(value));
    return long(value);
  }
  double positive(const std::string& of, const std::string& what) {
    const double value = number(of, what);
    if (!(value > 0.0)) refuse(of + ": " + what + " must be > 0, not " + text(value));
    return value;
  }
  int choice(const std::string& of, const std::string& what, const std::vector<std::string>& all) {
    const std::string found = word(of, what);
    int option = 0;
    if (!option_from_name(all, found, option)) refuse(of + ": " + what + " can be " + names_text(all) + ", not '" + found + "'");
    return option;
  }

  static bool is_number(const std::string& word, double& value) {
    char* end = nullptr;
    value = std::strtod(word.c_str(), &end);
    return !word.empty() && *end == '\0' && std::isfinite(value);
  }

 private:
  const std::vector<std::string> words_;
  std::size_t at_ = 0;
};

}  // namespace dembark::keywords
