// The rows of the complementarity problem: contacts in the order of their keys, whatever the order they are given in, and the matrix
//
//   A = diag(1 / (s + c/tau)) + h tau^2 G^T M'^-1 G,
//
// s the stiffness of both springs in series, M' the response masses, G the normals.
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

#include "candidates.hpp"
#include "types.hpp"

namespace dembark {
namespace impact {

/// One contact, oriented (key_a < key_b for pairs), with what follows from the materials.
struct Row {
  int a = 0, b = -1;
  std::int64_t key_a = 0, key_b = -1;
  double gap = 0.0;
  Vec3<double> normal{}, point_velocity{}, place{};
  const PairLaw* law = nullptr;
  double stiffness = 0.0;           ///< s, N/m, both springs in series
  double viscous = 0.0;             ///< c / tau, N/m
  double compliance = 0.0;          ///< 1 / (s + c/tau), m/N
  double arm_a = 0.0, arm_b = 0.0;  ///< m, from the centres to the contact
  double radius = 0.0;              ///< m, R* = r_a r_b / (r_a + r_b), where friction asks for it
};

class Assembly {
 public:
  const std::vector<Row>& rows() const { return rows_; }
  std::size_t size() const { return rows_.size(); }
  const Eigen::SparseMatrix<double>& matrix() const { return matrix_; }

  /// Takes the contacts of a step. Throws std::invalid_argument with one line about the contact that is wrong.
  void update(const std::vector<Body>& bodies, const std::vector<Contact>& contacts, const std::vector<Sorted>& sorted,
              const Settings& settings) {
    const std::size_t pairs = settings.materials.size() * settings.materials.size();
    if (springs_.size() != pairs || dt_ != settings.dt) springs_.assign(pairs, Springs());
    dt_ = settings.dt;
    rows_.resize(sorted.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) fill(bodies, contacts[std::size_t(sorted[i].contact)], settings, rows_[i]);
  }

  void clear() { rows_.clear(); }

  /// Makes A. bodies: with 1/m' as `inverse` (1/kg); scale: h tau^2 (s^2). Rows meet in the bodies that they share, and each body keeps
  /// the last row so far, which leads to those before it.
  template <class Sums>
  void assemble(const std::vector<Sums>& bodies, double scale) {
    const auto inverse = [&](int body) { return body >= 0 ? bodies[std::size_t(body)].inverse : 0.0; };
    entries_.clear();
    last_.assign(bodies.size(), -1);
    before_.resize(2 * rows_.size());
    for (int i = 0; i < int(rows_.size()); ++i) {
      const Row& r = rows_[std::size_t(i)];
      entries_.emplace_back(i, i, r.compliance + scale * (inverse(r.a) + inverse(r.b)));
      for (int side = 0; side < (r.b >= 0 ? 2 : 1); ++side) {
        const int body = side ? r.b : r.a;
        int& last = last_[std::size_t(body)];
        for (int other = last; other >= 0; other = before_[std::size_t(other)]) {  // two slots a row, for its two sides
          const double entry = scale * inverse(body) * dot(r.normal, rows_[std::size_t(other / 2)].normal);
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
  /// What the contacts of two materials have in common.
  struct Springs {
    double wall = -1.0;  ///< N/m, stiffness of the wall it was made for; 0 for pairs of bodies
    double share = 0.0, stiffness = 0.0, viscous = 0.0, compliance = 0.0;  ///< of a in the compliance of both; see Row
  };

  static Springs springs_of(const Contact& c, int a, int side, const PairLaw& law, const Settings& settings) {
    const bool wall = c.b < 0;
    const double soft_a = 1.0 / settings.materials[std::size_t(a)].stiffness;
    const double soft_b = 1.0 / (wall ? c.wall_stiffness : settings.materials[std::size_t(side)].stiffness);
    if (!(soft_b >= 0.0) || std::isinf(soft_b)) throw std::invalid_argument(name_of(c) + ": the wall's stiffness must be > 0 N/m");
    Springs s;
    s.wall = wall ? c.wall_stiffness : 0.0;
    s.share = soft_a / (soft_a + soft_b);
    s.stiffness = 1.0 / (soft_a + soft_b);
    s.viscous = law.contact_damping / settings.dt;
    s.compliance = 1.0 / (s.stiffness + s.viscous);
    return s;
  }

  void fill(const std::vector<Body>& bodies, const Contact& c, const Settings& settings, Row& r) {
    const int count = int(bodies.size()), materials = int(settings.materials.size());
    if (c.a < 0 || c.a >= count || c.b >= count || c.a == c.b)
      throw std::invalid_argument(name_of(c) + ": bodies " + std::to_string(c.a) + " and " + std::to_string(c.b) + " are not two of " +
                                  std::to_string(count));
    if (c.key_a < 0 || (c.b >= 0) != (c.key_b >= 0))
      throw std::invalid_argument(name_of(c) + ": keys of bodies are >= 0, keys of walls < 0");
    if (std::max(std::abs(c.key_a), std::abs(c.key_b)) > (std::int64_t(1) << 53))
      throw std::invalid_argument(name_of(c) + ": keys must stay below 2^53");
    if (!(std::isfinite(c.gap) && std::abs(dot(c.normal, c.normal) - 1.0) < unit_tolerance))
      throw std::invalid_argument(name_of(c) + ": the gap must be finite and the normal a unit vector");
    const bool turn = turned(c), wall = c.b < 0;
    const Body& first = bodies[c.a];
    const int material_b = wall ? c.wall_material : bodies[c.b].material;
    if (first.material < 0 || first.material >= materials || material_b < 0 || material_b >= materials)
      throw std::invalid_argument(name_of(c) + ": materials " + std::to_string(first.material) + " and " + std::to_string(material_b) +
                                  " are not below " + std::to_string(materials));
    r.a = turn ? c.b : c.a;
    r.b = turn ? c.a : c.b;
    r.key_a = turn ? c.key_b : c.key_a;
    r.key_b = turn ? c.key_a : c.key_b;
    r.gap = c.gap;
    r.normal = turn ? -c.normal : c.normal;
    r.point_velocity = wall ? c.point_velocity : Vec3<double>{};
    const Body& a = bodies[r.a];
    const int side = wall ? c.wall_material : bodies[r.b].material;
    const std::size_t pair = std::size_t(a.material) * std::size_t(materials) + std::size_t(side);
    r.law = &settings.pairs[pair];
    Springs& springs = springs_[pair];
    if (springs.wall != (wall ? c.wall_stiffness : 0.0)) springs = springs_of(c, a.material, side, *r.law, settings);
    r.stiffness = springs.stiffness;
    r.viscous = springs.viscous;
    r.compliance = springs.compliance;
    // The two lever arms add up to the distance of the centres, which keeps the angular momentum; each boundary gives way by its own
    // compliance.
    const double share = springs.share, other = wall ? 0.0 : bodies[r.b].radius;
    r.arm_a = a.radius + share * c.gap;
    r.arm_b = wall ? 0.0 : other + (1.0 - share) * c.gap;
    r.place = a.position - r.arm_a * r.normal;
    if (r.law->friction.interface_shear_strength < unlimited_strength)
      r.radius = wall || a.radius == 0.0 ? a.radius : a.radius * other / (a.radius + other);
  }

  std::vector<Row> rows_;
  std::vector<Springs> springs_;  ///< of each pair of materials, made where needed
  double dt_ = 0.0;
  std::vector<Eigen::Triplet<double>> entries_;
  std::vector<int> last_, before_;
  Eigen::SparseMatrix<double> matrix_;
};

}  // namespace impact
}  // namespace dembark
