#include "CapillaryLiquid.hpp"

#include <algorithm>
#include <cmath>

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

template <class Item>
bool byBodies(const Item& a, const Item& b) {
	return std::make_pair(a.first, a.second) < std::make_pair(b.first, b.second);
}

const Sphere* sphereOf(const shared_ptr<Body>& body) { return body ? dynamic_cast<const Sphere*>(body->shape.get()) : nullptr; }

/// The law of the scene whose bridges carry liquid.
Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz* lawOf(Scene& scene) {
	for (const auto& engine : scene.engines)
		if (const auto* loop = dynamic_cast<const InteractionLoop*>(engine.get()))
			for (const auto& functor : loop->lawDispatcher->functors)
				if (auto* law = dynamic_cast<Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz*>(functor.get()))
					if (law->carriedLiquid) return law;
	fail("CapillaryLiquid: no InteractionLoop has a Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz with carriedLiquid=True");
}

void checkVolume(const std::string& what, double volume) {
	if (!(volume >= 0.0 && std::isfinite(volume)))
		fail("CapillaryLiquid." + what + " is " + text(volume) + " m^3; it must be >= 0 and finite");
}

}  // namespace

void LiquidExchange::begin(long step) {
	if (step == current) return;
	if (!requests.empty() || !broken.empty())
		fail("carriedLiquid=True needs the engine CapillaryLiquid right after InteractionLoop, in each step");
	current = step;
}

void LiquidExchange::ask(long step, const Request& request) {
	const std::lock_guard<std::mutex> lock(guard);
	begin(step);
	requests.push_back(request);
}

void LiquidExchange::giveBack(long step, const Broken& bridge) {
	const std::lock_guard<std::mutex> lock(guard);
	begin(step);
	broken.push_back(bridge);
}

void LiquidExchange::take(long step, std::vector<Request>& asked, std::vector<Broken>& back) {
	begin(step);
	asked.swap(requests);
	back.swap(broken);
	requests.clear();
	broken.clear();
	std::sort(asked.begin(), asked.end(), byBodies<Request>);
	std::sort(back.begin(), back.end(), byBodies<Broken>);
}

void CapillaryLiquid::postLoad(CapillaryLiquid&) {
	if (share == "cap") rule.kind = capillary::ShareRule::Kind::cap;
	else if (share == "fraction") rule.kind = capillary::ShareRule::Kind::fraction;
	else fail("CapillaryLiquid.share is '" + share + "'; it must be cap or fraction");
	rule.factor = shareFactor;
	if (const char* wrong = rule.error()) fail(std::string("CapillaryLiquid.shareFactor: ") + wrong + ", not " + text(shareFactor));
	const std::vector<std::string> names = capillary::return_names();
	const auto                     found = std::find(names.begin(), names.end(), returnRule);
	if (found == names.end()) fail("CapillaryLiquid.returnRule is '" + returnRule + "'; it must be equal, radius or taken");
	splitting = static_cast<capillary::Return>(found - names.begin());
	if (!(content >= 0.0 && content < 1.0))
		fail("CapillaryLiquid.content is " + text(content) + "; it must be >= 0 and < 1 (liquid volume over solid volume)");
	checkVolume("maxBridge", maxBridge);
}

/// Bodies that are new get their liquid.
void CapillaryLiquid::meet() {
	const auto& bodies = *Omega::instance().getScene()->bodies;
	for (std::size_t id = liquid.size(); id < bodies.size(); ++id) {
		const Sphere* sphere = sphereOf(bodies[id]);
		liquid.push_back(sphere ? content * (4.0 / 3.0 * ::dembark::pi) * sphere->radius * sphere->radius * sphere->radius : 0.0);
	}
	if (walls.size() < liquid.size()) walls.resize(liquid.size(), -1);
}

void CapillaryLiquid::setVolume(int body, Real amount) {
	checkVolume("setVolume: volume", amount);
	meet();
	const auto& bodies = *Omega::instance().getScene()->bodies;
	if (body < 0 || static_cast<std::size_t>(body) >= bodies.size() || !sphereOf(bodies[body]))
		fail("CapillaryLiquid.setVolume: body " + std::to_string(body) +
		     " is no sphere of the scene; the liquid of a wall is given to addWall");
	liquid[body] = amount;
}

void CapillaryLiquid::addWall(const std::vector<int>& bodies, Real pool, Real share_, Real part) {
	checkVolume("addWall: pool", pool);
	for (const Real each : {share_, part})
		if (!(each >= 0.0 && each <= 1.0)) fail("CapillaryLiquid.addWall: share and part must be >= 0 and <= 1, not " + text(each));
	meet();
	for (const int body : bodies) {
		if (body < 0 || static_cast<std::size_t>(body) >= liquid.size() || !Body::byId(body) || sphereOf(Body::byId(body)))
			fail("CapillaryLiquid.addWall: body " + std::to_string(body) +
			     " is no wall of the scene; add its bodies to O.bodies first");
		if (walls[body] >= 0) fail("CapillaryLiquid.addWall: body " + std::to_string(body) + " belongs to a wall already");
	}
	for (const int body : bodies) walls[body] = static_cast<int>(pools.size());
	pools.push_back(pool);
	wallShares.push_back(share_);
	wallParts.push_back(part);
}

int CapillaryLiquid::wallOf(Body::id_t body) const { return static_cast<std::size_t>(body) < walls.size() ? walls[body] : -1; }

/// Number of a body or wall among those of which liquid can be asked.
std::size_t CapillaryLiquid::holder(Body::id_t body, bool wall) const { return wall ? liquid.size() + wallOf(body) : body; }

void CapillaryLiquid::giveBack(Body::id_t first, Body::id_t second, const Bridge& bridge) {
	const double toFirst  = capillary::returned(bridge.volume, bridge.imbalance),
		     toSecond = capillary::returned(bridge.volume, -bridge.imbalance);
	const auto   give     = [this](Body::id_t body, double amount) { (Body::byId(body) ? liquid[body] : lost) += amount; };
	give(first, toFirst);
	if (!bridge.wall) give(second, toSecond);
	else if (wallOf(second) >= 0) pools[wallOf(second)] += toSecond;
}

/// Bridges of the scene, after it was loaded.
void CapillaryLiquid::findBridges() {
	if (known) return;
	known = true;
	for (const auto& interaction : *Omega::instance().getScene()->interactions) {
		const auto* phys = interaction->isReal() ? dynamic_cast<const FinnieRabinowiczPhys*>(interaction->phys.get()) : nullptr;
		if (!phys || !(phys->bridgeVolume > 0.0)) continue;
		Pair       pair{interaction->getId1(), interaction->getId2()};
		const bool wall = !sphereOf(Body::byId(pair.first)) || !sphereOf(Body::byId(pair.second));
		if (!sphereOf(Body::byId(pair.first))) std::swap(pair.first, pair.second);
		bridges[pair] = {phys->bridgeVolume, phys->bridgeImbalance, wall};
	}
}

/// What erased bodies had leaves with them; the other side of their bridges keeps its part.
void CapillaryLiquid::dropErased() {
	const auto& bodies = *Omega::instance().getScene()->bodies;
	bool        any    = false;
	for (std::size_t id = 0; id < liquid.size(); ++id) {
		if (id < bodies.size() && bodies[id]) continue;
		lost += liquid[id];
		liquid[id] = 0.0;
		any        = true;
	}
	if (!any) return;
	for (auto each = bridges.begin(); each != bridges.end();) {
		if (Body::byId(each->first.first) && Body::byId(each->first.second)) {
			++each;
			continue;
		}
		giveBack(each->first.first, each->first.second, each->second);
		each = bridges.erase(each);
	}
}

void CapillaryLiquid::grant(const std::vector<LiquidExchange::Request>& asked) {
	demands.resize(liquid.size() + pools.size());
	const auto shareOfSecond = [this](const LiquidExchange::Request& r) {
		if (!std::isinf(r.secondRadius)) return rule(r.secondRadius, r.firstRadius);
		return wallOf(r.second) >= 0 ? wallShares[wallOf(r.second)] : 0.0;
	};
	for (const auto& r : asked) {
		demands.add(r.first, rule(r.firstRadius, r.secondRadius));
		if (const double part = shareOfSecond(r); part > 0.0) demands.add(holder(r.second, std::isinf(r.secondRadius)), part);
	}
	const auto   owned   = [this](std::size_t at) -> double& { return at < liquid.size() ? liquid[at] : pools[at - liquid.size()]; };
	const double largest = maxBridge > 0.0 ? maxBridge : capillary::flat<double>;
	std::vector<double> taken(asked.size()), takenOfSecond(asked.size());
	for (std::size_t k = 0; k < asked.size(); ++k) {
		const auto&       r     = asked[k];
		const bool        wall  = std::isinf(r.secondRadius);
		const std::size_t first = r.first;
		const double      part  = shareOfSecond(r);
		const double      given = rule(r.firstRadius, r.secondRadius) * capillary::grant(liquid[first], demands.of(first));
		double            other = 0.0;
		if (part > 0.0) {
			const std::size_t second = holder(r.second, wall);
			other                    = part * capillary::grant(owned(second), demands.of(second));
		}
		const auto bridge =
			wall ? capillary::form_wall_bridge(given, other, wallOf(r.second) >= 0 ? wallParts[wallOf(r.second)] : 0.0,
			                                   splitting, largest)
			     : capillary::form_bridge(given, other, r.firstRadius, r.secondRadius, splitting, largest);
		taken[k]         = bridge.from_i;
		takenOfSecond[k] = bridge.from_j;
		if (!(bridge.volume > 0.0)) continue;
		r.phys->setBridge(bridge.volume, bridge.imbalance, r.firstRadius, r.secondRadius);
		bridges[{r.first, r.second}] = {bridge.volume, bridge.imbalance, wall};
	}
	// All grants are of what was owned before the first.
	for (std::size_t k = 0; k < asked.size(); ++k) {
		double& own = liquid[asked[k].first];
		own         = capillary::remaining(own, taken[k]);
		if (!(takenOfSecond[k] > 0.0)) continue;
		double& other = owned(holder(asked[k].second, std::isinf(asked[k].secondRadius)));
		other         = capillary::remaining(other, takenOfSecond[k]);
	}
	demands.clear();
}

void CapillaryLiquid::action() {
	std::vector<LiquidExchange::Request> asked;
	std::vector<LiquidExchange::Broken>  back;
	meet();
	findBridges();
	dropErased();
	lawOf(*scene)->exchange->take(scene->iter, asked, back);
	for (const auto& each : back) {
		giveBack(each.first, each.second, {each.volume, each.imbalance, each.wall});
		bridges.erase({each.first, each.second});
	}
	if (!asked.empty()) grant(asked);
}

Real CapillaryLiquid::volume(int body) {
	meet();
	if (body < 0 || static_cast<std::size_t>(body) >= liquid.size())
		fail("CapillaryLiquid.volume: there is no body " + std::to_string(body));
	return liquid[body];
}

Real CapillaryLiquid::wallPool(int wall) const {
	if (wall < 0 || static_cast<std::size_t>(wall) >= pools.size())
		fail("CapillaryLiquid.wallPool: there is no wall " + std::to_string(wall));
	return pools[wall];
}

Real CapillaryLiquid::inGrains() {
	meet();
	Real sum = 0.0;
	for (const Real each : liquid) sum += each;
	return sum;
}

Real CapillaryLiquid::inBridges() {
	findBridges();
	Real sum = 0.0;
	for (const auto& each : bridges) sum += each.second.volume;
	return sum;
}

Real CapillaryLiquid::onWalls() const {
	Real sum = 0.0;
	for (const Real each : pools) sum += each;
	return sum;
}

Real CapillaryLiquid::total() { return inGrains() + inBridges() + onWalls() + lost; }

long CapillaryLiquid::bridgeCount() {
	findBridges();
	return static_cast<long>(bridges.size());
}

}  // namespace yade
