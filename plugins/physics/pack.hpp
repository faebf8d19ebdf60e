// Packs of N doubles that a processor works on at once, as a scalar type for the laws: a law written with select(), any() and the usual
// operators serves one contact (double, bool) and N contacts (Pack<N>, Mask<N>) with the same text. Every operation is that of IEEE 754
// in each lane, so that a lane gets the bits that the scalar law gives.
//
// N is 2, 4 or 8. The vector extensions of GCC and Clang do the rest; where the processor has narrower vectors the compiler splits.
// A pack names the instruction set that its code is compiled for: code for a newer processor is of types of its own, so that no other
// part of the program can come by it.
#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "vec3.hpp"  // DEMBARK_HOT

namespace dembark {

struct Portable {};  ///< what every processor has that the program runs on
struct Avx2 {};
struct Avx512 {};  ///< F, DQ, VL and BW

namespace detail {

template <int N>
struct Vectors {
  typedef double Doubles __attribute__((vector_size(8 * N)));
  typedef long long Truths __attribute__((vector_size(8 * N)));
  typedef unsigned long long Bits __attribute__((vector_size(8 * N)));
};

}  // namespace detail

/// A truth value in each lane: all bits or none.
template <int N, class Set = Portable>
struct Mask {
  typedef typename detail::Vectors<N>::Truths Lanes;
  Lanes lanes;

  DEMBARK_HOT bool operator[](int k) const { return lanes[k] != 0; }
  DEMBARK_HOT friend Mask operator&(const Mask& a, const Mask& b) { return {a.lanes & b.lanes}; }
  DEMBARK_HOT friend Mask operator|(const Mask& a, const Mask& b) { return {a.lanes | b.lanes}; }
  DEMBARK_HOT friend Mask operator!(const Mask& a) { return {~a.lanes}; }
};

template <int N, class Set = Portable>
struct Pack {
  static constexpr int size = N;
  typedef Set InstructionSet;
  typedef typename detail::Vectors<N>::Doubles Lanes;
  Lanes lanes;

  Pack() = default;
  // NOLINTBEGIN(google-explicit-constructor): formulas mix packs and plain numbers
  DEMBARK_HOT Pack(const Lanes& given) : lanes(given) {}
  DEMBARK_HOT Pack(double value) : lanes(value - Lanes{}) {}  // in every lane
  // NOLINTEND(google-explicit-constructor)

  DEMBARK_HOT static Pack load(const double* from) {
    Pack p;
    __builtin_memcpy(&p.lanes, from, sizeof p.lanes);
    return p;
  }
  DEMBARK_HOT void store(double* to) const { __builtin_memcpy(to, &lanes, sizeof lanes); }
  DEMBARK_HOT double operator[](int k) const { return lanes[k]; }

  DEMBARK_HOT Pack& operator+=(const Pack& o) {
    lanes += o.lanes;
    return *this;
  }
  DEMBARK_HOT Pack& operator-=(const Pack& o) {
    lanes -= o.lanes;
    return *this;
  }
  DEMBARK_HOT Pack& operator*=(const Pack& o) {
    lanes *= o.lanes;
    return *this;
  }
  DEMBARK_HOT friend Pack operator+(const Pack& a, const Pack& b) { return a.lanes + b.lanes; }
  DEMBARK_HOT friend Pack operator-(const Pack& a, const Pack& b) { return a.lanes - b.lanes; }
  DEMBARK_HOT friend Pack operator*(const Pack& a, const Pack& b) { return a.lanes * b.lanes; }
  DEMBARK_HOT friend Pack operator/(const Pack& a, const Pack& b) { return a.lanes / b.lanes; }
  DEMBARK_HOT friend Pack operator-(const Pack& a) { return -a.lanes; }
  DEMBARK_HOT friend Mask<N, Set> operator<(const Pack& a, const Pack& b) { return {a.lanes < b.lanes}; }
  DEMBARK_HOT friend Mask<N, Set> operator>(const Pack& a, const Pack& b) { return {a.lanes > b.lanes}; }
};

template <int N, class Set>
DEMBARK_HOT Pack<N, Set> sqrt(const Pack<N, Set>& a) {
#if defined(__x86_64__)
  typedef typename Pack<N, Set>::Lanes Lanes;
  if constexpr (std::is_same_v<Set, Avx512> && N == 8) return Lanes(_mm512_maskz_sqrt_pd(0xFF, __m512d(a.lanes)));
  else if constexpr (!std::is_same_v<Set, Portable> && N == 4) return Lanes(_mm256_sqrt_pd(__m256d(a.lanes)));
  else if constexpr (N == 2) return Lanes(_mm_sqrt_pd(__m128d(a.lanes)));
#endif
  Pack<N, Set> root;
  for (int k = 0; k < N; ++k) root.lanes[k] = std::sqrt(a.lanes[k]);
  return root;
}

/// `yes` where the mask holds, else `no`.
template <int N, class Set>
DEMBARK_HOT Pack<N, Set> select(const Mask<N, Set>& mask, const Pack<N, Set>& yes, const Pack<N, Set>& no) {
  return typename Pack<N, Set>::Lanes(mask.lanes ? yes.lanes : no.lanes);
}

/// Of the lanes of `a` and then those of `b`, counted from 0, the ones of these numbers.
template <int... Numbers, class Lanes>
DEMBARK_HOT Lanes shuffled(const Lanes& a, const Lanes& b) {
#if defined(__clang__) || __GNUC__ >= 12
  return __builtin_shufflevector(a, b, Numbers...);
#else
  return __builtin_shuffle(a, b, typename detail::Vectors<sizeof...(Numbers)>::Truths{Numbers...});
#endif
}

/// The lanes in which the mask holds, as bits.
template <int N, class Set>
DEMBARK_HOT unsigned bits(const Mask<N, Set>& mask) {
#if defined(__x86_64__)
  if constexpr (std::is_same_v<Set, Avx512> && N == 8) return _mm512_movepi64_mask(__m512i(mask.lanes));
  else if constexpr (!std::is_same_v<Set, Portable> && N == 4) return _mm256_movemask_pd(__m256d(mask.lanes));
  else if constexpr (N == 2) return _mm_movemask_pd(__m128d(mask.lanes));
#endif
  unsigned found = 0;
  for (int k = 0; k < N; ++k) found |= unsigned(mask.lanes[k] != 0) << k;
  return found;
}
template <int N, class Set>
DEMBARK_HOT bool any(const Mask<N, Set>& mask) {
  return bits(mask) != 0;
}

/// `value` times two to the integer in the last bits of `exponent` (see exponential.hpp), where both are normal numbers.
template <int N, class Set>
DEMBARK_HOT Pack<N, Set> times_power_of_two(const Pack<N, Set>& value, const Pack<N, Set>& exponent) {
  typedef typename detail::Vectors<N>::Bits Bits;
  return typename Pack<N, Set>::Lanes(Bits(value.lanes) + (Bits(exponent.lanes) << 52));
}

/// Sum of the lanes of `Count` packs, as halves of what they hold, halves of that, and so on: the same bits from packs of any size.
template <int N, class Set, std::size_t Count>
DEMBARK_HOT double sum(const Pack<N, Set> (&packs)[Count]) {
  static_assert((Count & (Count - 1)) == 0);
  if constexpr (Count > 1) {
    Pack<N, Set> half[Count / 2];
    for (std::size_t k = 0; k < Count / 2; ++k) half[k] = packs[k] + packs[k + Count / 2];
    return sum(half);
  } else if constexpr (N > 2) {
    Pack<N / 2, Set> half[2];
    __builtin_memcpy(half, packs, sizeof half);
    return sum(half);
  } else {
    return packs[0][0] + packs[0][1];
  }
}

}  // namespace dembark
