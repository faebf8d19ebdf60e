// State of a YADE scene as lines of LAMMPS dump files and as sums, in C++ because a loop over bodies in Python costs a thousand times more.
#include <cstdio>

#include <core/Omega.hpp>
#include <core/Scene.hpp>
#include <lib/serialization/Serializable.hpp>
#include <pkg/common/NormShearPhys.hpp>
#include <pkg/common/Sphere.hpp>

#include "attributes.hpp"

namespace yade {

class DembarkSnapshot : public Serializable {
public:
	virtual ~DembarkSnapshot() = default;
	std::string         grainRows() const;
	std::string         contactRows() const;
	Real                kineticEnergy() const;
	Vector3r            momentum() const;
	boost::python::list wallForces() const;
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(DembarkSnapshot,Serializable,"Rows for dump files, and sums, of the present scene. To be used between :yref:`InteractionLoop` and :yref:`NewtonIntegrator`: positions and forces are then of one time, and velocities, which YADE keeps half a step earlier, are moved on by v + dt/2 a to the same.",
		((vector<int>,types,,,"For each body its type in the dump, 1 = moving grain, 0 = not in the dump; -1, and bodies beyond the list: 1 for a sphere that moves, 2 for one that is held, 0 for others"))
		((vector<int>,columns,,,"For each body the number of the wall to whose force on the grains it contributes, -1 = none"))
		((int,wallCount,0,,"Number of walls"))
		((Vector3r,gravity,Vector3r::Zero(),,"Acceleration [m/s^2] that :yref:`NewtonIntegrator` adds"))
		((Vector3r,low,Vector3r::Zero(),,"Lower corner of the dump's box [m]"))
		((Vector3r,high,Vector3r::Zero(),,"Upper corner [m]"))
		((Vector3i,periodic,Vector3i::Zero(),,"1 for each axis along which positions are wrapped into the box"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.def("grainRows",&DembarkSnapshot::grainRows,"Lines 'id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass' and three forces for each wall.")
		.def("contactRows",&DembarkSnapshot::contactRows,"Lines 'x1 y1 z1 x2 y2 z2 id1 id2 periodic fx fy fz' of all contacts and bridges between bodies of the dump.")
		.def("kineticEnergy",&DembarkSnapshot::kineticEnergy,"Translational kinetic energy [J] of the grains (type 1).")
		.def("momentum",&DembarkSnapshot::momentum,"Momentum [N s] of the grains (type 1).")
		.def("wallForces",&DembarkSnapshot::wallForces,"Force [N] of each wall on the grains, the bodies of its number in columns together.")
	);
	// clang-format on
private:
	int      typeOf(const Body& body) const;
	Vector3i image(const Vector3r& position) const;
	Vector3r wrapped(const Vector3r& position) const { return position - image(position).cast<Real>().cwiseProduct(high - low); }
};
REGISTER_SERIALIZABLE(DembarkSnapshot);

YADE_PLUGIN((DembarkSnapshot));

namespace {

int at(const std::vector<int>& values, Body::id_t id, int otherwise) {
	return id >= 0 && static_cast<std::size_t>(id) < values.size() ? values[id] : otherwise;
}

template <class Numbers>
void add(std::string& text, const char* format, const Numbers& values) {
	char buffer[40];  // long enough for any double
	for (const Real value : values) text.append(buffer, std::snprintf(buffer, sizeof buffer, format, value));
}

struct Motion {
	Vector3r force, velocity, angularVelocity;
};

/// Force with weight, and velocities at the time of the positions.
Motion motion(const Body& body, Scene& scene, const Vector3r& gravity) {
	const State& state = *body.state;
	Motion       now{scene.forces.getForce(body.getId()), state.vel, state.angVel};
	if (!body.isDynamic() || !(state.mass > 0.0)) return now;
	const Vector3r torque = scene.forces.getTorque(body.getId());
	now.force += state.mass * gravity;
	for (int i = 0; i < 3; ++i) {
		if (!(state.blockedDOFs & State::axisDOF(i, false))) now.velocity[i] += 0.5 * scene.dt * now.force[i] / state.mass;
		if (!(state.blockedDOFs & State::axisDOF(i, true)) && state.inertia[i] > 0.0)
			now.angularVelocity[i] += 0.5 * scene.dt * torque[i] / state.inertia[i];
	}
	return now;
}

}  // namespace

int DembarkSnapshot::typeOf(const Body& body) const {
	const int given = at(types, body.getId(), -1);
	return given >= 0 ? given : !dynamic_cast<const Sphere*>(body.shape.get()) ? 0 : body.isDynamic() ? 1 : 2;
}

Vector3i DembarkSnapshot::image(const Vector3r& position) const {
	Vector3i cell = Vector3i::Zero();
	for (int i = 0; i < 3; ++i)
		if (periodic[i] && high[i] > low[i]) cell[i] = static_cast<int>(math::floor((position[i] - low[i]) / (high[i] - low[i])));
	return cell;
}

std::string DembarkSnapshot::grainRows() const {
	Scene& scene = *Omega::instance().getScene();
	scene.forces.sync();
	std::vector<Vector3r> ofWalls(scene.bodies->size() * wallCount, Vector3r::Zero());
	if (wallCount > 0)
		for (const auto& interaction : *scene.interactions) {
			if (!interaction->isReal()) continue;
			const Body::id_t id1 = interaction->getId1(), id2 = interaction->getId2();
			const int        wall1 = at(columns, id1, -1), wall2 = at(columns, id2, -1);
			if (wall1 == wall2 || (wall1 >= 0 && wall2 >= 0)) continue;
			const auto* phys = dynamic_cast<const NormShearPhys*>(interaction->phys.get());
			if (!phys) continue;
			const Vector3r onSecond = phys->normalForce + phys->shearForce;
			if (wall1 >= 0) ofWalls[id2 * wallCount + wall1] += onSecond;
			else ofWalls[id1 * wallCount + wall2] -= onSecond;
		}

	std::string text;
	for (const auto& body : *scene.bodies) {
		if (!body) continue;
		const int   type   = typeOf(*body);
		const auto* sphere = type > 0 ? dynamic_cast<const Sphere*>(body->shape.get()) : nullptr;
		if (!sphere) continue;
		const Motion now = motion(*body, scene, gravity);
		add(text, "%.0f ", Vector2r(body->getId() + 1, type));
		add(text, "%.10g ", wrapped(body->state->pos));
		add(text, "%.0f ", Vector3r(image(body->state->pos).cast<Real>()));
		for (const Vector3r& each : {now.velocity, now.angularVelocity, now.force}) add(text, "%.7g ", each);
		add(text, "%.9g ", Vector2r(sphere->radius, body->state->mass));
		for (int k = 0; k < wallCount; ++k) add(text, "%.7g ", ofWalls[body->getId() * wallCount + k]);
		text.back() = '\n';
	}
	return text;
}

std::string DembarkSnapshot::contactRows() const {
	Scene&      scene = *Omega::instance().getScene();
	std::string text;
	for (const auto& interaction : *scene.interactions) {
		if (!interaction->isReal()) continue;
		const Body::id_t id1 = interaction->getId1(), id2 = interaction->getId2();
		const auto*      phys  = dynamic_cast<const NormShearPhys*>(interaction->phys.get());
		const auto &     body1 = Body::byId(id1, &scene), &body2 = Body::byId(id2, &scene);
		if (!phys || !body1 || !body2 || !(body1->isDynamic() || body2->isDynamic())) continue;
		if (typeOf(*body1) <= 0 || typeOf(*body2) <= 0) continue;
		const Vector3i apart  = interaction->cellDist + image(body2->state->pos) - image(body1->state->pos);
		const bool     across = !apart.cwiseProduct(periodic).isZero();
		add(text, "%.10g ", wrapped(body1->state->pos));
		add(text, "%.10g ", wrapped(body2->state->pos));
		add(text, "%.0f ", Vector3r(id1 + 1, id2 + 1, across));
		add(text, "%.7g ", Vector3r(-(phys->normalForce + phys->shearForce)));
		text.back() = '\n';
	}
	return text;
}

Vector3r DembarkSnapshot::momentum() const {
	Scene& scene = *Omega::instance().getScene();
	scene.forces.sync();
	Vector3r sum = Vector3r::Zero();
	for (const auto& body : *scene.bodies)
		if (body && typeOf(*body) == 1) sum += body->state->mass * motion(*body, scene, gravity).velocity;
	return sum;
}

boost::python::list DembarkSnapshot::wallForces() const {
	Scene& scene = *Omega::instance().getScene();
	scene.forces.sync();
	std::vector<Vector3r> sums(wallCount, Vector3r::Zero());
	for (std::size_t id = 0; id < columns.size(); ++id)
		if (columns[id] >= 0) sums[columns[id]] -= scene.forces.getForce(Body::id_t(id));
	boost::python::list all;
	for (const Vector3r& sum : sums) all.append(sum);
	return all;
}

Real DembarkSnapshot::kineticEnergy() const {
	Scene& scene = *Omega::instance().getScene();
	scene.forces.sync();
	Real sum = 0.0;
	for (const auto& body : *scene.bodies)
		if (body && typeOf(*body) == 1) sum += 0.5 * body->state->mass * motion(*body, scene, gravity).velocity.squaredNorm();
	return sum;
}

}  // namespace yade
