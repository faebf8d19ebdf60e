// The vectors of these headers: m, m/s, N ...; in the plane their z is 0.
#pragma once

#include "../vec3.hpp"

namespace dembark::sph {

typedef Vec3<double> Vector;

}  // namespace dembark::sph
