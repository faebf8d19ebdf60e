#include "FinnieRabinowicz.hpp"

#include <tuple>
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>
#include <vector>

#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <pkg/common/Sphere.hpp>
#include <pkg/dem/FrictPhys.hpp>
#include <pkg/dem/GlobalStiffnessTimeStepper.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#include "ContactView.hpp"
#include "report.hpp"

#include "dembark/capillary/bridge_law.hpp"

namespace yade {

YADE_PLUGIN((FinnieRabinowiczPhys)(Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys)(Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz));

static_assert(std::is_same<Real, double>::value, "dembark's laws need a YADE built with REAL_PRECISION_BITS=64");

using dembark_yade::choose;
using dembark_yade::ContactView;
using dembark_yade::fail;
using dembark_yade::text;
using dembark_yade::vec;

namespace {

using Phys = FinnieRabinowiczPhys;
using Ip2  = Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys;
using Law2 = Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz;

// What slipRings holds: the members of SlipRings one after the other.
constexpr std::size_t ringNumbers = sizeof(::dembark::SlipRings) / sizeof(double);
static_assert(std::is_trivially_copyable<::dembark::SlipRings>::value, "numbers only");

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Winvalid-offsetof"
static_assert(offsetof(Phys, preparedBy) == offsetof(FrictPhys, tangensOfFrictionAngle), "what YADE writes there has to be seen");
#pragma GCC diagnostic pop

const std::string ip2  = "Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys.";
const std::string law2 = "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz.";

const char* const useSetFriction =
	"; change staticFriction and kineticFriction, of all contacts and of those to come: dembark.set_friction()";

std::string pairName(const Material& a, const Material& b) { return "materials " + std::to_string(a.id) + " and " + std::to_string(b.id); }
std::string pairName(const Body& a, const Body& b) { return "bodies " + std::to_string(a.getId()) + " and " + std::to_string(b.getId()); }

/// Value of a pair parameter; NaN where none was given.
double pairValue(const shared_ptr<MatchMaker>& maker, const std::string& attribute, const Material& a, const Material& b) {
	if (!maker) return NaN;
	double value = NaN;
	try {
		value = (*maker)(a.id, b.id);
	} catch (const std::exception&) {
	}
	if (std::isnan(value)) fail(attribute + " has no value for " + pairName(a, b) + "; add the pair to its MatchMaker.matches");
	return value;
}

using ::dembark::ContactNumber;

/// A number of a contact: where the Ip2 functor has it, and where the contact keeps it.
struct Number {
	ContactNumber          which;
	shared_ptr<MatchMaker> Ip2::* ofPair;
	Real Ip2::* ofAll;
	Real Phys::* kept;
};
// clang-format off
#define DEMBARK_NUMBER(scope, name, camel, ...) DEMBARK_NUMBER_##scope(name, camel)
#define DEMBARK_NUMBER_pair(name, camel) {ContactNumber::name, &Ip2::camel, nullptr, &Phys::camel},
#define DEMBARK_NUMBER_global(name, camel) {ContactNumber::name, nullptr, &Ip2::camel, &Phys::camel},
const Number numbers[] = {
	{ContactNumber::bridge_volume, &Ip2::bridgeVolume, nullptr, &Phys::newBridgeVolume},
	DEMBARK_CONTACT_NUMBERS(DEMBARK_NUMBER)
};
#undef DEMBARK_NUMBER
#undef DEMBARK_NUMBER_pair
#undef DEMBARK_NUMBER_global
// clang-format on

/// The numbers that a contact of two materials, or bodies, keeps, for dembark::read_friction() and its like. All are >= 0; below is: not
/// given.
template <class Pair>
class PhysSource : public ::dembark::ContactSource {
	const Phys& phys;
	const Pair& a;
	const Pair& b;
	const Real  speed;  // of Hooke's law

public:
	PhysSource(const Phys& contact, const Pair& one, const Pair& other, Real characteristicVelocity = NaN)
		: phys(contact), a(one), b(other), speed(characteristicVelocity) {}
	std::string name(const ::dembark::Parameter& p) const override { return p.camel_case; }
	double      given(const ::dembark::Parameter& p, int) const override {
		for (const Number& each : numbers)
			if (&parameter(each.which) == &p) return phys.*each.kept >= 0.0 ? phys.*each.kept : NaN;
		return &parameter(ContactNumber::characteristic_velocity) == &p ? speed : NaN;
	}
	[[noreturn]] void missing(const ::dembark::Parameter& p, int) const override {
		fail(ip2 + name(p) + " is not set; give it a number" + (p.scope == ::dembark::Scope::pair ? " or a MatchMaker" : ""));
	}
	[[noreturn]] void wrong(const std::string& line) const override { fail(line + ", " + pairName(a, b)); }
};

}  // namespace

namespace dembark_yade {

std::string listed(const std::string& doc, const std::vector<std::string>& names) {
	std::string text = doc;
	for (std::size_t k = 0; k < names.size(); ++k) text += (k == 0 ? ": '" : k + 1 < names.size() ? "', '" : "' or '") + names[k];
	return text + "'";
}

void refuseForce(const Scene& scene, Body::id_t id1, Body::id_t id2) {
	fail("the contact of bodies " + std::to_string(id1) + " and " + std::to_string(id2) + " has no finite force in step " +
	             std::to_string(scene.iter) + "; look at their positions, velocities and parameters, and at the time step",
	     1);
}

int LawKinds::of(const ::dembark::ContactParameters& p) {
	if (p.normal_law != ::dembark::NormalLaw::hertz || !packs_know(p.friction) ||
	    p.friction.presliding == ::dembark::Presliding::partial_slip || p.rolling.on() || p.cohesion.liquid.viscous.on())
		return -1;
	constexpr std::size_t most    = 64;
	const auto            numbers = [](const ::dembark::HertzParameters& e, const ::dembark::FinnieRabinowicz& f) {
		return std::make_tuple(e.effective_youngs_modulus, e.effective_shear_modulus, e.damping, f.static_friction,
		                       f.kinetic_friction, f.interface_shear_strength, f.healing_time, f.critical_slip_distance);
	};
	const std::lock_guard<std::mutex> lock(guard);
	const auto                        found = std::find_if(kinds.begin(), kinds.end(), [&](const Kind& kind) {
		return numbers(kind.elasticity, kind.friction) == numbers(p.elasticity, p.friction);
	});
	if (found == kinds.end() && kinds.size() == most) return -1;
	const auto number = static_cast<int>(found - kinds.begin());
	if (found == kinds.end()) kinds.push_back({p.elasticity, p.friction});
	return number;
}

void LawKinds::clear() {
	const std::lock_guard<std::mutex> lock(guard);
	kinds.clear();
}

std::vector<::dembark::PackedCoefficients<double>> LawKinds::laws(double dt) {
	const std::lock_guard<std::mutex>                  lock(guard);
	std::vector<::dembark::PackedCoefficients<double>> all;
	for (const Kind& kind : kinds) all.push_back(::dembark::packed_coefficients(kind, dt));
	return all;
}

}  // namespace dembark_yade

void Phys::get(::dembark::ContactState& now) const {
	now.friction      = {vec(elasticDisplacement), slip, dissipatedEnergy};
	now.cohesion      = {bridgeVolume, ruptureDistance};
	now.rolling_angle = vec(rollingAngle);
	if (contact.friction.presliding != ::dembark::Presliding::partial_slip) return;
	if (slipRings.size() == ringNumbers) std::memcpy(static_cast<void*>(&now.rings), slipRings.data(), sizeof now.rings);
	else now.rings = {};
}

::dembark::ContactState Phys::state() const {
	::dembark::ContactState now;
	get(now);
	return now;
}

void Phys::setState(const ::dembark::ContactState& now) {
	elasticDisplacement = vec(now.friction.displacement);
	slip                = now.friction.slip;
	dissipatedEnergy    = now.friction.dissipated_energy;
	bridgeVolume        = now.cohesion.bridge_volume;
	ruptureDistance     = now.cohesion.rupture_distance;
	rollingAngle        = vec(now.rolling_angle);
	if (contact.friction.presliding != ::dembark::Presliding::partial_slip) return;
	slipRings.resize(ringNumbers);
	std::memcpy(slipRings.data(), &now.rings, sizeof now.rings);
}

void Ip2::postLoad(Ip2&) {
	const decltype(friction) now{staticFriction, kineticFriction};
	if (std::exchange(friction, now) != now) frictionAngles.clear();
}

/// Refuses what of a material the law would disregard in silence.
void Ip2::check(const FrictMat& material) {
	const std::string name = "material " + std::to_string(material.id) + (material.label.empty() ? "" : " '" + material.label + "'");
	if (typeid(material) != typeid(FrictMat))
		fail(name + " is a " + material.getClassName() +
		     ", of which this law knows no more than young and poisson; use a FrictMat, and the attributes of the Ip2 functor");
	if (material.id < 0) return;  // of a single body: nothing says which one it was before
	const std::lock_guard<std::mutex> lock(guard);
	if (frictionAngles.size() <= std::size_t(material.id)) frictionAngles.resize(material.id + 1, NaN);
	Real& known = frictionAngles[material.id];
	if (std::isnan(known)) known = material.frictionAngle;
	if (known == material.frictionAngle) return;
	fail("FrictMat.frictionAngle of " + name + " changed from " + text(known) + " to " + text(material.frictionAngle) +
	     " rad, but this law does not use it" + useSetFriction);
}

void Ip2::go(const shared_ptr<Material>& material1, const shared_ptr<Material>& material2, const shared_ptr<Interaction>& interaction) try {
	if (interaction->phys) return;
	const FrictMat& a    = *YADE_CAST<FrictMat*>(material1.get());
	const FrictMat& b    = *YADE_CAST<FrictMat*>(material2.get());
	const auto      phys = shared_ptr<Phys>(new Phys());
	check(a);
	check(b);

	if (!(a.young > 0.0 && b.young > 0.0 && a.young < INFINITY && b.young < INFINITY))
		fail("FrictMat.young of " + pairName(a, b) + " must be > 0 Pa and finite");
	if (!(a.poisson > -1.0 && b.poisson > -1.0 && a.poisson <= 0.5 && b.poisson <= 0.5))
		fail("FrictMat.poisson of " + pairName(a, b) + " must be > -1 and <= 0.5");
	phys->effectiveYoungsModulus = ::dembark::effective_youngs_modulus(a.young, a.poisson, b.young, b.poisson);
	phys->effectiveShearModulus  = ::dembark::effective_shear_modulus(a.young, a.poisson, b.young, b.poisson);
	for (const Number& each : numbers) {
		const ::dembark::Parameter& p     = parameter(each.which);
		const std::string           name  = p.camel_case;
		Real                        value = each.ofPair ? pairValue(this->*each.ofPair, ip2 + name, a, b) : this->*each.ofAll;
		// A viscosity of 0 needs no gap.
		const bool noGap   = each.which == ContactNumber::minimum_gap && value == 0.0;
		const bool missing = std::isnan(value) && (each.ofPair || p.required());
		if (missing || noGap) {
			if (each.which == ContactNumber::restitution) fail(ip2 + name + " is not set; give it a number or a MatchMaker");
			// Without a volume materials are dry.
			phys.get()->*each.kept = each.which == ContactNumber::bridge_volume ? 0.0 : p.required() ? -1.0 : p.otherwise;
			continue;
		}
		if (!p.allows(value)) fail(::dembark::wrong_value(p, name, value) + ", " + pairName(a, b));
		// An infinite number would not survive saving to XML.
		phys.get()->*each.kept = std::min(value, 1e300);
	}
	read_friction({}, PhysSource<Material>(*phys, a, b));
	if (phys->newBridgeVolume > 0.0 && phys->surfaceTension < 0.0)
		fail(ip2 + "surfaceTension (N/m) is not set; a bridgeVolume needs it");
	if (phys->newBridgeVolume > 0.0 && phys->contactAngle < 0.0) fail(ip2 + "contactAngle is not set; a bridgeVolume needs it");
	interaction->phys = phys;
} catch (const std::exception& error) {
	dembark_yade::postpone(*scene, error);
	interaction->phys = shared_ptr<Phys>(new Phys());  // without values: the law lets go of it
}

void Law2::postLoad(Law2&) {
	static std::atomic<long> revisions{1};  // that of a law without a word is 1

	std::vector<std::string> models = ::dembark::capillary::model_names();
	models.insert(models.begin(), "none");
	int                       chosen = 0;
	::dembark::ContactOptions now;
	choose(law2 + "normalLaw", normalLaw, ::dembark::normal_law_names(), now.normal_law);
#define DEMBARK_CHOOSE(name, camel, type, first, names, doc) choose(law2 + #camel, camel, ::dembark::names(), now.name);
	DEMBARK_CONTACT_CHOICES(DEMBARK_CHOOSE)
#undef DEMBARK_CHOOSE
	choose(law2 + "cohesion", cohesion, ::dembark::cohesion_names(), now.cohesion);
	choose(law2 + "capillaryModel", capillaryModel, models, chosen);
	const bool dry = now.cohesion != ::dembark::CohesionLaw::none && now.cohesion != ::dembark::CohesionLaw::bridge;
	if (chosen > 0 && dry) fail(law2 + "capillaryModel is for the cohesion 'bridge', not for '" + cohesion + "'");
	if (chosen > 0) now.cohesion = ::dembark::CohesionLaw::bridge;
	now.capillary_model    = static_cast<::dembark::capillary::Model>(chosen > 0 ? chosen - 1 : 0);
	now.carried_liquid     = carriedLiquid;
	now.tangential_damping = tangentialDamping;
	now.limit_force        = limitForce;
	options                = now;
	// In this order: a contact that is prepared meanwhile has a kind of the new table, or is prepared again.
	kinds.clear();
	revision = -static_cast<double>(++revisions);
}

std::vector<::dembark::PackedCoefficients<double>> Law2::forPacks(::dembark::PairStep& step) {
	step.wet                = options.cohesion != ::dembark::CohesionLaw::none;
	step.limit_force        = options.limit_force;
	step.tangential_damping = options.tangential_damping;
	step.elastic_limit      = options.friction_limit == ::dembark::FrictionLimit::elastic;
	return kinds.laws(step.dt);
}

/// Once a step with new contacts: engines of the scene that take contacts for those of another law, and what adds to this law, or leaves it
/// out, without being a mistake.
void Law2::checkScene() {
	if (checked.exchange(scene->iter) == scene->iter) return;
	static const char* const foreign[] = {"Law2_ScGeom_CapillaryPhys_Capillarity", "CapillarityEngine", "ElasticContactLaw",
	                                      "CohesiveFrictionalContactLaw"};
	const auto               refuse    = [this](const std::string& what) {
		checked = -1;  // the step may be tried again
		fail(what);
	};
	std::string line;
	for (const auto& engine : scene->engines) {
		if (engine->dead) continue;
		const std::string name = engine->getClassName();
		if (std::find(std::begin(foreign), std::end(foreign), name) != std::end(foreign))
			refuse(name +
			       " in O.engines takes every contact for one of its own law and writes into it; leave it out: liquid here "
			       "is " +
			       law2 + "capillaryModel and " + ip2 + "bridgeVolume");
		if (const auto* stepper = dynamic_cast<const GlobalStiffnessTimeStepper*>(engine.get()); stepper && stepper->viscEl)
			refuse("GlobalStiffnessTimeStepper.viscEl takes every contact for a ViscElPhys; set it to False");
		if (const auto* newton = dynamic_cast<const NewtonIntegrator*>(engine.get()); newton && newton->damping != 0.0)
			line = "NewtonIntegrator.damping is " + text(newton->damping) +
			       " (YADE's default is 0.2): it takes energy in addition to the restitution of this law; damping=0 leaves it "
			       "off";
	}
	if (scene->trackEnergy)
		line += (line.empty() ? "" : ". ") +
		        std::string("O.trackEnergy: O.energy holds nothing of this law's contacts; EnergyAccount does");
	if (!line.empty() && !warned.exchange(true)) dembark_yade::warn(line);
}

void Law2::prepare(Phys& phys, const Body& body1, const Body& body2) {
	const double current = revision;
	if (!(phys.preparedBy < 0.0))
		fail("setContactFriction(), or an engine of YADE that does the same, set the friction coefficient of " +
		     pairName(body1, body2) + " to " + text(phys.preparedBy) + ", but this law does not use it" + useSetFriction);
	checkScene();
	const bool sphere1 = dynamic_cast<const Sphere*>(body1.shape.get()), sphere2 = dynamic_cast<const Sphere*>(body2.shape.get());
	if (!sphere1 && !sphere2)
		fail(pairName(body1, body2) +
		     " are both no spheres; the Finnie-Rabinowicz law knows a sphere with a sphere or with a wall");
	phys.wallBody = sphere1 ? (sphere2 ? 0 : 2) : 1;

	const PhysSource<Body>       source(phys, body1, body2, characteristicVelocity);
	const bool                   wet = options.cohesion == ::dembark::CohesionLaw::bridge;
	::dembark::ContactParameters p   = ::dembark::chosen_laws(options);
	p.elasticity                     = {phys.effectiveYoungsModulus, phys.effectiveShearModulus, phys.restitution};
	p.characteristic_velocity        = characteristicVelocity;
	refuse_switched_off(options, source, true);
	p.friction = read_friction(options, source);
	p.rolling  = read_rolling(options, source);
	if (carriedLiquid && !wet) fail(law2 + "carriedLiquid needs a capillaryModel other than none");
	// Materials without a bridge volume stay dry among wet ones, until a bridge of theirs is read from a file.
	::dembark::ContactOptions own = options;
	if (wet && !carriedLiquid && !(phys.newBridgeVolume > 0.0) && !(phys.bridgeVolume > 0.0))
		own.cohesion = ::dembark::CohesionLaw::none;
	own.viscous       = phys.liquidViscosity > 0.0;
	p.cohesion        = read_cohesion(own, source);
	const auto radius = [](const Body& body) {
		const auto* const sphere = dynamic_cast<const Sphere*>(body.shape.get());
		return sphere ? sphere->radius : 0.0;
	};
	const std::string line =
		::dembark::wrong_bridge_volume("bridgeVolume", p.cohesion.liquid.bridge_volume, std::max(radius(body1), radius(body2)));
	if (!line.empty()) source.wrong(line);
	phys.contact = p;
	// Packs do not write what the law would set to zero.
	phys.kind = phys.wallBody || carriedLiquid || (phys.ruptureDistance > 0.0 && !p.cohesion.holds()) ? -1 : kinds.of(p);
	if (phys.kind >= 0) {
		phys.viscousForce  = 0.0;
		phys.rollingTorque = Vector3r::Zero();
		if (!p.cohesion.on()) phys.capillaryForce = 0.0;
	}
	if (!p.cohesion.liquid.viscous.on()) phys.viscousShearForce = Vector3r::Zero();

	if (options.normal_law == ::dembark::NormalLaw::hooke && !(characteristicVelocity > 0.0))
		fail(law2 + "characteristicVelocity must be > 0 m/s for normalLaw='hooke'");
	phys.preparedBy = current;
}

/// Tells CapillaryLiquid, after the forces are known, that the contact touches without a bridge, or that its bridge broke.
void Law2::reportBridge(Phys& phys, const Interaction& interaction, const ::dembark::ContactBodies& bodies, double overlap,
                        double volumeBefore) {
	if (phys.bridgeVolume > 0.0) return;
	const bool                              swapped = phys.wallBody == 1, wall = phys.wallBody != 0;
	const Body::id_t                        id1 = interaction.getId1(), id2 = interaction.getId2();
	const ::dembark::capillary::BridgeSides sides{swapped ? id2 : id1, swapped ? id1 : id2, wall};
	if (volumeBefore > 0.0) {
		exchange->bridgeBroke(scene->iter, {sides, volumeBefore, phys.bridgeImbalance});
		phys.bridgeImbalance = 0.0;
	} else if (overlap > 0.0) {
		exchange->requestBridge(scene->iter, {{sides, bodies.radius_1, bodies.radius_2}, &phys});
	}
}

::dembark::ContactForce Law2::act(Phys& phys, const Interaction& interaction, const ContactView& view) {
	const Body::id_t id1 = interaction.getId1(), id2 = interaction.getId2();
	const double     volumeBefore = phys.bridgeVolume;
	const bool       viscous      = phys.contact.cohesion.liquid.viscous.on();
	// In every step: engines that choose the time step lengthen it, and grains grow.
	if (viscous) {
		const double limit =
			phys.contact.cohesion.liquid.stable_time_step(view.bodies.effective_radius(), view.bodies.effective_mass());
		if (scene->dt > limit)
			fail(pairName(*Body::byId(id1, scene), *Body::byId(id2, scene)) + ": their viscous bridge needs O.dt <= " +
			     text(limit) + " s, not " + text(scene->dt) + " s, or a larger minimumGap");
	}
	// Kept: eight rings of zeros in every step would cost more than the friction.
	static thread_local ::dembark::ContactState state;
	phys.get(state);
	const ::dembark::ContactForce out = ::dembark::contact_step(phys.contact, view.bodies, scene->dt, state);
	// A comparison with what is no number is false: such a contact would vanish without a word.
	if (!std::isfinite(out.overlap + out.force.x + out.force.y + out.force.z)) dembark_yade::refuseForce(*scene, id1, id2);

	if (!(out.overlap > 0.0) && phys.dissipatedEnergy > 0.0) endedDissipation += phys.dissipatedEnergy;
	phys.setState(state);
	phys.capillaryForce = out.cohesive_force;
	phys.viscousForce   = out.viscous_normal;
	if (carriedLiquid) reportBridge(phys, interaction, view.bodies, out.overlap, volumeBefore);
	if (!out.interacting) return out;

	const Vector3r force      = vec(out.force);
	const Vector3r tangential = vec(out.tangential + out.viscous_tangential);
	phys.shearForce           = view.sign() * tangential;
	phys.normalForce          = view.sign() * (force - tangential);
	if (viscous) phys.viscousShearForce = view.sign() * vec(out.viscous_tangential);
	phys.rollingTorque = view.sign() * vec(out.rolling);
	phys.kn            = out.normal_stiffness;
	phys.ks            = out.tangential_stiffness;

	const Body::id_t first = view.swapped() ? id2 : id1, second = view.swapped() ? id1 : id2;
	scene->forces.addForce(first, force);
	scene->forces.addForce(second, -force);
	if (out.overlap > 0.0 || viscous) {
		scene->forces.addTorque(first, vec(out.torque_1));
		scene->forces.addTorque(second, vec(out.torque_2));
	}
	if (phys.wallBody) scene->forces.addTorque(second, -view.surface.cross(force));
	return out;
}

bool Law2::go(shared_ptr<IGeom>& igeom, shared_ptr<IPhys>& iphys, Interaction* interaction) try {
	const ScGeom& geom = *static_cast<ScGeom*>(igeom.get());
	Phys&         phys = *static_cast<Phys*>(iphys.get());
	if (dembark_yade::postponed(*scene)) return phys.effectiveYoungsModulus > 0.0;
	const Body::id_t id1 = interaction->getId1(), id2 = interaction->getId2();
	const Body&      body1  = *Body::byId(id1, scene);
	const Body&      body2  = *Body::byId(id2, scene);
	const State&     state1 = *body1.state;
	const State&     state2 = *body2.state;
	if (phys.preparedBy != revision) prepare(phys, body1, body2);

	ContactView view(phys.wallBody, geom, body1, body2, dembark_yade::imageShift(*scene, interaction->cellDist));

	const bool free1 = phys.wallBody != 1 && body1.isDynamic(), free2 = phys.wallBody != 2 && body2.isDynamic();
	if (!free1 && !free2) {  // nothing that they do to each other has an effect
		phys.normalForce = phys.shearForce = phys.rollingTorque = Vector3r::Zero();
		if (const double volume = phys.bridgeVolume; carriedLiquid && volume > 0.0) {
			::dembark::CohesionState state{volume, phys.ruptureDistance};
			cohesion_step(phys.contact.cohesion, {geom.radius1, geom.radius2, -geom.penetrationDepth, false, 0.0}, state);
			phys.bridgeVolume    = state.bridge_volume;
			phys.ruptureDistance = state.rupture_distance;
			reportBridge(phys, *interaction, view.bodies, geom.penetrationDepth, volume);
		}
		return geom.penetrationDepth > 0.0 || phys.ruptureDistance > 0.0;
	}

	if (phys.wallBody && !((phys.wallBody == 1 ? geom.radius2 : geom.radius1) > geom.penetrationDepth))
		fail("the centre of sphere " + std::to_string(phys.wallBody == 1 ? id2 : id1) + " went through wall " +
		             std::to_string(phys.wallBody == 1 ? id1 : id2) + " in step " + std::to_string(scene->iter) +
		             "; take a smaller time step or a stiffer material",
		     1);
	view.move(state1.vel, state1.angVel, state2.vel + dembark_yade::imageDrift(*scene, interaction->cellDist), state2.angVel);
	return act(phys, *interaction, view).interacting;
} catch (const std::exception& error) {
	dembark_yade::postpone(*scene, error);
	return true;
}

namespace {

/// Of value(interaction, phys) over all contacts.
template <class Value>
double sum(Value value) {
	double total = 0.0;
	// Not the functor's own pointer, which is not set before the first step after loading.
	for (const auto& interaction : *Omega::instance().getScene()->interactions) {
		if (!interaction->isReal()) continue;
		if (const auto* phys = dynamic_cast<const Phys*>(interaction->phys.get())) total += value(*interaction, *phys);
	}
	return total;
}

}  // namespace

Real Law2::getDissipatedEnergy() const {
	return (Real)endedDissipation + sum([](const Interaction&, const Phys& phys) { return phys.dissipatedEnergy; });
}

long Law2::bridgeCount() const {
	return static_cast<long>(sum([](const Interaction&, const Phys& phys) { return phys.bridgeVolume > 0.0; }));
}

long Law2::contactCount() const {
	return static_cast<long>(sum([](const Interaction& interaction, const Phys&) {
		return static_cast<const ScGeom*>(interaction.geom.get())->penetrationDepth > 0.0;
	}));
}

}  // namespace yade
