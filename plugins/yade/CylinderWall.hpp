// The inside of an infinite circular cylinder as a wall for YADE, exact where facets would be a polygon.
#pragma once

#include <core/Shape.hpp>
#include <pkg/common/Sphere.hpp>

#include "WallContact.hpp"
#include "SavedFormat.hpp"
#include "attributes.hpp"

namespace yade {

class CylinderWall : public Shape {
public:
	virtual ~CylinderWall() = default;
	void postLoad(CylinderWall&);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(CylinderWall,Shape,"Inside of an infinite circular cylinder through :yref:`State.pos`, spheres are within. The orientation of the body is disregarded. Velocity and angular velocity of the body are those of the wall's surface: a wall that moves along or about its axis keeps its shape, so it may drift along it.",
		((Real,radius,NaN,Attr::triggerPostLoad,"Radius [m]"))
		((Vector3r,axis,Vector3r(0,0,1),Attr::triggerPostLoad,"Direction of the axis; made a unit vector")),
		createIndex();
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
	);
	// clang-format on
	REGISTER_CLASS_INDEX(CylinderWall, Shape);
};
REGISTER_SERIALIZABLE(CylinderWall);

class Bo1_CylinderWall_Aabb : public BoundFunctor {
public:
	void go(const shared_ptr<Shape>&, shared_ptr<Bound>&, const Se3r&, const Body*) override;
	FUNCTOR1D(CylinderWall);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(Bo1_CylinderWall_Aabb,BoundFunctor,"Box around a :yref:`CylinderWall`, without end along its axis. In a periodic cell the axis must be y or z, the collider needs allowBiggerThanPeriod=True, and the cylinder must fit between its own images.",
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Bo1_CylinderWall_Aabb);

class Ig2_CylinderWall_Sphere_ScGeom : public WallContact {
public:
	bool go(const shared_ptr<Shape>&, const shared_ptr<Shape>&, const State&, const State&, const Vector3r& shift2, const bool& force,
	        const shared_ptr<Interaction>&) override;
	FUNCTOR2D(CylinderWall, Sphere);
	DEFINE_FUNCTOR_ORDER_2D(CylinderWall, Sphere);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(Ig2_CylinderWall_Sphere_ScGeom,IGeomFunctor,"Contact of a sphere with the inside of a :yref:`CylinderWall`. The normal points to the axis; :yref:`GenericSpheresContact.refR1` is 1e8 times the sphere's radius, as the other walls' with hertzian=True.",
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(Ig2_CylinderWall_Sphere_ScGeom);

}  // namespace yade

DEMBARK_SAVED_FORMAT(CylinderWall, 1)
