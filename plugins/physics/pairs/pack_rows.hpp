// Rows of numbers somewhere in memory, one a lane, to packs of their columns and back.
#pragma once

#include "../pack.hpp"
#include "../vec3.hpp"
#include "pair_step.hpp"  // DEMBARK_PAIR_PACKS_X86

namespace dembark {

template <class P>
using PackVec = Vec3<P>;

template <class P>
struct Quad {
  P x, y, z, w;
};

template <class P>
using LaneMask = Mask<P::size, typename P::InstructionSet>;

/// A pack of N lanes for the same processor as `P`.
template <class P, int N>
using Part = Pack<N, typename P::InstructionSet>;

template <class P>
constexpr bool is_avx512 = std::is_same_v<typename P::InstructionSet, Avx512>;

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

/// Four vectors of rows k (of eight: k and k + 4), k = 0 ... 3, of four columns each, to columns; and columns to such vectors: the same
/// exchange.
template <class P>
DEMBARK_HOT void exchange(typename P::Lanes (&z)[4]) {
  typedef typename Mask<P::size>::Lanes Order;
  Order even, odd, low, high;
  if constexpr (P::size == 4) even = Order{0, 4, 2, 6}, odd = Order{1, 5, 3, 7}, low = Order{0, 1, 4, 5}, high = Order{2, 3, 6, 7};
  else {
    even = Order{0, 8, 2, 10, 4, 12, 6, 14};
    odd = Order{1, 9, 3, 11, 5, 13, 7, 15};
    low = Order{0, 1, 8, 9, 4, 5, 12, 13};
    high = Order{2, 3, 10, 11, 6, 7, 14, 15};
  }
  const auto a = __builtin_shuffle(z[0], z[1], even), b = __builtin_shuffle(z[0], z[1], odd);
  const auto c = __builtin_shuffle(z[2], z[3], even), d = __builtin_shuffle(z[2], z[3], odd);
  z[0] = __builtin_shuffle(a, c, low);
  z[1] = __builtin_shuffle(b, d, low);
  z[2] = __builtin_shuffle(a, c, high);
  z[3] = __builtin_shuffle(b, d, high);
}

/// The first `Columns` (3 or 4) numbers of the rows that row(0) ... row(N - 1) point to; reads no more than that.
template <class P, int Columns, class Row>
DEMBARK_HOT Quad<P> rows(Row row) {
#ifdef DEMBARK_PAIR_PACKS_X86
  if constexpr (P::size > 2) {
    const auto load = [](const double* from) __attribute__((always_inline)) {
      if constexpr (Columns == 4) return _mm256_loadu_pd(from);
      else if constexpr (is_avx512<P>) return _mm256_maskz_loadu_pd(7, from);
      else return _mm256_maskload_pd(from, _mm256_setr_epi64x(-1, -1, -1, 0));
    };
    typename P::Lanes z[4];
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k)
      if constexpr (P::size == 4) z[k] = load(row(k));
      else z[k] = _mm512_insertf64x4(_mm512_castpd256_pd512(load(row(k))), load(row(k + 4)), 1);
    exchange<P>(z);
    return {z[0], z[1], z[2], z[3]};
  }
#endif
  const auto column = [row](int c) { return collect<P>([=](int k) { return row(k)[c]; }); };
  return {column(0), column(1), column(2), column(Columns - 1)};
}

/// Rows `index` of an array of three columns.
template <class P>
DEMBARK_HOT PackVec<P> rows3(const double* base, const int* index) {
  const Quad<P> q = rows<P, 3>([=](int k) { return base + 3 * static_cast<long>(index[k]); });
  return {q.x, q.y, q.z};
}

/// Lane k to the four numbers at row(k).
template <class P, class Row>
DEMBARK_HOT void store_rows(const Quad<P>& q, Row row) {
#ifdef DEMBARK_PAIR_PACKS_X86
  if constexpr (P::size > 2) {
    typename P::Lanes z[4] = {q.x.lanes, q.y.lanes, q.z.lanes, q.w.lanes};
    exchange<P>(z);
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k)
      if constexpr (P::size == 4) _mm256_storeu_pd(row(k), z[k]);
      else {
        _mm256_storeu_pd(row(k), _mm512_castpd512_pd256(z[k]));
        _mm256_storeu_pd(row(k + 4), _mm512_extractf64x4_pd(z[k], 1));
      }
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

}  // namespace dembark
