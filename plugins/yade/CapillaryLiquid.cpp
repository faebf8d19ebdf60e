#include "CapillaryLiquid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <core/InteractionLoop.hpp>
#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <pkg/common/Sphere.hpp>

#include "FinnieRabinowicz.hpp"
#include "report.hpp"

namespace yade {

YADE_PLUGIN((CapillaryLiquid));

using dembark_yade::fail;
using dembark_yade::text;
namespace capillary = ::dembark::capillary;

namespace {

const Sphere* sphereOf(const shared_ptr<Body>& body) { return body ? dynamic_cast<const Sphere*>(body->shape.get()) : nullptr; }

/// The contact of an interaction that has a bridge.
FinnieRabinowiczPhys* bridgeOf(const Interaction& interaction) {
	auto* const phys = interaction.isReal() ? dynamic_cast<FinnieRabinowiczPhys*>(interaction.phys.get()) : nullptr;
	return phys && phys->bridgeVolume > 0.0 ? phys : nullptr;
}

/// The law of the scene whose bridges carry liquid.
Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz* lawOf(Scene& scene) {
	for (const auto& engine : scene.engines)
		if (const auto* loop = dynamic_cast<const InteractionLoop*>(engine.get()))
			for (const auto& functor : loop->lawDispatcher->functors)
				if (auto* law = dynamic_cast<Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz*>(functor.get()))
					if (law->carriedLiquid) return law;
	fail("CapillaryLiquid: no InteractionLoop has a Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz with carriedLiquid=True");
}

/// Also of bodies that are no more: another one that stands in the same place in memory is not the same.
bool same(const boost::weak_ptr<Body>& one, const boost::weak_ptr<Body>& other) {
	return !one.owner_before(other) && !other.owner_before(one);
}

void checkVolume(const std::string& what, double volume) {
	if (!(volume >= 0.0 && std::isfinite(volume)))
		fail("CapillaryLiquid." + what + " is " + text(volume) + " m^3; it must be >= 0 and finite");
}

}  // namespace

std::unique_lock<std::mutex> LiquidExchange::open(long step) {
	std::unique_lock<std::mutex> lock(guard);
	if (step != current && !(requests.empty() && broken.empty()))
		fail("carriedLiquid=True needs the engine CapillaryLiquid right after InteractionLoop, in each step");
	current = step;
	return lock;
}

void CapillaryLiquid::postLoad(CapillaryLiquid&) {
	dembark_yade::choose("CapillaryLiquid.share", share, capillary::share_names(), ledger.share.kind);
	ledger.share.factor = shareFactor;
	if (const char* wrong = ledger.share.error())
		fail(std::string("CapillaryLiquid.shareFactor: ") + wrong + ", not " + text(shareFactor));
	dembark_yade::choose("CapillaryLiquid.returnRule", returnRule, capillary::return_names(), ledger.split);
	if (!(content >= 0.0 && content < 1.0))
		fail("CapillaryLiquid.content is " + text(content) + "; it must be >= 0 and < 1 (liquid volume over solid volume)");
	checkVolume("maxBridge", maxBridge);
	ledger.largest_bridge = maxBridge > 0.0 ? maxBridge : capillary::flat<double>;
	if (saved.empty()) return;
	try {
		ledger.restore(saved);
	} catch (const std::runtime_error& wrong) {
		fail(std::string("CapillaryLiquid: ") + wrong.what());
	}
	saved.clear();
	seen.clear();
	vanished = true;
}

/// Bodies that are new get their liquid, those that were erased take theirs along. Of a scene that was loaded all are as they were.
void CapillaryLiquid::registerNewBodies() {
	const auto&       bodies = *Omega::instance().getScene()->bodies;
	const std::size_t known = liquid.size(), count = std::max(bodies.size(), known);
	const auto        bodyOf = [&](std::size_t id) { return id < bodies.size() ? bodies[id] : shared_ptr<Body>(); };
	const bool        loaded = seen.empty();
	seen.resize(count);
	liquid.resize(count, 0.0);
	walls.resize(count, -1);
	if (ledger.walls.empty()) ledger.walls.push_back({"0"});
	ledger.resize(count);
	bool come = false;
	for (std::size_t id = 0; id < count; ++id) {
		const shared_ptr<Body> body = bodyOf(id);
		const bool             gone = same(seen[id], {}) ? loaded && id < known && !body : !same(seen[id], body);
		if (loaded && id < known) seen[id] = body;
		if (!gone && same(seen[id], body)) continue;
		if (gone) {
			ledger.remove(static_cast<int>(id), grains());
			walls[id] = -1;
			vanished  = true;
		}
		seen[id]   = body;
		liquid[id] = sphereOf(body) ? capillary::GrainLiquid::unset : 0.0;
		come       = true;
	}
	if (come)
		ledger.admit(grains(), [&](int id) {
			const Real radius = sphereOf(bodies[id])->radius;
			return content * (4.0 / 3.0 * ::dembark::pi) * radius * radius * radius;
		});
}

void CapillaryLiquid::setVolume(int body, Real amount) {
	checkVolume("setVolume: volume", amount);
	registerNewBodies();
	const auto& bodies = *Omega::instance().getScene()->bodies;
	if (body < 0 || static_cast<std::size_t>(body) >= bodies.size() || !sphereOf(bodies[body]))
		fail("CapillaryLiquid.setVolume: body " + std::to_string(body) +
		     " is no sphere of the scene; the liquid of a wall is given to addWall");
	liquid[body] = amount;
}

void CapillaryLiquid::addWall(const std::vector<int>& bodies, Real pool, Real share_, Real part) {
	registerNewBodies();
	const capillary::LiquidWall wall{std::to_string(ledger.walls.size()), pool, share_, part};
	if (const char* wrong = wall.error()) fail(std::string("CapillaryLiquid.addWall: ") + wrong);
	for (const int body : bodies) {
		if (body < 0 || static_cast<std::size_t>(body) >= liquid.size() || !Body::byId(body) || sphereOf(Body::byId(body)))
			fail("CapillaryLiquid.addWall: body " + std::to_string(body) +
			     " is no wall of the scene; add its bodies to O.bodies first");
		if (walls[body] >= 0) fail("CapillaryLiquid.addWall: body " + std::to_string(body) + " belongs to a wall already");
	}
	for (const int body : bodies) walls[body] = static_cast<int>(ledger.walls.size()) - 1;
	ledger.walls.push_back(wall);
	ledger.resize(liquid.size());
}

/// Bridges that vanished with a body go back to their sides.
void CapillaryLiquid::reconcile() {
	double    excess = 0.0;
	const int full   = ledger.reconcile_pairs(
		grains(),
		[this](auto visit) {
			for (const auto& each : *scene->interactions)
				if (const auto* phys = bridgeOf(*each); phys && !phys->wallBody)
					visit(each->getId1(), each->getId2(), phys->bridgeVolume, phys->bridgeImbalance);
		},
		excess);
	if (full >= 0)
		fail("CapillaryLiquid: the bridges of body " + std::to_string(full) + " hold " + text(excess) +
		     " m^3 more than was given to them");
	ledger.reconcile_walls(grains(), [this](int id, std::size_t wall, auto visit) {
		for (const auto& [other, each] : Body::byId(id, scene)->intrs)
			if (auto* phys = bridgeOf(*each); phys && phys->wallBody && wallNumber(other) == static_cast<int>(wall))
				visit(phys->bridgeVolume, phys->bridgeImbalance);
	});
	vanished = false;
}

void CapillaryLiquid::action() {
	LiquidExchange& exchange = *lawOf(*scene)->exchange;
	const auto      lock     = exchange.open(scene->iter);
	registerNewBodies();
	const auto number = [this](auto& contacts) {
		for (auto& each : contacts)
			if (each.sides.wall) each.sides.other = wallNumber(each.sides.other);
	};
	number(exchange.requests);
	number(exchange.broken);
	ledger.give_back(exchange.broken, grains());
	if (const long lost = FinnieRabinowiczPhys::bridgesLost; std::exchange(bridgesLost, lost) != lost) vanished = true;
	if (vanished) reconcile();
	ledger.form(exchange.requests, grains(), [](const LiquidExchange::Request& r, const capillary::NewBridge<double>& bridge) {
		r.phys->setBridge(bridge.volume, bridge.imbalance, r.radius, r.other_radius);
	});
}

Real CapillaryLiquid::volume(int body) {
	registerNewBodies();
	if (body < 0 || static_cast<std::size_t>(body) >= liquid.size())
		fail("CapillaryLiquid.volume: there is no body " + std::to_string(body));
	return liquid[body];
}

Real CapillaryLiquid::wallPool(int wall) const {
	const std::vector<Real> pools = getPools();
	if (wall < 0 || static_cast<std::size_t>(wall) >= pools.size())
		fail("CapillaryLiquid.wallPool: there is no wall " + std::to_string(wall));
	return pools[wall];
}

std::vector<Real> CapillaryLiquid::ofWalls(double capillary::LiquidWall::* of) const {
	std::vector<Real> all;
	for (std::size_t w = 1; w < ledger.walls.size(); ++w) all.push_back(ledger.walls[w].*of);
	return all;
}

capillary::LiquidLedger::Totals CapillaryLiquid::totals() {
	registerNewBodies();
	return ledger.totals(grains());
}

long CapillaryLiquid::bridgeCount() const {
	const auto& interactions = *Omega::instance().getScene()->interactions;
	return std::count_if(interactions.begin(), interactions.end(), [](const auto& each) { return bridgeOf(*each) != nullptr; });
}

}  // namespace yade
