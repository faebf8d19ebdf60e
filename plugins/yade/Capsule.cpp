#include "Capsule.hpp"

#include <cmath>

#include "report.hpp"

namespace yade {

YADE_PLUGIN((Capsule));

void Capsule::postLoad(Capsule&) {
	if (!(length >= 0.0 && std::isfinite(length)))
		dembark_yade::fail("Capsule.length is " + dembark_yade::text(length) + "; it must be >= 0 m");
}

}  // namespace yade
