// A vector of three components, for headers that must stand alone: no allocation, no dependency, any scalar type.
#pragma once

#include <cmath>

// The common path of a law belongs into the engine's pair loop, where a call costs as much as the law; its rare branches do not.
#if defined(__GNUC__)
#define DEMBARK_HOT __attribute__((always_inline)) inline
#define DEMBARK_COLD __attribute__((noinline, cold))
#else
#define DEMBARK_HOT inline
#define DEMBARK_COLD
#endif

namespace dembark {

// Choices of a law that serves packs of contacts too (pack.hpp) are made with these.
template <class Real>
DEMBARK_HOT Real select(bool condition, Real yes, Real no) {
  return condition ? yes : no;
}
DEMBARK_HOT bool any(bool condition) { return condition; }

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
inline Real norm(const Vec3<Real>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}

}  // namespace dembark
