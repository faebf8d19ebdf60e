// The next event of all: a tournament of the grains' next events, one a grain (B. D. Lubachevsky, J. Comput. Phys. 94 (1991) 255). Of equal
// times the one that lies first in memory wins, so that runs are the same bits.
#pragma once

#include <cstddef>
#include <vector>

#include "contact_times.hpp"

namespace dembark::events {

class Tournament {
 public:
  /// All of n grains without an event.
  void reset(int n) {
    leaves_ = 1;
    while (leaves_ < n) leaves_ *= 2;
    time_.assign(std::size_t(leaves_), never);
    winner_.resize(2 * std::size_t(leaves_));
    for (int i = 0; i < leaves_; ++i) winner_[leaves_ + i] = i;
    for (int node = leaves_ - 1; node >= 1; --node) winner_[node] = winner_[2 * node];
  }
  void set(int i, double time) {
    time_[i] = time;
    for (int node = (leaves_ + i) / 2; node >= 1; node /= 2) {
      const int left = winner_[2 * node], right = winner_[2 * node + 1], winner = time_[right] < time_[left] ? right : left;
      if (winner_[node] == winner && winner != i) return;
      winner_[node] = winner;
    }
  }
  int first() const { return winner_[1]; }
  double time(int i) const { return time_[i]; }

 private:
  int leaves_ = 1;
  std::vector<double> time_;
  std::vector<int> winner_;
};

}  // namespace dembark::events
