#include "ContactWorks.hpp"

#include <algorithm>
#include <exception>
#include <mutex>
#include <typeinfo>

#include <core/Scene.hpp>

#include "FinnieRabinowicz.hpp"
#include "report.hpp"

namespace yade::dembark_yade {

using ::dembark::ContactPart;
using ::dembark::cross;
using ::dembark::dofs;
using ::dembark::dot;

void ContactWorks::Stored::add(const Stored& other) {
	normal += other.normal;
	tangential += other.tangential;
	half += other.half;
}

/// The sum of what `visit(index, sums)` adds, over blocks of one length in their order: it does not depend on the number of threads.
template <class Sums, class Visit>
Sums ContactWorks::overAll(int threads, Visit visit) {
	constexpr long    size  = 256;
	const long        count = static_cast<long>(contacts.size()), blocks = (count + size - 1) / size;
	std::vector<Sums> partial(blocks);
	// No exception may leave the threads.
	std::exception_ptr wrong;
	std::mutex         guard;
#ifdef YADE_OPENMP
#pragma omp parallel for schedule(static) num_threads(threads > 0 ? std::min(threads, omp_get_max_threads()) : omp_get_max_threads())
#else
	(void)threads;
#endif
	for (long block = 0; block < blocks; ++block) {
		try {
			for (long i = block * size; i < std::min(count, (block + 1) * size); ++i) visit(i, partial[block]);
		} catch (...) {
			const std::lock_guard<std::mutex> lock(guard);
			wrong = std::current_exception();
		}
	}
	if (wrong) std::rethrow_exception(wrong);
	Sums total;
	for (const Sums& each : partial) total.add(each);
	return total;
}

ContactWorks::Stored ContactWorks::record(Scene& scene, int threads) {
	const auto& interactions = *scene.interactions;
	contacts.resize(scene.interactions->size());
	return overAll<Stored>(threads, [&](long i, Stored& sums) { recordOne(contacts[i], *interactions[i], scene, sums); });
}

void ContactWorks::recordOne(Contact& c, const Interaction& interaction, Scene& scene, Stored& sums) const {
	c.acting = false;
	if (!interaction.isReal()) return;
	c.id1             = interaction.getId1();
	c.id2             = interaction.getId2();
	const IPhys& data = *interaction.phys;
	if (typeid(data) != typeid(FinnieRabinowiczPhys))
		fail("EnergyAccount: bodies " + std::to_string(c.id1) + " and " + std::to_string(c.id2) + " interact by " +
		     data.getClassName() +
		     ", whose energies it does not know; all contacts must be of "
		     "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz");
	const auto* phys  = static_cast<const FinnieRabinowiczPhys*>(&data);
	const Body &body1 = *Body::byId(c.id1, &scene), &body2 = *Body::byId(c.id2, &scene);
	// Without a law that has seen it, or between two held bodies, a contact has no force.
	if (phys->preparedBy < 0 || !((phys->wallBody != 1 && body1.isDynamic()) || (phys->wallBody != 2 && body2.isDynamic()))) return;
	c.acting = true;

	const Vector3r shift = scene.isPeriodic ? Vector3r(scene.cell->intrShiftPos(interaction.cellDist)) : Vector3r(Vector3r::Zero());
	c.view               = ContactView(phys->wallBody, *static_cast<const ScGeom*>(interaction.geom.get()), body1, body2, shift);
	c.view.move(body1.state->vel, body1.state->angVel, body2.state->vel, body2.state->angVel);
	const ::dembark::ContactBodies& bodies   = c.view.bodies;
	const double                    distance = norm(bodies.separation), sign = c.view.sign();
	const auto                      shear = vec(Vector3r(sign * phys->shearForce)), along = vec(Vector3r(sign * phys->normalForce));
	::dembark::ContactForce&        f = c.whole;
	f.overlap                         = bodies.radius_1 + (phys->wallBody ? 0.0 : bodies.radius_2) - distance;
	f.normal                          = distance > 0.0 ? bodies.separation * (1.0 / distance) : ::dembark::Vec3<double>{0.0, 0.0, 1.0};
	f.force                           = along + shear;
	f.capillary_force                 = phys->capillaryForce;
	f.viscous_normal                  = phys->viscousForce;
	f.viscous_tangential              = vec(Vector3r(sign * phys->viscousShearForce));
	f.normal_force                    = dot(along, f.normal) + f.capillary_force - f.viscous_normal;
	f.tangential                      = shear - f.viscous_tangential;
	c.parts                           = ::dembark::contact_parts(phys->contact, bodies, f, vec(phys->elasticDisplacement));

	c.half = 0.5 * scene.dt * dot(c.parts[ContactPart::normal_elastic], f.normal) * c.motion().normal_velocity;
	sums.half += c.half;
	sums.normal += c.parts.normal_stored;
	sums.tangential += c.parts.tangential_stored;
}

::dembark::Powers ContactWorks::powers(const Bodies& mean, double dt, int threads) {
	return overAll<::dembark::Powers>(threads, [&](long i, ::dembark::Powers& sums) {
		if (contacts[i].acting) addPowers(contacts[i], mean, dt, sums);
	});
}

void ContactWorks::addPowers(Contact& c, const Bodies& mean, double dt, ::dembark::Powers& sums) const {
	const ::dembark::EnergyBody &one = mean[c.id1], &two = mean[c.id2];
	const auto                   velocity = [](const ::dembark::EnergyBody& body) {
		return Vector3r(body.velocity[0], body.velocity[1], body.velocity[2]);
	};
	const auto spin = [](const ::dembark::EnergyBody& body) { return Vector3r(body.velocity[3], body.velocity[4], body.velocity[5]); };
	c.view.move(velocity(one), spin(one), velocity(two), spin(two));
	const auto motion   = c.motion();
	const auto relative = motion.normal_velocity * c.whole.normal + motion.tangential_velocity;
	sums.add_contact(c.parts, relative);
	c.work = dt * dot(c.parts[ContactPart::normal_elastic], relative);

	// The whole force, as it acts on the bodies: what the parts above miss of it shows up in `other`.
	const auto moment = cross(c.whole.normal, c.whole.force), surface = vec(c.view.surface);
	sums.add_held(c.view.swapped() ? two : one, dofs(c.whole.force, -motion.arm_1 * moment));
	sums.add_held(c.view.swapped() ? one : two,
	              dofs(-c.whole.force, c.view.wallBody ? -cross(surface, c.whole.force) : -motion.arm_2 * moment));
}

double ContactWorks::unexplained(const std::vector<bool>& bodies, bool arriving) const {
	double sum = 0.0;
	for (const Contact& c : contacts)
		if (c.acting && (bodies[c.id1] || bodies[c.id2]))
			sum += arriving ? c.parts.normal_stored + c.half : c.work - c.half - c.parts.normal_stored;
	return sum;
}

}  // namespace yade::dembark_yade
