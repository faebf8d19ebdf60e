// Rows of doubles somewhere in memory, one a lane, to packs of their components and back.
#ifndef DEMBARK_PACK_ROWS_HPP
#define DEMBARK_PACK_ROWS_HPP

#include "dembark/pack.hpp"
#include "dembark/vec3.hpp"

#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
#define DEMBARK_SHUFFLE
#endif
#endif

namespace dembark_liggghts {

template <class P>
using PackVec = dembark::Vec3<P>;

template <class P>
struct Quad {
  P x, y, z, w;
};

template <class P>
constexpr bool is_avx512 = std::is_same_v<typename P::InstructionSet, dembark::Avx512>;

/// The pack of at(0) ... at(N - 1).
template <class P, class At>
DEMBARK_HOT P collect(At at) {
  typedef typename P::Lanes Lanes;
  if constexpr (P::size == 2) return Lanes{at(0), at(1)};
  else if constexpr (P::size == 4) return Lanes{at(0), at(1), at(2), at(3)};
  else return Lanes{at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)};
}

/// base[index[k]] in lane k.
template <class P>
DEMBARK_HOT P values(const double* base, const int* index) {
  return collect<P>([=](int k) { return base[index[k]]; });
}

#ifdef DEMBARK_SHUFFLE
namespace detail {

template <class P, int N>
using Part = typename dembark::Pack<N, typename P::InstructionSet>::Lanes;

template <class P, int N>
DEMBARK_HOT Part<P, N> part(const double* from) {
  return dembark::Pack<N, typename P::InstructionSet>::load(from).lanes;
}
template <class P>
DEMBARK_HOT Part<P, 8> joined(const Part<P, 4>& low, const Part<P, 4>& high) {
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}

// Four vectors of rows (k, k + 4), k = 0 ... 3, of four columns each, to columns; and columns to such vectors: the same exchange.
template <class P>
DEMBARK_HOT void exchange(Part<P, 8> (&z)[4]) {
  const Part<P, 8> a = __builtin_shufflevector(z[0], z[1], 0, 8, 2, 10, 4, 12, 6, 14),
                   b = __builtin_shufflevector(z[0], z[1], 1, 9, 3, 11, 5, 13, 7, 15);
  const Part<P, 8> c = __builtin_shufflevector(z[2], z[3], 0, 8, 2, 10, 4, 12, 6, 14),
                   d = __builtin_shufflevector(z[2], z[3], 1, 9, 3, 11, 5, 13, 7, 15);
  z[0] = __builtin_shufflevector(a, c, 0, 1, 8, 9, 4, 5, 12, 13);
  z[1] = __builtin_shufflevector(b, d, 0, 1, 8, 9, 4, 5, 12, 13);
  z[2] = __builtin_shufflevector(a, c, 2, 3, 10, 11, 6, 7, 14, 15);
  z[3] = __builtin_shufflevector(b, d, 2, 3, 10, 11, 6, 7, 14, 15);
}

// Columns c and c + 1 of four rows, in two instructions behind the loads.
template <class P, class Row>
DEMBARK_HOT void two_columns(Row row, int c, P& first, P& second) {
  const Part<P, 4> a = __builtin_shufflevector(part<P, 2>(row(0) + c), part<P, 2>(row(2) + c), 0, 1, 2, 3),
                   b = __builtin_shufflevector(part<P, 2>(row(1) + c), part<P, 2>(row(3) + c), 0, 1, 2, 3);
  first = __builtin_shufflevector(a, b, 0, 4, 2, 6);
  second = __builtin_shufflevector(a, b, 1, 5, 3, 7);
}

}  // namespace detail
#endif

/// The first three columns of the rows that row(0) ... row(N - 1) point to; reads no more than that.
template <class P, class Row>
DEMBARK_HOT PackVec<P> rows3(Row row) {
#ifdef DEMBARK_SHUFFLE
  if constexpr (is_avx512<P>) {
    typedef detail::Part<P, 4> Four;
    detail::Part<P, 8> z[4];
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k)
      z[k] = detail::joined<P>(Four(_mm256_maskz_loadu_pd(7, row(k))), Four(_mm256_maskz_loadu_pd(7, row(k + 4))));
    detail::exchange<P>(z);
    return {z[0], z[1], z[2]};
  }
  if constexpr (P::size == 4) {
    P x, y;
    detail::two_columns(row, 0, x, y);
    return {x, y, collect<P>([=](int k) { return row(k)[2]; })};
  }
#endif
  const auto column = [row](int c) { return collect<P>([=](int k) { return row(k)[c]; }); };
  return {column(0), column(1), column(2)};
}

/// Rows `index` of an array of three columns.
template <class P>
DEMBARK_HOT PackVec<P> rows3(const double* base, const int* index) {
  return rows3<P>([=](int k) { return base + 3 * static_cast<long>(index[k]); });
}

/// The first four columns.
template <class P, class Row>
DEMBARK_HOT Quad<P> rows4(Row row) {
#ifdef DEMBARK_SHUFFLE
  if constexpr (P::size == 8) {
    detail::Part<P, 8> z[4];
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k) z[k] = detail::joined<P>(detail::part<P, 4>(row(k)), detail::part<P, 4>(row(k + 4)));
    detail::exchange<P>(z);
    return {z[0], z[1], z[2], z[3]};
  }
  if constexpr (P::size == 4) {
    Quad<P> q;
    detail::two_columns(row, 0, q.x, q.y);
    detail::two_columns(row, 2, q.z, q.w);
    return q;
  }
#endif
  const auto column = [row](int c) { return collect<P>([=](int k) { return row(k)[c]; }); };
  return {column(0), column(1), column(2), column(3)};
}

/// Lane k to the four numbers at row(k).
template <class P, class Row>
DEMBARK_HOT void store_rows4(const Quad<P>& q, Row row) {
#ifdef DEMBARK_SHUFFLE
  typedef dembark::Pack<4, typename P::InstructionSet> Four;
  if constexpr (P::size == 8) {
    detail::Part<P, 8> z[4] = {q.x.lanes, q.y.lanes, q.z.lanes, q.w.lanes};
    detail::exchange<P>(z);
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k) {
      Four(__builtin_shufflevector(z[k], z[k], 0, 1, 2, 3)).store(row(k));
      Four(__builtin_shufflevector(z[k], z[k], 4, 5, 6, 7)).store(row(k + 4));
    }
    return;
  }
  if constexpr (P::size == 4) {
    const auto &x = q.x.lanes, &y = q.y.lanes, &z = q.z.lanes, &w = q.w.lanes;
    const typename P::Lanes a = __builtin_shufflevector(x, y, 0, 4, 2, 6), b = __builtin_shufflevector(x, y, 1, 5, 3, 7);
    const typename P::Lanes c = __builtin_shufflevector(z, w, 0, 4, 2, 6), d = __builtin_shufflevector(z, w, 1, 5, 3, 7);
    Four(__builtin_shufflevector(a, c, 0, 1, 4, 5)).store(row(0));
    Four(__builtin_shufflevector(b, d, 0, 1, 4, 5)).store(row(1));
    Four(__builtin_shufflevector(a, c, 2, 3, 6, 7)).store(row(2));
    Four(__builtin_shufflevector(b, d, 2, 3, 6, 7)).store(row(3));
    return;
  }
#endif
  for (int k = 0; k < P::size; ++k) {
    double* const to = row(k);
    to[0] = q.x[k];
    to[1] = q.y[k];
    to[2] = q.z[k];
    to[3] = q.w[k];
  }
}

}  // namespace dembark_liggghts

#endif
