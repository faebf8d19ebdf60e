// A log with a length, for LcpImpact.
#pragma once

#include <pkg/common/Sphere.hpp>

#include "SavedFormat.hpp"
#include "attributes.hpp"

namespace yade {

class Capsule : public Sphere {
public:
	virtual ~Capsule() = default;
	void postLoad(Capsule&);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(Capsule,Sphere,"Log with a length for :yref:`LcpImpact`: a cylinder along the z axis of the body, between two half balls; longer than :yref:`length<Capsule.length>` by two radii. :yref:`State.pos` is its centre. For everything but :yref:`LcpImpact` it is a :yref:`Sphere`.",
		((Real,length,0,Attr::triggerPostLoad,"Length [m] of the cylinder, between the centres of the half balls, >= 0")),
		createIndex();
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
	);
	// clang-format on
	REGISTER_CLASS_INDEX(Capsule, Sphere);
};
REGISTER_SERIALIZABLE(Capsule);

}  // namespace yade

DEMBARK_SAVED_FORMAT(Capsule, 1)
