// State as numbers that survive as doubles, bit for bit. A type names its members once, in `fields()`, a tuple of references; restart
// files, saved scenes, messages between ranks, tables for Python and comparisons are made from that.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "vec3.hpp"

namespace dembark {

/// Of what follows among the fields; numbers of another one are refused.
struct FormatVersion {
  double number;
};

class Archive {
 public:
  Archive() = default;  ///< writes
  /// Reads what another one has written.
  explicit Archive(std::vector<double> numbers) : reading_(true), numbers_(std::move(numbers)) {}

  const std::vector<double>& numbers() const { return numbers_; }
  bool reading() const { return reading_; }

  /// Writes or reads; throws std::invalid_argument with one line if the numbers are not those of `value`.
  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      if (!reading_) return numbers_.push_back(double(value));
      if (at_ == numbers_.size()) wrong("are too few for what it says it holds");
      const double number = numbers_[at_++];
      if constexpr (!std::is_floating_point_v<T>) take_whole(number, value);
      else value = T(number);
    } else {
      all(value.fields());
    }
  }
  void operator()(Vec3<double>& v) { all(std::tie(v.x, v.y, v.z)); }
  template <class A, class B>
  void operator()(std::pair<A, B>& p) {
    all(std::tie(p.first, p.second));
  }
  template <class T>
  void operator()(std::vector<T>& list) {
    resize(list);
    for (T& value : list) (*this)(value);
  }
  void operator()(std::string& text) {
    resize(text);
    for (char& c : text) (*this)(c);
  }
  /// A tuple of references.
  template <class Fields>
  void all(const Fields& fields) {
    std::apply([this](auto&... field) { ((*this)(field), ...); }, fields);
  }

  void operator()(FormatVersion& version) {
    double found = version.number;
    (*this)(found);
    if (found != version.number) throw std::invalid_argument("the saved state is that of another version of dembark");
  }
  /// All has been read.
  void end() const {
    if (reading_ && at_ != numbers_.size()) wrong("do not all belong to it");
  }

 private:
  /// A conversion of a number that the type does not hold has no defined result.
  template <class T>
  void take_whole(double number, T& value) const {
    if constexpr (std::is_enum_v<T>) {
      std::underlying_type_t<T> whole{};
      take_whole(number, whole);
      value = T(whole);
    } else {
      // 2^bits: the largest number itself may be no double.
      const double beyond = std::ldexp(1.0, std::numeric_limits<T>::digits), least = double(std::numeric_limits<T>::lowest());
      if (!(number == std::floor(number) && number >= least && number < beyond))
        wrong("hold a fraction, or one out of range, where an integer is due");
      value = T(number);
    }
  }
  [[noreturn]] void wrong(const char* what) const {
    throw std::invalid_argument("the saved state is incomplete or damaged: its " + std::to_string(numbers_.size()) + " numbers " + what);
  }
  template <class List>
  void resize(List& list) {
    double size = double(list.size());
    (*this)(size);
    if (reading_ && !(size >= 0.0 && size <= double(numbers_.size()))) wrong("are too few for what it says it holds");
    list.resize(std::size_t(size));
  }

  bool reading_ = false;
  std::vector<double> numbers_;
  std::size_t at_ = 0;
};

/// The numbers of `value`.
template <class T>
std::vector<double> to_numbers(const T& value) {
  Archive out;                 // NOLINT(misc-const-correctness): filled below
  out(const_cast<T&>(value));  // writing changes nothing
  return out.numbers();
}

/// Sets `value` from its numbers; throws std::invalid_argument with one line if they are not.
template <class T>
void from_numbers(std::vector<double> numbers, T& value) {
  Archive in(std::move(numbers));  // NOLINT(misc-const-correctness): read below
  in(value);
  in.end();
}

}  // namespace dembark
