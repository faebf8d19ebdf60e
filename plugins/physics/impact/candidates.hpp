// The candidates of a step in the order of their keys, whatever the order they are given in, each with the place of what is remembered of
// it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "types.hpp"

namespace dembark {
namespace impact {

/// Of a contact, with the lower id first for pairs.
using Key = std::pair<std::int64_t, std::int64_t>;

/// Whether the bodies of a contact come in the other order than their ids.
inline bool turned(const Contact& c) { return c.b >= 0 && c.key_b < c.key_a; }
inline Key key_of(const Contact& c) { return turned(c) ? Key(c.key_b, c.key_a) : Key(c.key_a, c.key_b); }
inline std::string name_of(const Contact& c) { return "contact of " + std::to_string(c.key_a) + " and " + std::to_string(c.key_b); }

/// A candidate in its place.
struct Sorted {
  Key key;
  int contact = 0;  ///< index into the contacts
  int memory = -1;  ///< index into what is remembered, or -1
};

class Candidates {
 public:
  const std::vector<Sorted>& sorted() const { return sorted_; }

  /// Those of which something is remembered or that `screening` finds near. recall(key): index of what is remembered of a contact, or -1.
  /// Throws std::invalid_argument with one line where two contacts have the same keys.
  template <class Screen, class Recall>
  void take(const std::vector<Contact>& contacts, Screen& screening, Recall recall) {
    sorted_.clear();
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Key key = key_of(contacts[i]);
      const int memory = recall(key);
      if (memory < 0 && !screening.near(i)) continue;
      screening.keep(i);
      sorted_.push_back({key, int(i), memory});
    }
    sort();
    for (std::size_t i = 1; i < sorted_.size(); ++i)
      if (sorted_[i - 1].key == sorted_[i].key)
        throw std::invalid_argument(name_of(contacts[std::size_t(sorted_[i].contact)]) +
                                    ": the same two keys come twice; every contact needs its own");
  }

 private:
  static constexpr int most_runs = 16;

  /// Pairs come sorted, and so do the contacts of each wall: a few ascending runs are merged.
  void sort() {
    const auto before = [](const Sorted& p, const Sorted& q) { return p.key < q.key; };
    int runs = 0;
    for (auto from = sorted_.begin(), end = from; from != sorted_.end(); from = end) {
      if (++runs > most_runs) {
        std::sort(sorted_.begin(), sorted_.end(), before);
        return;
      }
      end = std::is_sorted_until(from, sorted_.end(), before);
      if (from == sorted_.begin()) continue;
      merged_.resize(std::size_t(end - sorted_.begin()));
      std::merge(sorted_.begin(), from, from, end, merged_.begin(), before);
      std::copy(merged_.begin(), merged_.end(), sorted_.begin());
    }
  }

  std::vector<Sorted> sorted_, merged_;
};

}  // namespace impact
}  // namespace dembark
