// Pairs of bodies in a box with periodic boundaries.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "geometry.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

struct PeriodicBox {
  Vec3<double> low{}, length{};              ///< m
  bool periodic[3] = {false, false, false};  ///< x, y, z
  double beyond = 0.0;                       ///< m, by how much bodies may be outside of the box
};

/// PairFinder with images of the bodies across periodic boundaries.
class PeriodicPairs {
 public:
  /// As PairFinder::find. Throws std::invalid_argument where a body might touch another one twice.
  void find(const std::vector<Body>& bodies, const PeriodicBox& box, double reach, std::vector<Contact>& contacts) {
    const bool* p = box.periodic;
    if (bodies.empty() || !(p[0] || p[1] || p[2])) return finder_.find(bodies, reach, contacts);
    all_ = bodies;
    origin_.resize(bodies.size());
    std::iota(origin_.begin(), origin_.end(), 0);
    add_images(box, reach);
    finder_.find(all_, reach, contacts);
    // A contact across a boundary is found from both sides; that whose first body is no image stays.
    const int own = int(bodies.size());
    contacts.erase(std::remove_if(contacts.begin(), contacts.end(), [own](const Contact& c) { return c.a >= own; }), contacts.end());
    for (Contact& c : contacts) c.b = origin_[std::size_t(c.b)];
  }

 private:
  void add_images(const PeriodicBox& box, double reach) {
    double largest = 0.0;
    for (const Body& b : all_) largest = std::max(largest, b.radius);
    const double range = 2.0 * largest + reach + box.beyond;
    double Vec3<double>::* const axes[3] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z};
    for (int k = 0; k < 3; ++k) {
      const double low = box.low.*axes[k], length = box.length.*axes[k];
      const auto at = [&](const Body& b) { return b.position.*axes[k]; };
      if (!box.periodic[k]) continue;
      if (length < 2.0 * range) {
        // Between bodies that all lie in one plane across the axis (logs in cross-section) no image can touch anything.
        const auto ends = std::minmax_element(all_.begin(), all_.end(), [&](const Body& a, const Body& b) { return at(a) < at(b); });
        if (length - (at(*ends.second) - at(*ends.first)) > 2.0 * largest + reach) continue;
        throw std::invalid_argument(std::string("the periodic box is too short along ") + "xyz"[k] + ": " + std::to_string(length) +
                                    " m; a body would touch another one twice; it needs " + std::to_string(2.0 * range) +
                                    " m or a boundary that is not periodic");
      }
      const std::size_t n = all_.size();
      for (std::size_t i = 0; i < n; ++i) {
        const double shift = at(all_[i]) < low + range ? length : at(all_[i]) > low + length - range ? -length : 0.0;
        if (shift == 0.0) continue;
        all_.push_back(all_[i]);
        all_.back().position.*axes[k] += shift;
        origin_.push_back(origin_[i]);
      }
    }
  }

  PairFinder finder_;
  std::vector<Body> all_;    ///< and their images
  std::vector<int> origin_;  ///< of each of them the index of the body
};

}  // namespace impact
}  // namespace dembark
