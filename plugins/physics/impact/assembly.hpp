// The rows of the complementarity problem: contacts in the order of their keys, whatever the order they are given in, and the matrix
//
//   A = diag(1 / (s + c/tau)) + h tau^2 G^T M'^-1 G,
//
// s the stiffness of both springs in series, M' the response masses, G the normals. Its pattern is kept while the list of rows
// stays as it is.
#pragma once

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
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
    bool same_pattern = rows_.size() == sorted.size() && bodies_ == bodies.size();
    rows_.resize(sorted.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      Row& r = rows_[i];
      const int a = r.a, b = r.b;
      fill(bodies, contacts[std::size_t(sorted[i].contact)], settings, r);
      same_pattern = same_pattern && a == r.a && b == r.b;
    }
    if (same_pattern) return;
    bodies_ = bodies.size();
    stale_ = true;
  }

  /// Forgets the rows and the pattern.
  void clear() {
    rows_.clear();
    bodies_ = std::numeric_limits<std::size_t>::max();
  }

  /// Values of A. bodies: with 1/m' as `inverse` (1/kg); scale: h tau^2 (s^2).
  template <class Sums>
  void assemble(const std::vector<Sums>& bodies, double scale) {
    if (stale_) build_pattern(bodies_);
    double* value = matrix_.valuePtr();
    const int *outer = matrix_.outerIndexPtr(), *inner = matrix_.innerIndexPtr();
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Row& r = rows_[i];
      for (int p = outer[i]; p < outer[i + 1]; ++p) {
        const int code = shared_[p];
        if (code < 0) value[p] = r.compliance + scale * (bodies[r.a].inverse + (r.b >= 0 ? bodies[r.b].inverse : 0.0));
        else {
          const double entry = scale * bodies[code >> 1].inverse * dot(r.normal, rows_[inner[p]].normal);
          value[p] = code & 1 ? -entry : entry;
        }
      }
    }
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

  void build_pattern(std::size_t bodies) {
    stale_ = false;
    const int n = int(rows_.size());
    start_.assign(bodies + 1, 0);
    for (const Row& r : rows_) {
      ++start_[r.a + 1];
      if (r.b >= 0) ++start_[r.b + 1];
    }
    for (std::size_t b = 0; b < bodies; ++b) start_[b + 1] += start_[b];
    list_.resize(std::size_t(start_[bodies]));
    fill_.assign(start_.begin(), start_.end() - 1);
    for (int i = 0; i < n; ++i) {
      list_[fill_[rows_[i].a]++] = i;
      if (rows_[i].b >= 0) list_[fill_[rows_[i].b]++] = i;
    }
    matrix_.resize(n, n);
    inner_.clear();
    shared_.clear();
    int* outer = matrix_.outerIndexPtr();
    for (int i = 0; i < n; ++i) {
      outer[i] = int(inner_.size());
      const Row& r = rows_[i];
      int p = start_[r.a], q = r.b >= 0 ? start_[r.b] : 0;
      const int p_end = start_[r.a + 1], q_end = r.b >= 0 ? start_[r.b + 1] : 0;
      while (p < p_end || q < q_end) {
        const bool from_a = p < p_end && (q >= q_end || list_[p] <= list_[q]);
        const int j = from_a ? list_[p] : list_[q];
        if (j == i) {  // in the lists of both bodies
          inner_.push_back(i);
          shared_.push_back(-1);
          if (p < p_end && list_[p] == i) ++p;
          if (q < q_end && list_[q] == i) ++q;
          continue;
        }
        const int body = from_a ? r.a : r.b;
        const bool opposite = from_a != (rows_[j].a == body);
        inner_.push_back(j);
        shared_.push_back(2 * body + opposite);
        from_a ? ++p : ++q;
      }
    }
    outer[n] = int(inner_.size());
    matrix_.resizeNonZeros(Eigen::Index(inner_.size()));
    std::copy(inner_.begin(), inner_.end(), matrix_.innerIndexPtr());
  }

  std::vector<Row> rows_;
  std::vector<Springs> springs_;  ///< of each pair of materials, made where needed
  double dt_ = 0.0;
  std::vector<int> start_, fill_, list_, inner_, shared_;
  std::size_t bodies_ = std::numeric_limits<std::size_t>::max();
  bool stale_ = true;  ///< the pattern is made when it is needed
  Eigen::SparseMatrix<double> matrix_;
};

}  // namespace impact
}  // namespace dembark
