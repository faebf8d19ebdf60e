// One value for each pair of atom types.
#pragma once

#include <cstddef>
#include <vector>

namespace dembark {

/// Types go from 1 to types().
template <class Value>
class PairTable {
  int row_ = 1;
  std::vector<Value> values_;

 public:
  PairTable() = default;
  explicit PairTable(int types) : row_(types + 1), values_(std::size_t(row_) * row_) {}
  int types() const { return row_ - 1; }
  Value& operator()(int i, int j) { return values_[std::size_t(i * row_ + j)]; }
  const Value& operator()(int i, int j) const { return values_[std::size_t(i * row_ + j)]; }
};

}  // namespace dembark
