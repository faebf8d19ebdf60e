#include "ContactWorks.hpp"

#include <algorithm>
#include <typeinfo>

#include <core/Scene.hpp>

#include "FinnieRabinowicz.hpp"
#include "report.hpp"

namespace yade::dembark_yade {

using ::dembark::ContactPart;
using ::dembark::cross;
using ::dembark::dot;

namespace {

::dembark::RelativeMotion motionOf(const ContactView& view, const ::dembark::ContactForce& force) {
	return ::dembark::relative_motion(view.bodies, force.normal, force.overlap);
}

}  // namespace

void ContactWorks::Sums::add(const Sums& other) {
	for (std::size_t k = 0; k < parts.size(); ++k) parts[k] += other.parts[k];
	onFree += other.onFree;
	onBlocked += other.onBlocked;
	normalStored += other.normalStored;
	tangentialStored += other.tangentialStored;
	half += other.half;
}

/// The sum of what `visit(index, sums)` adds, over blocks of one length in their order: it does not depend on the number of threads.
template <class Visit>
ContactWorks::Sums ContactWorks::overAll(int threads, Visit visit) {
	constexpr long    size  = 256;
	const long        count = static_cast<long>(contacts.size()), blocks = (count + size - 1) / size;
	std::vector<Sums> partial(blocks);
#ifdef YADE_OPENMP
#pragma omp parallel for schedule(static) num_threads(threads > 0 ? std::min(threads, omp_get_max_threads()) : omp_get_max_threads())
#else
	(void)threads;
#endif
	for (long block = 0; block < blocks; ++block)
		for (long i = block * size; i < std::min(count, (block + 1) * size); ++i) visit(i, partial[block]);
	Sums total;
	for (const Sums& each : partial) total.add(each);
	return total;
}

ContactWorks::Sums ContactWorks::record(Scene& scene, int threads) {
	const auto& interactions = *scene.interactions;
	contacts.resize(scene.interactions->size());
	return overAll(threads, [&](long i, Sums& sums) { recordOne(contacts[i], *interactions[i], scene, sums); });
}

void ContactWorks::recordOne(Contact& c, const Interaction& interaction, Scene& scene, Sums& sums) const {
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

	c.half = 0.5 * scene.dt * dot(c.parts[ContactPart::normal_elastic], f.normal) * motionOf(c.view, f).normal_velocity;
	sums.half += c.half;
	sums.normalStored += c.parts.normal_stored;
	sums.tangentialStored += c.parts.tangential_stored;
}

ContactWorks::Sums ContactWorks::book(const std::vector<BodyMotion>& mean, double dt, int threads) {
	return overAll(threads, [&](long i, Sums& sums) {
		if (contacts[i].acting) bookOne(contacts[i], mean, dt, sums);
	});
}

void ContactWorks::bookOne(Contact& c, const std::vector<BodyMotion>& mean, double dt, Sums& sums) const {
	const BodyMotion &one = mean[c.id1], &two = mean[c.id2];
	c.view.move(one.velocity, one.spin, two.velocity, two.spin);
	const auto motion   = motionOf(c.view, c.whole);
	const auto velocity = motion.normal_velocity * c.whole.normal + motion.tangential_velocity;
	for (std::size_t k = 0; k < c.parts.force.size(); ++k) sums.parts[k] += dt * dot(c.parts.force[k], velocity);
	c.work = dt * dot(c.parts[ContactPart::normal_elastic], velocity);

	// The whole force, as it acts on the bodies: what the parts above miss of it is missing in the balance.
	const Vector3r force = vec(c.whole.force), moment = vec(cross(c.whole.normal, c.whole.force));
	const auto     act = [&](const BodyMotion& body, const Vector3r& push, const Vector3r& turn) {
		sums.onFree += dt * (along(push, body.velocity, body.blocked, false) + along(turn, body.spin, body.blocked, true));
		sums.onBlocked +=
			dt * (along(push, body.velocity, body.blocked, false, false) + along(turn, body.spin, body.blocked, true, false));
	};
	act(c.view.swapped() ? two : one, force, -motion.arm_1 * moment);
	act(c.view.swapped() ? one : two, -force,
	    c.view.wallBody ? Vector3r(-c.view.surface.cross(force)) : Vector3r(-motion.arm_2 * moment));
}

double ContactWorks::unexplained(const std::vector<bool>& bodies, bool arriving) const {
	double sum = 0.0;
	for (const Contact& c : contacts)
		if (c.acting && (bodies[c.id1] || bodies[c.id2]))
			sum += arriving ? c.parts.normal_stored + c.half : c.work - c.half - c.parts.normal_stored;
	return sum;
}

}  // namespace yade::dembark_yade
