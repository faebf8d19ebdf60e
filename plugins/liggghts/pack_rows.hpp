// Rows of doubles somewhere in memory, one a lane, to packs of their components and back. DEMBARK_LANES: see pair_packs.hpp.
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

using dembark::Pack;
template <int N>
using PackVec = dembark::Vec3<Pack<N>>;

template <int N>
struct Quad {
  Pack<N> x, y, z, w;
};

/// The pack of at(0) ... at(N - 1).
template <int N, class At>
DEMBARK_HOT Pack<N> collect(At at) {
  typedef typename Pack<N>::Lanes Lanes;
  if constexpr (N == 2) return Lanes{at(0), at(1)};
  else if constexpr (N == 4) return Lanes{at(0), at(1), at(2), at(3)};
  else return Lanes{at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)};
}

/// base[index[k]] in lane k.
template <int N>
DEMBARK_HOT Pack<N> values(const double* base, const int* index) {
  return collect<N>([=](int k) { return base[index[k]]; });
}

namespace detail {

template <int N>
DEMBARK_HOT typename Pack<N>::Lanes part(const double* from) {
  return Pack<N>::load(from).lanes;
}

#ifdef DEMBARK_SHUFFLE
// Four vectors of rows (k, k + 4), k = 0 ... 3, of four columns each, to columns; and columns to such vectors: the same exchange.
typedef Pack<8>::Lanes Eight;
DEMBARK_HOT void exchange(Eight (&z)[4]) {
  const Eight a = __builtin_shufflevector(z[0], z[1], 0, 8, 2, 10, 4, 12, 6, 14),
              b = __builtin_shufflevector(z[0], z[1], 1, 9, 3, 11, 5, 13, 7, 15);
  const Eight c = __builtin_shufflevector(z[2], z[3], 0, 8, 2, 10, 4, 12, 6, 14),
              d = __builtin_shufflevector(z[2], z[3], 1, 9, 3, 11, 5, 13, 7, 15);
  z[0] = __builtin_shufflevector(a, c, 0, 1, 8, 9, 4, 5, 12, 13);
  z[1] = __builtin_shufflevector(b, d, 0, 1, 8, 9, 4, 5, 12, 13);
  z[2] = __builtin_shufflevector(a, c, 2, 3, 10, 11, 6, 7, 14, 15);
  z[3] = __builtin_shufflevector(b, d, 2, 3, 10, 11, 6, 7, 14, 15);
}
typedef Pack<4>::Lanes Four;
DEMBARK_HOT Eight joined(const Four& low, const Four& high) { return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7); }
// Columns c and c + 1 of four rows, in two instructions behind the loads.
DEMBARK_HOT void two_columns(const double* r0, const double* r1, const double* r2, const double* r3, Four& first, Four& second) {
  const Four a = __builtin_shufflevector(part<2>(r0), part<2>(r2), 0, 1, 2, 3),
             b = __builtin_shufflevector(part<2>(r1), part<2>(r3), 0, 1, 2, 3);
  first = __builtin_shufflevector(a, b, 0, 4, 2, 6);
  second = __builtin_shufflevector(a, b, 1, 5, 3, 7);
}
#endif

}  // namespace detail

/// The first three columns of the rows that row(0) ... row(N - 1) point to; reads no more than that.
template <int N, class Row>
DEMBARK_HOT PackVec<N> rows3(Row row) {
#ifdef DEMBARK_SHUFFLE
#if DEMBARK_LANES == 8
  if constexpr (N == 8) {
    detail::Eight z[4];
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k)
      z[k] = detail::joined(detail::Four(_mm256_maskz_loadu_pd(7, row(k))), detail::Four(_mm256_maskz_loadu_pd(7, row(k + 4))));
    detail::exchange(z);
    return {z[0], z[1], z[2]};
  }
#endif
  if constexpr (N == 4) {
    detail::Four x, y;
    detail::two_columns(row(0), row(1), row(2), row(3), x, y);
    return {x, y, collect<N>([=](int k) { return row(k)[2]; })};
  }
#endif
  return {collect<N>([=](int k) { return row(k)[0]; }), collect<N>([=](int k) { return row(k)[1]; }),
          collect<N>([=](int k) { return row(k)[2]; })};
}

/// Rows `index` of an array of three columns.
template <int N>
DEMBARK_HOT PackVec<N> rows3(const double* base, const int* index) {
  return rows3<N>([=](int k) { return base + 3 * static_cast<long>(index[k]); });
}

/// The first four columns.
template <int N, class Row>
DEMBARK_HOT Quad<N> rows4(Row row) {
#ifdef DEMBARK_SHUFFLE
  if constexpr (N == 8) {
    detail::Eight z[4];
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k) z[k] = detail::joined(detail::part<4>(row(k)), detail::part<4>(row(k + 4)));
    detail::exchange(z);
    return {z[0], z[1], z[2], z[3]};
  }
  if constexpr (N == 4) {
    detail::Four x, y, z, w;
    detail::two_columns(row(0), row(1), row(2), row(3), x, y);
    detail::two_columns(row(0) + 2, row(1) + 2, row(2) + 2, row(3) + 2, z, w);
    return {x, y, z, w};
  }
#endif
  return {collect<N>([=](int k) { return row(k)[0]; }), collect<N>([=](int k) { return row(k)[1]; }),
          collect<N>([=](int k) { return row(k)[2]; }), collect<N>([=](int k) { return row(k)[3]; })};
}

/// Lane k to the four numbers at row(k).
template <int N, class Row>
DEMBARK_HOT void store_rows4(const Quad<N>& q, Row row) {
#ifdef DEMBARK_SHUFFLE
  if constexpr (N == 8) {
    detail::Eight z[4] = {q.x.lanes, q.y.lanes, q.z.lanes, q.w.lanes};
    detail::exchange(z);
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k) {
      Pack<4>(__builtin_shufflevector(z[k], z[k], 0, 1, 2, 3)).store(row(k));
      Pack<4>(__builtin_shufflevector(z[k], z[k], 4, 5, 6, 7)).store(row(k + 4));
    }
    return;
  }
  if constexpr (N == 4) {
    const auto &x = q.x.lanes, &y = q.y.lanes, &z = q.z.lanes, &w = q.w.lanes;
    const detail::Four a = __builtin_shufflevector(x, y, 0, 4, 2, 6), b = __builtin_shufflevector(x, y, 1, 5, 3, 7);
    const detail::Four c = __builtin_shufflevector(z, w, 0, 4, 2, 6), d = __builtin_shufflevector(z, w, 1, 5, 3, 7);
    Pack<4>(__builtin_shufflevector(a, c, 0, 1, 4, 5)).store(row(0));
    Pack<4>(__builtin_shufflevector(b, d, 0, 1, 4, 5)).store(row(1));
    Pack<4>(__builtin_shufflevector(a, c, 2, 3, 6, 7)).store(row(2));
    Pack<4>(__builtin_shufflevector(b, d, 2, 3, 6, 7)).store(row(3));
    return;
  }
#endif
  for (int k = 0; k < N; ++k) {
    double* const to = row(k);
    to[0] = q.x[k];
    to[1] = q.y[k];
    to[2] = q.z[k];
    to[3] = q.w[k];
  }
}

}  // namespace dembark_liggghts

#endif
