// A vector of three components, for headers that must stand alone: no allocation, no dependency, any scalar type.
#pragma once

#include <cmath>
#include <cstddef>

// Each function that runs per contact begins with one of three macros. With CUDA's and HIP's compilers, which Kokkos calls too, it is
// compiled for the processor and for the device (docs/development/device_code.md); other compilers see a plain function.
//   DEMBARK_FUNCTION  the compiler decides whether it is inlined
//   DEMBARK_HOT       always inlined: the common path of a law, where a call would cost as much as the law
//   DEMBARK_COLD      never inlined: its rare branches
#if defined(__CUDACC__) || defined(__HIPCC__)
#define DEMBARK_DEVICE
#define DEMBARK_FUNCTION __host__ __device__
#else
#define DEMBARK_FUNCTION
#endif
#if defined(__GNUC__)
#define DEMBARK_HOT DEMBARK_FUNCTION __attribute__((always_inline)) inline
#define DEMBARK_COLD DEMBARK_FUNCTION __attribute__((noinline, cold))
#else
#define DEMBARK_HOT DEMBARK_FUNCTION inline
#define DEMBARK_COLD DEMBARK_FUNCTION
#endif

namespace dembark {

// Choices of a law that serves packs of contacts too (pack.hpp) are made with these.
template <class Real>
DEMBARK_HOT Real select(bool condition, Real yes, Real no) {
  return condition ? yes : no;
}
DEMBARK_HOT bool any(bool condition) { return condition; }
DEMBARK_HOT unsigned bits(bool condition) { return condition; }

/// Sum of `Count` numbers as halves, halves of halves, and so on: the order in which packs are added up.
template <std::size_t Count>
DEMBARK_HOT double sum(const double (&numbers)[Count]) {
  static_assert((Count & (Count - 1)) == 0);
  if constexpr (Count == 1) return numbers[0];
  else {
    double half[Count / 2];
    for (std::size_t k = 0; k < Count / 2; ++k) half[k] = numbers[k] + numbers[k + Count / 2];
    return sum(half);
  }
}

template <class Real>
struct Vec3 {
  Real x{}, y{}, z{};

  DEMBARK_HOT Vec3& operator+=(const Vec3& o) {
    x += o.x;
    y += o.y;
    z += o.z;
    return *this;
  }
  DEMBARK_HOT Vec3& operator-=(const Vec3& o) {
    x -= o.x;
    y -= o.y;
    z -= o.z;
    return *this;
  }
  DEMBARK_HOT Vec3& operator*=(Real s) {
    x *= s;
    y *= s;
    z *= s;
    return *this;
  }
};

template <class Real>
DEMBARK_HOT Vec3<Real> operator+(Vec3<Real> a, const Vec3<Real>& b) {
  return a += b;
}
template <class Real>
DEMBARK_HOT Vec3<Real> operator-(Vec3<Real> a, const Vec3<Real>& b) {
  return a -= b;
}
template <class Real>
DEMBARK_HOT Vec3<Real> operator-(const Vec3<Real>& a) {
  return {-a.x, -a.y, -a.z};
}
template <class Real>
DEMBARK_HOT Vec3<Real> operator*(Vec3<Real> a, Real s) {
  return a *= s;
}
template <class Real>
DEMBARK_HOT Vec3<Real> operator*(Real s, Vec3<Real> a) {
  return a *= s;
}

template <class Real>
DEMBARK_HOT Real dot(const Vec3<Real>& a, const Vec3<Real>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class Real>
DEMBARK_HOT Vec3<Real> cross(const Vec3<Real>& a, const Vec3<Real>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class Real>
DEMBARK_FUNCTION inline Real norm(const Vec3<Real>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}

}  // namespace dembark
