#include "FinnieRabinowicz.hpp"

#include <atomic>
#include <deque>
#include <mutex>
#include <type_traits>

#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <pkg/common/Sphere.hpp>

#include "ContactView.hpp"
#include "report.hpp"

namespace yade {

YADE_PLUGIN((FinnieRabinowiczPhys)(Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys)(Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz));

static_assert(std::is_same<Real, double>::value, "dembark's laws need a YADE built with REAL_PRECISION_BITS=64");

using dembark_yade::ContactView;
using dembark_yade::fail;
using dembark_yade::text;
using dembark_yade::vec;

namespace {

std::string pairName(const Material& a, const Material& b) { return "materials " + std::to_string(a.id) + " and " + std::to_string(b.id); }

/// Value of a pair parameter; one that was not given is `fallback`, or an error when that is NaN.
double pairValue(const shared_ptr<MatchMaker>& maker, const char* name, const Material& a, const Material& b, double fallback = NaN) {
	const std::string attribute = std::string("Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys.") + name;
	if (!maker) {
		if (!std::isnan(fallback)) return fallback;
		fail(attribute + " is not set; give it a number or a MatchMaker");
	}
	double value = NaN;
	try {
		value = (*maker)(a.id, b.id);
	} catch (const std::exception&) {
	}
	if (std::isnan(value)) fail(attribute + " has no value for " + pairName(a, b) + "; add the pair to its MatchMaker.matches");
	return value;
}

/// The force law of one model and angle, built once for all contacts; stays valid until the process ends.
const ::dembark::capillary::BridgeForce* bridgeForce(::dembark::capillary::Model model, double angle) {
	static std::mutex                                    guard;
	static std::deque<::dembark::capillary::BridgeForce> built;
	const std::lock_guard<std::mutex>                    lock(guard);
	for (const auto& force : built)
		if (force.model() == model && force.contact_angle() == angle) return &force;
	try {
		built.emplace_back(model, angle);
	} catch (const std::exception& error) {
		fail(std::string("Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys.contactAngle: ") + error.what());
	}
	return &built.back();
}

}  // namespace

void Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys::go(const shared_ptr<Material>& material1, const shared_ptr<Material>& material2,
                                                    const shared_ptr<Interaction>& interaction) {
	if (interaction->phys) return;
	const FrictMat& a    = *YADE_CAST<FrictMat*>(material1.get());
	const FrictMat& b    = *YADE_CAST<FrictMat*>(material2.get());
	const auto      phys = shared_ptr<FinnieRabinowiczPhys>(new FinnieRabinowiczPhys());

	if (!(a.young > 0.0 && b.young > 0.0 && a.young < INFINITY && b.young < INFINITY))
		fail("FrictMat.young of " + pairName(a, b) + " must be > 0 Pa and finite");
	if (!(a.poisson > -1.0 && b.poisson > -1.0 && a.poisson <= 0.5 && b.poisson <= 0.5))
		fail("FrictMat.poisson of " + pairName(a, b) + " must be > -1 and <= 0.5");
	phys->effectiveYoungsModulus = ::dembark::effective_youngs_modulus(a.young, a.poisson, b.young, b.poisson);
	phys->effectiveShearModulus  = ::dembark::effective_shear_modulus(a.young, a.poisson, b.young, b.poisson);
	phys->restitution            = pairValue(restitution, "restitution", a, b);
	if (!(phys->restitution > 0.0 && phys->restitution <= 1.0))
		fail("restitution of " + pairName(a, b) + " is " + text(phys->restitution) + "; it must be > 0 and <= 1");

	::dembark::FinnieRabinowicz law;
	law.static_friction = phys->staticFriction = pairValue(staticFriction, "staticFriction", a, b);
	law.kinetic_friction = phys->kineticFriction = pairValue(kineticFriction, "kineticFriction", a, b);
	law.critical_slip_distance = phys->criticalSlipDistance = pairValue(criticalSlipDistance, "criticalSlipDistance", a, b);
	law.interface_shear_strength = pairValue(interfaceShearStrength, "interfaceShearStrength", a, b, ::dembark::unlimited_strength);
	// An infinite number would not survive saving to XML.
	phys->interfaceShearStrength = law.interface_shear_strength > 1e300 ? 1e300 : law.interface_shear_strength;
	law.healing_time = phys->healingTime = healingTime;
	if (const char* wrong = law.error()) fail(std::string(wrong) + ", " + pairName(a, b));

	phys->newBridgeVolume = pairValue(bridgeVolume, "bridgeVolume", a, b, 0.0);
	if (!(phys->newBridgeVolume >= 0.0 && phys->newBridgeVolume < INFINITY))
		fail("bridgeVolume of " + pairName(a, b) + " is " + text(phys->newBridgeVolume) + "; it must be >= 0 m^3 and finite");
	phys->wettable = phys->newBridgeVolume > 0.0 || (contactAngle && !std::isnan(surfaceTension));
	if (phys->wettable) {
		if (!(surfaceTension >= 0.0 && surfaceTension < INFINITY))
			fail("Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys.surfaceTension must be a finite number >= 0 N/m when bridgeVolume "
			     "is > 0");
		phys->surfaceTension = surfaceTension;
		phys->contactAngle   = pairValue(contactAngle, "contactAngle", a, b);
		if (const char* wrong = ::dembark::capillary::ViscousLiquid{liquidViscosity, minimumGap}.error())
			fail(std::string("Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys.liquidViscosity, minimumGap: ") + wrong);
		phys->liquidViscosity = liquidViscosity;
		phys->minimumGap      = minimumGap;
	}
	interaction->phys = phys;
}

void Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::postLoad(Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz&) {
	static std::atomic<long> revisions{0};
	const std::string        name = "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz.";

	if (normalLaw == "hertz") normal = ::dembark::NormalLaw::hertz;
	else if (normalLaw == "hooke") normal = ::dembark::NormalLaw::hooke;
	else fail(name + "normalLaw is '" + normalLaw + "'; it must be hertz or hooke");

	if (presliding == "linear") path = ::dembark::Presliding::linear;
	else if (presliding == "exponential") path = ::dembark::Presliding::exponential;
	else fail(name + "presliding is '" + presliding + "'; it must be linear or exponential");

	wet = capillaryModel != "none";
	if (wet && !::dembark::capillary::model_from_name(capillaryModel.c_str(), model)) {
		std::string known = "none";
		for (const std::string& each : ::dembark::capillary::model_names()) known += ", " + each;
		fail(name + "capillaryModel is '" + capillaryModel + "'; it must be one of " + known);
	}
	revision = ++revisions;
}

void Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::prepare(FinnieRabinowiczPhys& phys, const ScGeom& geom, const Body& body1,
                                                                const Body& body2) const {
	const bool sphere1 = dynamic_cast<const Sphere*>(body1.shape.get()), sphere2 = dynamic_cast<const Sphere*>(body2.shape.get());
	if (!sphere1 && !sphere2)
		fail("bodies " + std::to_string(body1.getId()) + " and " + std::to_string(body2.getId()) +
		     " are both no spheres; the Finnie-Rabinowicz law knows a sphere with a sphere or with a wall");
	phys.wallBody = sphere1 ? (sphere2 ? 0 : 2) : 1;

	::dembark::ContactParameters p;
	p.normal_law              = normal;
	p.elasticity              = {phys.effectiveYoungsModulus, phys.effectiveShearModulus, phys.restitution};
	p.characteristic_velocity = characteristicVelocity;
	p.tangential_damping      = tangentialDamping;
	p.limit_force             = limitForce;
	p.friction                = {phys.staticFriction,         phys.kineticFriction, phys.criticalSlipDistance,
	                             phys.interfaceShearStrength, phys.healingTime,     path};
	if (carriedLiquid) {
		const std::string name = "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz.carriedLiquid";
		if (!wet) fail(name + " needs a capillaryModel other than none");
		if (!phys.wettable) fail(name + " needs surfaceTension and contactAngle of Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys");
		if (phys.newBridgeVolume > 0.0)
			fail(name +
			     ": bridgeVolume of Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys must not be given, bridges take what the bodies "
			     "carry");
	}
	if (wet && (carriedLiquid || phys.newBridgeVolume > 0.0 || phys.bridgeVolume > 0.0))
		p.liquid = {bridgeForce(model, phys.contactAngle),
		            phys.surfaceTension,
		            phys.newBridgeVolume,
		            {phys.liquidViscosity, phys.minimumGap}};
	phys.contact = p;
	if (!p.liquid.viscous.on()) phys.viscousShearForce = Vector3r::Zero();

	const double r1 = phys.wallBody == 1 ? INFINITY : geom.radius1, r2 = phys.wallBody == 2 ? INFINITY : geom.radius2;
	const double m1 = phys.wallBody != 1 && body1.isDynamic() ? body1.state->mass : INFINITY;
	const double m2 = phys.wallBody != 2 && body2.isDynamic() ? body2.state->mass : INFINITY;
	if (p.liquid.viscous.on() && !(std::isinf(m1) && std::isinf(m2))) {
		const double limit = ::dembark::capillary::viscous_time_step(p.liquid.viscous, 2.0 * ::dembark::reduced(r1, r2),
		                                                             ::dembark::reduced(m1, m2));
		if (scene->dt > limit)
			fail("bodies " + std::to_string(body1.getId()) + " and " + std::to_string(body2.getId()) +
			     ": their viscous bridge needs O.dt <= " + text(limit) + " s, not " + text(scene->dt) +
			     " s, or a larger minimumGap");
	}

	phys.linearStiffness = 0.0;
	if (normal == ::dembark::NormalLaw::hooke) {
		if (!(characteristicVelocity > 0.0))
			fail("Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz.characteristicVelocity must be > 0 m/s for "
			     "normalLaw='hooke'");
		phys.linearStiffness =
			::dembark::hooke(::dembark::HookeParameters{phys.effectiveYoungsModulus, phys.restitution, characteristicVelocity},
			                 ::dembark::reduced(r1, r2), ::dembark::reduced(m1, m2), 1.0, 0.0)
				.force;
	}
	phys.preparedBy = revision;
}

/// What the contact asks for, or gives back, after its forces are known.
void Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::trade(FinnieRabinowiczPhys& phys, const ScGeom& geom,
                                                              const Interaction& interaction, double volumeBefore) {
	if (phys.bridgeVolume > 0.0) return;
	Body::id_t first = interaction.getId1(), second = interaction.getId2();
	double     firstRadius = geom.radius1, secondRadius = phys.wallBody == 2 ? INFINITY : geom.radius2;
	if (phys.wallBody == 1) {
		std::swap(first, second);
		firstRadius  = geom.radius2;
		secondRadius = INFINITY;
	}
	if (volumeBefore > 0.0) {
		exchange->giveBack(scene->iter, {first, second, volumeBefore, phys.bridgeImbalance, phys.wallBody != 0});
		phys.bridgeImbalance = 0.0;
	} else if (geom.penetrationDepth > 0.0) {
		exchange->ask(scene->iter, {first, second, firstRadius, secondRadius, &phys});
	}
}

bool Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::go(shared_ptr<IGeom>& igeom, shared_ptr<IPhys>& iphys, Interaction* interaction) {
	const ScGeom&         geom = *static_cast<ScGeom*>(igeom.get());
	FinnieRabinowiczPhys& phys = *static_cast<FinnieRabinowiczPhys*>(iphys.get());
	const Body::id_t      id1 = interaction->getId1(), id2 = interaction->getId2();
	const Body&           body1  = *Body::byId(id1, scene);
	const Body&           body2  = *Body::byId(id2, scene);
	const State&          state1 = *body1.state;
	const State&          state2 = *body2.state;
	if (phys.preparedBy != revision) prepare(phys, geom, body1, body2);

	const bool free1 = phys.wallBody != 1 && body1.isDynamic(), free2 = phys.wallBody != 2 && body2.isDynamic();
	if (!free1 && !free2) {  // nothing that they do to each other has an effect
		phys.normalForce = phys.shearForce = Vector3r::Zero();
		if (carriedLiquid && phys.bridgeVolume > 0.0) {
			const double volume = phys.bridgeVolume;
			if (-geom.penetrationDepth > phys.ruptureDistance) phys.bridgeVolume = phys.ruptureDistance = 0.0;
			trade(phys, geom, *interaction, volume);
		}
		return geom.penetrationDepth > 0.0 || phys.bridgeVolume > 0.0;
	}

	Vector3r shift = Vector3r::Zero(), shiftVelocity = Vector3r::Zero();
	if (scene->isPeriodic && !interaction->cellDist.isZero()) {
		shift         = scene->cell->intrShiftPos(interaction->cellDist);
		shiftVelocity = scene->cell->intrShiftVel(interaction->cellDist);
	}

	if (phys.wallBody && !((phys.wallBody == 1 ? geom.radius2 : geom.radius1) > geom.penetrationDepth))
		fail("the centre of sphere " + std::to_string(phys.wallBody == 1 ? id2 : id1) + " went through wall " +
		             std::to_string(phys.wallBody == 1 ? id1 : id2) + " in step " + std::to_string(scene->iter) +
		             "; take a smaller time step or a stiffer material",
		     1);
	ContactView view(phys.wallBody, geom, body1, body2, shift);
	view.move(state1.vel, state1.angVel, state2.vel + shiftVelocity, state2.angVel);
	const ::dembark::ContactBodies& bodies = view.bodies;

	::dembark::ContactState state;
	state.friction.displacement      = vec(phys.elasticDisplacement);
	state.friction.slip              = phys.slip;
	state.friction.dissipated_energy = phys.dissipatedEnergy;
	state.bridge_volume              = phys.bridgeVolume;
	state.rupture_distance           = phys.ruptureDistance;

	const double volumeBefore = phys.bridgeVolume;

	const ::dembark::ContactForce out = ::dembark::contact_step(phys.contact, bodies, scene->dt, state);
	// A comparison with what is no number is false: such a contact would vanish without a word.
	if (!std::isfinite(out.overlap + out.force.x + out.force.y + out.force.z))
		fail("the contact of bodies " + std::to_string(id1) + " and " + std::to_string(id2) + " has no finite force in step " +
		             std::to_string(scene->iter) + "; look at their positions, velocities and parameters, and at the time step",
		     1);

	if (!(out.overlap > 0.0) && phys.dissipatedEnergy > 0.0) endedDissipation += phys.dissipatedEnergy;
	phys.elasticDisplacement = vec(state.friction.displacement);
	phys.slip                = state.friction.slip;
	phys.dissipatedEnergy    = state.friction.dissipated_energy;
	phys.bridgeVolume        = state.bridge_volume;
	phys.ruptureDistance     = state.rupture_distance;
	phys.capillaryForce      = out.capillary_force;
	phys.viscousForce        = out.viscous_normal;
	if (carriedLiquid) trade(phys, geom, *interaction, volumeBefore);
	if (!out.interacting) return false;

	const Vector3r force      = vec(out.force);
	const Vector3r tangential = vec(out.tangential + out.viscous_tangential);
	const bool     turns      = out.overlap > 0.0 || phys.contact.liquid.viscous.on();
	phys.shearForce           = view.sign() * tangential;
	phys.normalForce          = view.sign() * (force - tangential);
	if (phys.contact.liquid.viscous.on()) phys.viscousShearForce = view.sign() * vec(out.viscous_tangential);
	if (out.overlap > 0.0) {
		const double radius =
			phys.wallBody ? bodies.radius_1 : bodies.radius_1 * bodies.radius_2 / (bodies.radius_1 + bodies.radius_2);
		if (normal == ::dembark::NormalLaw::hertz) {
			const double root = std::sqrt(radius * out.overlap);
			phys.kn           = 2.0 * phys.effectiveYoungsModulus * root;
			phys.ks           = 8.0 * phys.effectiveShearModulus * root;
		} else {
			phys.kn = phys.ks = phys.linearStiffness;
		}
	} else {
		phys.kn = phys.ks = 0.0;
	}

	const Body::id_t first = view.swapped() ? id2 : id1, second = view.swapped() ? id1 : id2;
	scene->forces.addForce(first, force);
	scene->forces.addForce(second, -force);
	if (turns) scene->forces.addTorque(first, vec(out.torque_1));
	if (phys.wallBody == 0) {
		if (turns) scene->forces.addTorque(second, vec(out.torque_2));
	} else {
		scene->forces.addTorque(second, -view.surface.cross(force));
	}
	return true;
}

namespace {

template <class Visit>
void visitContacts(Visit visit) {
	// Not the functor's own pointer, which is not set before the first step after loading.
	for (const auto& interaction : *Omega::instance().getScene()->interactions) {
		if (!interaction->isReal()) continue;
		if (const auto* phys = dynamic_cast<const FinnieRabinowiczPhys*>(interaction->phys.get())) visit(*interaction, *phys);
	}
}

}  // namespace

Real Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::getDissipatedEnergy() const {
	Real sum = (Real)endedDissipation;
	visitContacts([&](const Interaction&, const FinnieRabinowiczPhys& phys) { sum += phys.dissipatedEnergy; });
	return sum;
}

long Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::bridgeCount() const {
	long count = 0;
	visitContacts([&](const Interaction&, const FinnieRabinowiczPhys& phys) { count += phys.bridgeVolume > 0.0; });
	return count;
}

long Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::contactCount() const {
	long count = 0;
	visitContacts([&](const Interaction& interaction, const FinnieRabinowiczPhys&) {
		count += static_cast<const ScGeom*>(interaction.geom.get())->penetrationDepth > 0.0;
	});
	return count;
}

}  // namespace yade
