#include "ContactPacks.hpp"

#include <tuple>
#include <typeinfo>

#include <core/Scene.hpp>
#include <pkg/common/Sphere.hpp>

#include "ContactView.hpp"
#include "engine_access.hpp"
#include "report.hpp"

namespace yade::dembark_yade {

void Spheres::set(long at, const Vector3r& pos, const Vector3r& vel, const Vector3r& angVel, Real radius, Real mass) {
	Vector3r::Map(&places[3 * at])     = pos;
	Vector3r::Map(&velocities[3 * at]) = vel;
	Vector3r::Map(&spins[3 * at])      = angVel;
	radii[at]                          = radius;
	masses[at]                         = mass;
	fixed[at]                          = std::isinf(mass);
}

void Spheres::collect(const Scene& scene, int threads) {
	count            = static_cast<long>(scene.bodies->size());
	const auto rooms = static_cast<std::size_t>(count + long(threads) * ::dembark::PairBlock::room);
	places.resize(3 * rooms);
	velocities.resize(3 * rooms);
	spins.resize(3 * rooms);
	radii.resize(rooms);
	masses.resize(rooms);
	fixed.resize(rooms);
	isSphere.resize(count);
	anyHeld = false;
	for (long id = 0; id < count; ++id) {
		const Body* const body = (*scene.bodies)[id].get();
		const auto* const sphere =
			body && body->shape && typeid(*body->shape) == typeid(Sphere) ? static_cast<Sphere*>(body->shape.get()) : nullptr;
		isSphere[id] = sphere && !body->isClump();
#ifdef YADE_MPI
		isSphere[id] = isSphere[id] && body->subdomain == scene.subdomain;
#endif
		if (!isSphere[id]) continue;
		const State& state = *body->state;
		set(id, state.pos, state.vel, state.angVel, sphere->radius, inertialMass(*body));
		anyHeld = anyHeld || fixed[id];
	}
}

int Spheres::addImage(int thread, int k, Body::id_t id, const Vector3r& shift, const Vector3r& drift) {
	const long at = count + long(thread) * ::dembark::PairBlock::room + k;
	set(at, pos(id) + shift, vel(id) + drift, angVel(id), radii[id], masses[id]);
	return static_cast<int>(at);
}

void Spheres::describe(::dembark::PairStep& step) const {
	step.x      = places.data();
	step.v      = velocities.data();
	step.omega  = spins.data();
	step.radius = radii.data();
	step.mass   = masses.data();
	step.mask   = fixed.data();
	step.frozen = anyHeld;
}

const ::dembark::PairLoops& ContactPacks::loops() {
	static const ::dembark::PairLoops chosen = ::dembark::PairLoops::choose();
	return chosen;
}

ContactPacks::ContactPacks(Scene& ofScene, Spheres& ofSpheres, Law* law) : scene(ofScene), spheres(ofSpheres), step{*this} {
	spheres.describe(step);
	step.results       = this;
	step.dt            = scene.dt;
	step.pack_friction = scene.dt > 0.0;
	if (law) kinds = law->forPacks(step);
	step.laws                 = kinds.data();
	step.one_law              = kinds.size() == 1;
	std::tie(forces, torques) = threadForces(scene);
}

void ContactPacks::add(const Interaction& interaction, FinnieRabinowiczPhys& data) {
	if (waiting == Block::capacity) finish();
	const int        k   = waiting++;
	const Body::id_t id2 = interaction.getId2();
	block.grain[k]       = interaction.getId1();
	block.partner[k]     = id2;
	if (crosses(scene, interaction.cellDist))
		block.partner[k] = spheres.addImage(threadNumber(), k, id2, imageShift(scene, interaction.cellDist),
		                                    imageDrift(scene, interaction.cellDist));
	block.law_index[k]          = data.kind;
	block.history[k]            = histories[k];
	partner[k]                  = id2;
	phys[k]                     = &data;
	geom[k]                     = static_cast<ScGeom*>(interaction.geom.get());
	Vector3r::Map(histories[k]) = data.elasticDisplacement;
	histories[k][3]             = data.slip;
	histories[k][4]             = data.dissipatedEnergy;
}

void ContactPacks::finish() {
	const int found = std::exchange(waiting, 0);
	if (postponed(scene)) return;
	loops().picked(step, block, found);
	done += found;
}

ContactPacks::Vec3 ContactPacks::friction(const Block& b, int k, const Vec3& normal, double twist,
                                          const ::dembark::NormalResponse<double>& response, const Vec3& velocity) {
	auto       state = ::dembark::load_friction(b.history[k]);
	const Vec3 force = contact_friction(phys[k]->contact.friction, normal, twist, response, velocity, step.dt, state, nullptr);
	::dembark::store_friction(b.history[k], state);
	return force;
}

void ContactPacks::bridges(const Block& b, int first, int count, const double* gap, double* cohesiveForce) {
	for (int n = 0; n < count; ++n) {
		FinnieRabinowiczPhys&               data    = *phys[first + n];
		const Real                          radius1 = step.radius[b.grain[first + n]], radius2 = step.radius[b.partner[first + n]];
		const ::dembark::ContactParameters& p = data.contact;
		::dembark::CohesionState            state{data.bridgeVolume, data.ruptureDistance};
		cohesiveForce[n] = data.capillaryForce =
			cohesion_step(p.cohesion, {radius1, radius2, gap[n], true, p.elasticity.effective_youngs_modulus}, state);
		data.bridgeVolume    = state.bridge_volume;
		data.ruptureDistance = state.rupture_distance;
	}
}

void ContactPacks::store(const Block& b, int first, int count, const ::dembark::PackResults& results) {
	const auto vector = [](const double* row) { return Vector3r(row[0], row[1], row[2]); };
	for (int n = 0; n < count; ++n) {
		const int        k   = first + n;
		const Body::id_t id1 = b.grain[k], id2 = partner[k];
		const Vector3r   force = vector(results.force[n]), moment = vector(results.moment[n]);
		if (!std::isfinite(force[0] + force[1] + force[2])) refuseForce(scene, id1, id2);
		forces[id1] += force;
		forces[id2] += -force;
		torques[id1] += -results.force[n][3] * moment;
		torques[id2] += -results.moment[n][3] * moment;

		FinnieRabinowiczPhys& data = *phys[k];
		data.elasticDisplacement   = Vector3r::Map(histories[k]);
		data.slip                  = histories[k][3];
		data.dissipatedEnergy      = histories[k][4];
		data.normalForce           = -vector(results.normal[n]);
		data.shearForce            = -vector(results.friction[n]);
		data.kn                    = results.normal[n][3];
		data.ks                    = results.friction[n][3];
		const long second          = b.partner[k];
		setSphereGeometry(*geom[k], spheres.pos(id1), spheres.radius(id1), spheres.pos(second), spheres.radius(second));
	}
}

}  // namespace yade::dembark_yade
