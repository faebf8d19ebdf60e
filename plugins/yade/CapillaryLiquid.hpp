// Liquid that bodies carry, lend to bridges and get back, settled once a step by dembark/capillary/liquid_ledger.hpp.
#pragma once

#include <mutex>
#include <vector>

#include <boost/weak_ptr.hpp>

#include <core/Body.hpp>
#include <core/GlobalEngine.hpp>

#include "SavedFormat.hpp"
#include "attributes.hpp"
#include "dembark/capillary/liquid_ledger.hpp"

namespace yade {

class FinnieRabinowiczPhys;

/// The contacts of a step that touch without a bridge, and the bridges that broke; filled by the law from many threads, emptied by
/// CapillaryLiquid. The grain of a contact with a wall is its sphere, the other side the wall's body.
class LiquidExchange {
public:
	struct Request : ::dembark::capillary::BridgeRequest {
		FinnieRabinowiczPhys* phys;  // valid in the step of the request
	};
	typedef ::dembark::capillary::BrokenBridge Broken;
	std::vector<Request>                       requests;
	std::vector<Broken>                        broken;

	/// The lists of `step`, empty at first, as long as the lock is held.
	std::unique_lock<std::mutex> open(long step);
	void                         requestBridge(long step, const Request& request) {
		const auto lock = open(step);
		requests.push_back(request);
	}
	void bridgeBroke(long step, const Broken& bridge) {
		const auto lock = open(step);
		broken.push_back(bridge);
	}

private:
	std::mutex guard;
	long       current = -1;
};

class CapillaryLiquid : public GlobalEngine {
public:
	void              action() override;
	void              postLoad(CapillaryLiquid&);
	void              preSave(CapillaryLiquid&) { saved = ledger.saved(true); }
	void              postSave(CapillaryLiquid&) { saved.clear(); }
	void              setVolume(int body, Real volume);
	void              addWall(const std::vector<int>& bodies, Real pool, Real share, Real part);
	Real              volume(int body);
	Real              wallPool(int wall) const;
	Real              inGrains() { return totals().grains; }
	Real              inBridges() { return totals().bridges; }
	Real              onWalls() { return totals().walls; }
	Real              total() { return totals().held() + ledger.lost; }
	Real              getLost() const { return ledger.lost; }
	long              bridgeCount() const;
	std::vector<Real> getPools() const { return ofWalls(&::dembark::capillary::LiquidWall::pool); }
	std::vector<Real> getWallShares() const { return ofWalls(&::dembark::capillary::LiquidWall::share); }
	std::vector<Real> getWallParts() const { return ofWalls(&::dembark::capillary::LiquidWall::part); }
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(CapillaryLiquid,GlobalEngine,"Liquid that grains and walls carry. It belongs right after :yref:`InteractionLoop`, whose :yref:`Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz` has carriedLiquid=True. Touching bodies without a bridge ask both sides for a share of what they own; what is asked of a body in one step is scaled down to what it has. A bridge acts from the next step on, and gives its liquid back when it breaks. Nothing is made or lost.",
		((Real,content,0,Attr::triggerPostLoad,"Liquid of each sphere when it is first seen, over the volume of the sphere; :yref:`setVolume<CapillaryLiquid.setVolume>` overrides it"))
		((string,share,"cap",Attr::triggerPostLoad,"What a bridge asks of a grain: 'cap', the liquid on the cap that faces the other side, or 'fraction', a part of all of it"))
		((Real,shareFactor,1,Attr::triggerPostLoad,"Factor of the cap, 0...2, or the fraction, 0...1"))
		((string,returnRule,"equal",Attr::triggerPostLoad,"How the liquid of a broken bridge is split between two grains: 'equal', 'radius' (in proportion to the radii) or 'taken' (as it was given)"))
		((Real,maxBridge,0,Attr::triggerPostLoad,"Largest volume [m^3] of a new bridge; 0 = no limit"))
		((vector<Real>,liquid,,Attr::readonly,"Liquid [m^3] of each body by id, without its bridges"))
		((vector<int>,walls,,Attr::readonly,"For each body the number of the wall whose liquid it shares, -1 = none"))
		((string,saved,,Attr::hidden,"The ledger, while the scene is saved and loaded"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.add_property("pools",&CapillaryLiquid::getPools,"Liquid [m^3] of each wall")
		.add_property("wallShares",&CapillaryLiquid::getWallShares,"Part of its liquid that each wall gives to a bridge")
		.add_property("wallParts",&CapillaryLiquid::getWallParts,"Part of a broken bridge that stays on each wall")
		.add_property("lost",&CapillaryLiquid::getLost,"Liquid [m^3] that left with bodies that were erased")
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
	void                                       registerNewBodies();
	void                                       reconcile();
	::dembark::capillary::GrainLiquid          grains() { return {liquid.data(), static_cast<int>(liquid.size())}; }
	::dembark::capillary::LiquidLedger::Totals totals();
	std::vector<Real>                          ofWalls(double ::dembark::capillary::LiquidWall::*) const;
	/// The ledger's number of a body's wall: 0 for all that were not added, which give and keep nothing.
	int wallNumber(Body::id_t body) const { return 1 + walls[body]; }

	::dembark::capillary::LiquidLedger ledger;
	std::vector<boost::weak_ptr<Body>> seen;  // by id; to own it could mean to end a Python object without the interpreter
	bool                               vanished    = false;  // bodies, and maybe bridges with them
	long                               bridgesLost = 0;      // of FinnieRabinowiczPhys, when it was last looked at
};
REGISTER_SERIALIZABLE(CapillaryLiquid);

}  // namespace yade

DEMBARK_SAVED_FORMAT(CapillaryLiquid, 1)
