// The rows of the complementarity problem: contacts in the order of their keys, whatever the order they are given in, and the matrix
//
//   A = diag(1 / (s + c/tau)) + h tau^2 G^T M'^-1 G,
//
// s the stiffness of both springs in series, M' the response masses, G the normals; where contacts act off the centres of bodies, the
// moments of the normals too, with the inertia of the bodies in M'.
#pragma once

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
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

struct ContactHistory;

/// A contact with key_a < key_b for pairs, and what follows from the materials.
struct Row : Contact {
  int memory = -1;                         ///< index into what is remembered, or -1
  const ContactHistory* before = nullptr;  ///< what is known of it, maybe by another name; see history.hpp
  const ImpactPairLaw* law = nullptr;
  double stiffness = 0.0;               ///< s, N/m, both springs in series
  double viscous = 0.0;                 ///< c / tau, N/m
  double compliance = 0.0;              ///< 1 / (s + c/tau), m/N
  double arm_a = 0.0, arm_b = 0.0;      ///< m, from the centres to the contact
  double radius = 0.0;                  ///< m, R* = r_a r_b / (r_a + r_b), where friction asks for it
  Vec3<double> point{};                 ///< m, of contact
  Vec3<double> moment_a{}, moment_b{};  ///< m, of the normal about the centres of the bodies; contacts with a lever only
};

/// k, N/m, of the friction spring.
inline double tangential_stiffness(const Row& row) { return row.law->tangential_stiffness_ratio * row.stiffness; }

class Assembly {
 public:
  std::vector<Row>& rows() { return rows_; }
  const std::vector<Row>& rows() const { return rows_; }
  std::size_t size() const { return rows_.size(); }
  const Eigen::SparseMatrix<double>& matrix() const { return matrix_; }

  /// Takes those contacts of a step of which something is remembered or that `screening` finds near. recall(key): index of what is
  /// remembered of a contact, or -1. Throws std::invalid_argument with one line about the contact that is wrong.
  template <class Screen, class Recall>
  void take(const std::vector<Body>& bodies, const std::vector<Contact>& contacts, Screen& screening, Recall recall,
            const Settings& settings) {
    sorted_.clear();
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Key key = key_of(contacts[i]);
      const int memory = recall(key);
      if (memory < 0 && !screening.near(i)) continue;
      screening.keep(i);
      sorted_.push_back({key, int(i), memory});
    }
    sort();
    const std::size_t pairs = settings.materials.size() * settings.materials.size();
    if (springs_.size() != pairs || dt_ != settings.dt) springs_.assign(pairs, Springs());
    dt_ = settings.dt;
    rows_.resize(sorted_.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Contact& c = contacts[std::size_t(sorted_[i].contact)];
      if (i > 0 && sorted_[i - 1].key == sorted_[i].key) refuse(c, "the same two keys come twice; every contact needs its own");
      rows_[i].memory = sorted_[i].memory;
      fill(bodies, c, settings, rows_[i]);
    }
  }

  void clear() { rows_.clear(); }

  /// Moment of the normal about the centre of one of the bodies (m); side: 0, a, or 1, b.
  static const Vec3<double>& moment(const Row& r, int side) { return side ? r.moment_b : r.moment_a; }
  /// What the rotation of the bodies adds to the response of a contact to its own force (1/kg).
  template <class Sums>
  static double turning(const Row& r, const std::vector<Sums>& bodies) {
    const double a = bodies[std::size_t(r.a)].spin_inverse * dot(r.moment_a, r.moment_a);
    return r.b < 0 ? a : a + bodies[std::size_t(r.b)].spin_inverse * dot(r.moment_b, r.moment_b);
  }

  /// Makes A. bodies: with 1/m' as `inverse` (1/kg), 1/I as `spin_inverse`; scale: h tau^2 (s^2). Rows meet in the bodies that they share,
  /// and each body keeps the last row so far, which leads to those before it.
  template <class Sums>
  void assemble(const std::vector<Sums>& bodies, double scale) {
    const auto inverse = [&](int body) { return body >= 0 ? bodies[std::size_t(body)].inverse : 0.0; };
    entries_.clear();
    last_.assign(bodies.size(), -1);
    before_.resize(2 * rows_.size());
    for (int i = 0; i < int(rows_.size()); ++i) {
      const Row& r = rows_[std::size_t(i)];
      entries_.emplace_back(i, i, r.compliance + scale * (inverse(r.a) + inverse(r.b)) + (r.lever ? scale * turning(r, bodies) : 0.0));
      for (int side = 0; side < (r.b >= 0 ? 2 : 1); ++side) {
        const int body = side ? r.b : r.a;
        int& last = last_[std::size_t(body)];
        for (int other = last; other >= 0; other = before_[std::size_t(other)]) {  // two slots a row, for its two sides
          const Row& o = rows_[std::size_t(other / 2)];
          double entry = scale * inverse(body) * dot(r.normal, o.normal);
          if (r.lever && o.lever) entry += scale * bodies[std::size_t(body)].spin_inverse * dot(moment(r, side), moment(o, other % 2));
          const double value = other % 2 == side ? entry : -entry;
          entries_.emplace_back(i, other / 2, value);
          entries_.emplace_back(other / 2, i, value);
        }
        before_[2 * std::size_t(i) + std::size_t(side)] = last;
        last = 2 * i + side;
      }
    }
    matrix_.resize(Eigen::Index(rows_.size()), Eigen::Index(rows_.size()));
    matrix_.setFromTriplets(entries_.begin(), entries_.end());
  }

 private:
  struct Sorted {
    Key key;
    int contact, memory;
  };
  /// What the contacts of two materials have in common.
  struct Springs {
    double wall = -1.0;  ///< N/m, stiffness of the wall it was made for; 0 for pairs of bodies
    double share = 0.0, stiffness = 0.0, viscous = 0.0, compliance = 0.0;  ///< of a in the compliance of both; see Row
  };
  static constexpr int most_runs = 16;

  [[noreturn]] static void refuse(const Contact& c, const std::string& what) {
    throw std::invalid_argument("contact of " + std::to_string(c.key_a) + " and " + std::to_string(c.key_b) + ": " + what);
  }

  /// Pairs come sorted, and so do the contacts of each wall: a few ascending runs are merged.
  void sort() {
    const auto before = [](const Sorted& p, const Sorted& q) { return p.key < q.key; };
    auto middle = std::is_sorted_until(sorted_.begin(), sorted_.end(), before);
    for (int runs = 1; middle != sorted_.end(); ++runs) {
      if (runs == most_runs) return std::sort(sorted_.begin(), sorted_.end(), before);
      const auto end = std::is_sorted_until(middle, sorted_.end(), before);
      std::inplace_merge(sorted_.begin(), middle, end, before);
      middle = end;
    }
  }

  static Springs springs_of(const Contact& c, double stiffness_a, double stiffness_b, const ImpactPairLaw& law, double dt) {
    const double soft_a = 1.0 / stiffness_a, soft_b = 1.0 / stiffness_b;
    if (!(soft_b >= 0.0) || std::isinf(soft_b)) refuse(c, "the wall's stiffness must be > 0 N/m");
    Springs s;
    s.wall = c.b < 0 ? c.wall_stiffness : 0.0;
    s.share = soft_a / (soft_a + soft_b);
    s.stiffness = 1.0 / (soft_a + soft_b);
    s.viscous = law.contact_damping / dt;
    s.compliance = 1.0 / (s.stiffness + s.viscous);
    return s;
  }

  static void check(const Contact& c, int bodies) {
    if (c.a < 0 || c.a >= bodies || c.b >= bodies || c.a == c.b)
      refuse(c, "bodies " + std::to_string(c.a) + " and " + std::to_string(c.b) + " are not two of " + std::to_string(bodies));
    if (c.key_a < 0 || (c.b >= 0) != (c.key_b >= 0)) refuse(c, "keys of bodies are >= 0, keys of walls < 0");
    if (std::max(std::abs(c.key_a), std::abs(c.key_b)) > (std::int64_t(1) << 53)) refuse(c, "keys must stay below 2^53");
    if (!(std::isfinite(c.gap) && std::abs(dot(c.normal, c.normal) - 1.0) < unit_tolerance))
      refuse(c, "the gap must be finite and the normal a unit vector");
    if (!(c.share > 0.0 && c.share <= 1.0)) refuse(c, "the share of the stiffness must be > 0 and <= 1");
  }

  void fill(const std::vector<Body>& bodies, const Contact& c, const Settings& settings, Row& r) {
    check(c, int(bodies.size()));
    static_cast<Contact&>(r) = c;
    if (turned(c)) {
      std::swap(r.a, r.b);
      std::swap(r.key_a, r.key_b);
      std::swap(r.offset_a, r.offset_b);
      r.normal = -c.normal;
    }
    const bool wall = c.b < 0;
    const Body& a = bodies[r.a];
    const int materials = int(settings.materials.size()), side = wall ? c.wall_material : bodies[r.b].material;
    if (a.material < 0 || a.material >= materials || side < 0 || side >= materials)
      refuse(c, "materials " + std::to_string(a.material) + " and " + std::to_string(side) + " are not below " + std::to_string(materials));
    const std::size_t pair = std::size_t(a.material) * std::size_t(materials) + std::size_t(side);
    r.law = &settings.pairs[pair];
    Springs& springs = springs_[pair];
    if (springs.wall != (wall ? c.wall_stiffness : 0.0))
      springs = springs_of(c, settings.materials[std::size_t(a.material)].stiffness,
                           wall ? c.wall_stiffness : settings.materials[std::size_t(side)].stiffness, *r.law, dt_);
    r.stiffness = r.share * springs.stiffness;
    r.viscous = r.share * springs.viscous;
    r.compliance = springs.compliance / r.share;
    // The two lever arms add up to the distance of the centres, which keeps the angular momentum; each boundary gives way by its own
    // compliance.
    const double share = springs.share, other = wall ? 0.0 : bodies[r.b].radius;
    r.arm_a = a.radius + share * c.gap;
    r.arm_b = wall ? 0.0 : other + (1.0 - share) * c.gap;
    r.point = a.position - r.arm_a * r.normal;
    if (r.lever) {
      r.point += r.offset_a;
      r.moment_a = cross(r.offset_a, r.normal);
      r.moment_b = cross(r.offset_b, r.normal);
    } else {
      // A row is used again from step to step, perhaps after one with a lever.
      r.moment_a = r.moment_b = {};
    }
    if (r.law->friction.interface_shear_strength < unlimited_strength)
      r.radius = wall || a.radius == 0.0 ? a.radius : a.radius * other / (a.radius + other);
  }

  std::vector<Sorted> sorted_;
  std::vector<Row> rows_;
  std::vector<Springs> springs_;  ///< of each pair of materials, made where needed
  double dt_ = 0.0;
  std::vector<Eigen::Triplet<double>> entries_;
  std::vector<int> last_, before_;
  Eigen::SparseMatrix<double> matrix_;
};

}  // namespace impact
}  // namespace dembark
