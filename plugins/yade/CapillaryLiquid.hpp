// Liquid that bodies carry, lend to bridges and get back: the books, and the exchange once a step. The rule is
// dembark/capillary/liquid.hpp.
#pragma once

#include <map>
#include <mutex>
#include <vector>

#include <core/Body.hpp>
#include <core/GlobalEngine.hpp>

#include "dembark/capillary/liquid.hpp"

namespace yade {

class FinnieRabinowiczPhys;
class Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz;

/// What the contacts of one step ask for and give back; filled by the law from many threads, emptied by CapillaryLiquid. `first` is the
/// sphere of a contact with a wall.
class LiquidExchange {
public:
	struct Request {
		Body::id_t            first, second;
		double                firstRadius, secondRadius;  // infinite: a wall
		FinnieRabinowiczPhys* phys;                       // valid in the step of the request
	};
	struct Broken {
		Body::id_t first, second;
		double     volume, imbalance;
		bool       wall;
	};
	void ask(long step, const Request&);
	void giveBack(long step, const Broken&);
	/// Everything of `step` in an order that does not depend on threads.
	void take(long step, std::vector<Request>&, std::vector<Broken>&);

private:
	void                 begin(long step);
	std::mutex           guard;
	long                 current = -1;
	std::vector<Request> requests;
	std::vector<Broken>  broken;
};

class CapillaryLiquid : public GlobalEngine {
public:
	void action() override;
	void postLoad(CapillaryLiquid&);
	void setVolume(int body, Real volume);
	void addWall(const std::vector<int>& bodies, Real pool, Real share, Real part);
	Real volume(int body);
	Real wallPool(int wall) const;
	Real inGrains();
	Real inBridges();
	Real onWalls() const;
	Real total();
	long bridgeCount();
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(CapillaryLiquid,GlobalEngine,"Liquid that grains and walls carry. It belongs right after :yref:`InteractionLoop`, whose :yref:`Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz` has carriedLiquid=True. Touching bodies without a bridge ask both sides for a share of what they own; what is asked of a body in one step is scaled down to what it has. A bridge acts from the next step on, and gives its liquid back when it breaks. Nothing is made or lost.",
		((Real,content,0,Attr::triggerPostLoad,"Liquid of each sphere when it is first seen, over the volume of the sphere; :yref:`setVolume<CapillaryLiquid.setVolume>` overrides it"))
		((string,share,"cap",Attr::triggerPostLoad,"What a bridge asks of a grain: 'cap', the liquid on the cap that faces the other side, or 'fraction', a part of all of it"))
		((Real,shareFactor,1,Attr::triggerPostLoad,"Factor of the cap, 0...2, or the fraction, 0...1"))
		((string,returnRule,"equal",Attr::triggerPostLoad,"How the liquid of a broken bridge is split between two grains: 'equal', 'radius' (in proportion to the radii) or 'taken' (as it was given)"))
		((Real,maxBridge,0,Attr::triggerPostLoad,"Largest volume [m^3] of a new bridge; 0 = no limit"))
		((vector<Real>,liquid,,Attr::readonly,"Liquid [m^3] of each body by id, without its bridges"))
		((vector<int>,walls,,Attr::readonly,"For each body the number of the wall whose liquid it shares, -1 = none"))
		((vector<Real>,pools,,Attr::readonly,"Liquid [m^3] of each wall"))
		((vector<Real>,wallShares,,Attr::readonly,"Part of its liquid that each wall gives to a bridge"))
		((vector<Real>,wallParts,,Attr::readonly,"Part of a broken bridge that stays on each wall"))
		((Real,lost,0,Attr::readonly,"Liquid [m^3] that left with bodies that were erased"))
		, /*ctor*/
		, /*py*/
		.def("setVolume",&CapillaryLiquid::setVolume,(boost::python::arg("body"),boost::python::arg("volume")),"Give a sphere this liquid [m^3] in place of what it has.")
		.def("addWall",&CapillaryLiquid::addWall,(boost::python::arg("bodies"),boost::python::arg("pool")=0.0,boost::python::arg("share")=0.0,boost::python::arg("part")=0.0),"Let the bodies (ids) be one wall with `pool` [m^3] of liquid that gives `share` (0...1) of it to each bridge and keeps `part` (0...1) of each that breaks (of 'taken': what it gave). A wall that was not added gives and keeps nothing.")
		.def("volume",&CapillaryLiquid::volume,(boost::python::arg("body")),"Liquid [m^3] of a sphere, without its bridges.")
		.def("wallPool",&CapillaryLiquid::wallPool,(boost::python::arg("wall")),"Liquid [m^3] of a wall by its number, from 0 in the order in which they were added.")
		.def("inGrains",&CapillaryLiquid::inGrains,"Liquid [m^3] on all spheres.")
		.def("inBridges",&CapillaryLiquid::inBridges,"Liquid [m^3] in all bridges.")
		.def("onWalls",&CapillaryLiquid::onWalls,"Liquid [m^3] of all walls.")
		.def("total",&CapillaryLiquid::total,"All liquid [m^3]: on grains, in bridges, of walls, and what has left.")
		.def("bridgeCount",&CapillaryLiquid::bridgeCount,"Number of bridges.")
	);
	// clang-format on

private:
	struct Bridge {
		double volume, imbalance;
		bool   wall;
	};
	typedef std::pair<Body::id_t, Body::id_t> Pair;

	void        meet();
	void        dropErased();
	void        findBridges();
	void        giveBack(Body::id_t first, Body::id_t second, const Bridge&);
	int         wallOf(Body::id_t) const;
	std::size_t holder(Body::id_t body, bool wall) const;
	void        grant(const std::vector<LiquidExchange::Request>&);

	::dembark::capillary::ShareRule rule;
	::dembark::capillary::Return    splitting = ::dembark::capillary::Return::equal;
	::dembark::capillary::Demands   demands;
	std::map<Pair, Bridge>          bridges;  // of all contacts, for those whose bodies are erased; made anew after loading
	bool                            known = false;
};
REGISTER_SERIALIZABLE(CapillaryLiquid);

}  // namespace yade
