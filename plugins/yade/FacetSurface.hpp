// Facets as one surface for YADE: a sphere has the contacts of dembark/surface, not one with each facet it overlaps, and takes them along
// when it moves from facet to facet.
#pragma once

#include <vector>

#include <core/GlobalEngine.hpp>
#include <pkg/common/Facet.hpp>
#include <pkg/common/Sphere.hpp>

#include "SavedFormat.hpp"
#include "WallContact.hpp"
#include "attributes.hpp"
#include "dembark/surface/surface_contacts.hpp"

namespace yade {

class FacetSurface : public GlobalEngine {
public:
	virtual ~FacetSurface() = default;
	void postLoad(FacetSurface&);
	void action() override;
	/// Triangles of an STL file, by the rule of all engines.
	static boost::python::list readStl(const std::string& path, Real precision);

	/// Number of a facet in this surface, -1 for a body that is none.
	int                               index(Body::id_t id) const { return id < Body::id_t(indexOf.size()) ? indexOf[id] : -1; }
	const ::dembark::SurfaceContacts& contacts() const { return surface; }
	/// Whether the engine has seen the present step, so that the facets are where they are now.
	bool upToDate(long iteration) const { return iteration == lastRun; }

	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(FacetSurface,GlobalEngine,"Joins all :yref:`Facet` bodies to one surface: of the facets that a sphere overlaps only those have a contact on which the distance to the surface has a minimum, so that a flat patch acts as one plane, an edge counts once, and facets that lie on others do not count again. When the minimum moves to a neighbour, the interaction's geometry and physics (friction, bridge) go with it. Stands before :yref:`InteractionLoop`, which has :yref:`Ig2_FacetSurface_Sphere_ScGeom` in place of :yref:`Ig2_Facet_Sphere_ScGeom`.",
		((Real,smoothAngle,0.05,Attr::triggerPostLoad,"Sides of a shallow groove that are inclined to each other by less than this [rad] are one smooth surface: a sphere between them touches only the nearer one. 0 ... pi/4."))
		((Real,precision,1e-8,Attr::triggerPostLoad,"Points of the facets nearer to each other than this [m] are one point. >= 0."))
		((long,handedOver,0,Attr::readonly,"Number of contacts that have been handed to another facet so far"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.def("readStl",&FacetSurface::readStl,(boost::python::arg("path"),boost::python::arg("precision")=1e-8),"Triangles of an STL file, text or binary, in the unit of the file: lists of three corners. Those without area, and those given again within the precision, are left out.")
		.staticmethod("readStl")
	);
	// clang-format on

private:
	struct Member {
		Body::id_t  id;
		const Body* body;
		Vector3r    position;
		Quaternionr orientation;
	};

	void refresh();
	void handOver(const shared_ptr<Interaction>&, int facet);

	::dembark::SurfaceContacts       surface;
	std::vector<Member>              members;
	std::vector<::dembark::Triangle> triangles;  // of the members
	std::vector<int>                 indexOf;
	std::size_t                      bodiesSeen = 0;
	long                             lastRun    = -1;
};
REGISTER_SERIALIZABLE(FacetSurface);

class Ig2_FacetSurface_Sphere_ScGeom : public WallContact {
public:
	bool go(const shared_ptr<Shape>&, const shared_ptr<Shape>&, const State&, const State&, const Vector3r& shift2, const bool& force,
	        const shared_ptr<Interaction>&) override;
	FUNCTOR2D(Facet, Sphere);
	DEFINE_FUNCTOR_ORDER_2D(Facet, Sphere);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(Ig2_FacetSurface_Sphere_ScGeom,IGeomFunctor,"Contact of a sphere with a :yref:`Facet` of a :yref:`FacetSurface`, in place of :yref:`Ig2_Facet_Sphere_ScGeom`. :yref:`GenericSpheresContact.refR1` is 1e8 times the sphere's radius, as the other walls' with hertzian=True.",
		((shared_ptr<FacetSurface>,surface,,,"The :yref:`FacetSurface` among the engines. Required."))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Ig2_FacetSurface_Sphere_ScGeom);

}  // namespace yade

DEMBARK_SAVED_FORMAT(FacetSurface, 1)
DEMBARK_SAVED_FORMAT(Ig2_FacetSurface_Sphere_ScGeom, 1)
