// InteractionLoop with a short path for what most of its time goes to: pairs of spheres under the Finnie-Rabinowicz law, in packs of
// contacts.
#pragma once

#include <core/InteractionLoop.hpp>

#include "ContactPacks.hpp"
#include "SavedFormat.hpp"
#include "attributes.hpp"

namespace yade {

class SphereContactLoop : public InteractionLoop {
public:
	void action() override;
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(SphereContactLoop,InteractionLoop,":yref:`InteractionLoop`, faster where :yref:`spheres<Sphere>` meet under :yref:`Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz` with :yref:`Ig2_Sphere_Sphere_ScGeom`; same arguments, and on one thread the same trajectories to the last bit. All other interactions are dispatched as there. Of the geometry of the pairs that take the short path the normal, the point of contact, the depth and the radii are kept up; :yref:`ScGeom.shearInc` and the axes of rotation, which this law does not use, are not.",
		((long,shortWay,0,Attr::readonly,"Contacts of the last step that took the short path"))
		((long,packed,0,(Attr::readonly|Attr::noSave),"Those of them that were computed in packs"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
	);
	// clang-format on

private:
	typedef Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz Law;

	enum class PairPath { none, apart, touching };
	/// A potential interaction of spheres that were too far apart, held so that none other can stand at its address. Only this loop
	/// makes it real.
	struct Apart {
		shared_ptr<Interaction> interaction;
		Body::id_t              id1 = 0, id2 = 0;
		Vector3i                cellDist;
	};

	void     fetchAhead(const InteractionContainer&, long i, long end) const;
	bool     separated(Body::id_t, Body::id_t, const Vector3i& cellDist) const;
	PairPath take(const shared_ptr<Interaction>&, dembark_yade::ContactPacks&);
	void     dispatch(const shared_ptr<Interaction>&, dembark_yade::ContactPacks&);

	dembark_yade::Spheres spheres;               // of this step
	std::vector<Apart>    distant;               // by place in the container: seen without a look at the interaction
	const IGeomFunctor*   distantFor = nullptr;  // the functor that they know
	Real                  reach      = 0;        // of its contacts, over the sum of the radii, squared
	const IGeomFunctor*   meeting    = nullptr;  // of two spheres, of this step
	const IPhysFunctor*   physics    = nullptr;
	Law*                  law        = nullptr;
};
REGISTER_SERIALIZABLE(SphereContactLoop);

}  // namespace yade

DEMBARK_SAVED_FORMAT(SphereContactLoop, 1)
