// The order in which contacts are eliminated from a Cholesky factor.
//
// Contacts that share a body are neighbours, so each body is a clique of the matrix. Eliminating the contact of a and b makes one clique
// of both: the order of elimination is one of contracting the edges of the graph of bodies. Contacts at the end of a branch, and those
// with walls, cost nothing and come first; the closed loops that remain are contracted where the cliques are smallest. That needs
// neither the pattern of a matrix nor a general ordering, which would cost more than the factor.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "assembly.hpp"

namespace dembark {
namespace impact {

/// The order in which contacts are eliminated. Keeps its work space only.
class EliminationOrder {
 public:
  /// chosen: the contacts to order, indices into `rows`; gets them in the order of elimination.
  void arrange(const std::vector<Row>& rows, std::size_t bodies, std::vector<int>& chosen) {
    ends_.assign(bodies, Ends());
    done_.assign(rows.size(), 0);
    order_.clear();
    for (const int i : chosen)
      if (rows[std::size_t(i)].b < 0) order_.push_back(i), done_[std::size_t(i)] = 1;
    for (const int i : chosen)
      if (!done_[std::size_t(i)]) ends_[std::size_t(rows[std::size_t(i)].a)].add(i), ends_[std::size_t(rows[std::size_t(i)].b)].add(i);
    for (std::size_t b = 0; b < bodies; ++b) peel(rows, int(b));
    contract(rows, chosen);
    chosen.swap(order_);
  }

 private:
  /// Contacts of a body that are left: how many, and the exclusive or of their numbers, which is the last one's.
  struct Ends {
    int count = 0, mixed = 0;
    void add(int contact) { ++count, mixed ^= contact; }
    void remove(int contact) { --count, mixed ^= contact; }
  };

  /// Contacts at the end of a branch, from the tip on.
  void peel(const std::vector<Row>& rows, int body) {
    while (ends_[std::size_t(body)].count == 1) {
      const int contact = ends_[std::size_t(body)].mixed;
      const Row& r = rows[std::size_t(contact)];
      order_.push_back(contact);
      done_[std::size_t(contact)] = 1;
      ends_[std::size_t(r.a)].remove(contact);
      ends_[std::size_t(r.b)].remove(contact);
      body = r.a == body ? r.b : r.a;
    }
  }

  int root(int body) {
    int& up = parent_[std::size_t(body)];
    while (parent_[std::size_t(up)] != up) up = parent_[std::size_t(up)];
    return up;
  }

  /// What is left, the smallest clique first. A contact whose clique has grown since it was put in line goes back.
  void contract(const std::vector<Row>& rows, const std::vector<int>& chosen) {
    if (order_.size() == chosen.size()) return;
    parent_.resize(ends_.size());
    std::iota(parent_.begin(), parent_.end(), 0);
    first_.assign(ends_.size(), -1);
    next_.resize(2 * rows.size());
    line_of_.resize(rows.size());
    for (std::vector<int>& line : lines_) line.clear();
    for (const int i : chosen) {
      if (done_[std::size_t(i)]) continue;
      const Row& r = rows[std::size_t(i)];
      hang(r.a, 2 * i);
      hang(r.b, 2 * i + 1);
      line_up(i, ends_[std::size_t(r.a)].count + ends_[std::size_t(r.b)].count - 1);
    }
    for (int at = 0; at < most_;) {
      if (lines_[at].empty()) {
        ++at;
        continue;
      }
      const int contact = lines_[at].back();
      lines_[at].pop_back();
      if (done_[std::size_t(contact)] || line_of_[std::size_t(contact)] != at) continue;
      const Row& r = rows[std::size_t(contact)];
      int a = root(r.a), b = root(r.b);
      if (ends_[std::size_t(a)].count < ends_[std::size_t(b)].count) std::swap(a, b);
      const int whole = ends_[std::size_t(a)].count + ends_[std::size_t(b)].count;
      const int now = at < most_ - 1 && whole - 1 > at ? whole - between(rows, a, b) : at;
      if (now > at) line_up(contact, now);
      else at = std::min(at, merge(rows, a, b));
    }
  }

  /// size: of the clique that eliminating the contact leaves, with the contact.
  int line_up(int contact, int size) {
    const int line = std::min(size, most_ - 1);
    line_of_[std::size_t(contact)] = line;
    lines_[line].push_back(contact);
    return line;
  }

  void hang(int body, int slot) {
    next_[std::size_t(slot)] = first_[std::size_t(body)];
    first_[std::size_t(body)] = slot;
  }

  /// Contacts between two cliques; b: the smaller one.
  int between(const std::vector<Row>& rows, int a, int b) {
    int count = 0;
    for (int slot = first_[std::size_t(b)]; slot >= 0; slot = next_[std::size_t(slot)]) {
      const Row& r = rows[std::size_t(slot / 2)];
      count += root(slot % 2 ? r.a : r.b) == a;
    }
    return count;
  }

  /// All contacts between two cliques go at once: what the first leaves is one clique, of which the others are part. Returns the smallest
  /// clique that any of the rest lies in now.
  int merge(const std::vector<Row>& rows, int a, int b) {
    int gone = 0;
    for (int slot = first_[std::size_t(b)]; slot >= 0; slot = next_[std::size_t(slot)]) {
      const int contact = slot / 2;
      const Row& r = rows[std::size_t(contact)];
      if (root(slot % 2 ? r.a : r.b) != a) continue;
      order_.push_back(contact);
      done_[std::size_t(contact)] = 1;
      ++gone;
    }
    parent_[std::size_t(b)] = a;
    ends_[std::size_t(a)].count += ends_[std::size_t(b)].count - 2 * gone;
    int head = -1, least = most_;
    for (const int from : {first_[std::size_t(b)], first_[std::size_t(a)]})
      for (int slot = from; slot >= 0;) {
        const int next = next_[std::size_t(slot)];
        if (!done_[std::size_t(slot / 2)]) next_[std::size_t(slot)] = head, head = slot;
        slot = next;
      }
    first_[std::size_t(a)] = head;
    for (int slot = head; slot >= 0 && gone > 1; slot = next_[std::size_t(slot)]) {
      const Row& r = rows[std::size_t(slot / 2)];
      const int size = ends_[std::size_t(a)].count + ends_[std::size_t(root(slot % 2 ? r.a : r.b))].count - 1;
      if (size < line_of_[std::size_t(slot / 2)]) least = std::min(least, line_up(slot / 2, size));
    }
    return least;
  }

  static constexpr int most_ = 64;  ///< larger cliques count as equal
  std::vector<Ends> ends_;
  std::vector<int> order_, parent_;
  std::vector<int> first_, next_;  ///< contacts of each clique, two slots a contact
  std::vector<char> done_;
  std::vector<int> line_of_;
  std::vector<int> lines_[most_];
};

}  // namespace impact
}  // namespace dembark
