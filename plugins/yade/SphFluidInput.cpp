// What scripts give to SphFluid and get from it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <core/Scene.hpp>

#include "ContactView.hpp"
#include "SphFluid.hpp"
#include "report.hpp"

namespace yade {

using dembark_yade::fail;
using dembark_yade::text;
using dembark_yade::vec;
namespace sph = ::dembark::sph;
namespace py  = boost::python;

namespace sph_fluid {

[[noreturn]] void refuse(const std::string& what) { fail("SphFluid: " + what + " must be a list of points, each of three numbers (m)"); }

/// Points of any sequence of vectors, tuples or rows of an array.
std::vector<Vector3r> points(const py::object& given, const std::string& what, bool plane) {
	if (!PySequence_Check(given.ptr())) refuse(what);
	std::vector<Vector3r> found;
	const py::ssize_t     count = py::len(given);
	for (py::ssize_t i = 0; i < count; ++i) {
		const py::object      each = given[i];
		py::extract<Vector3r> whole(each);
		Vector3r              p = Vector3r::Zero();
		if (whole.check()) {
			p = whole();
		} else {
			if (!PySequence_Check(each.ptr())) refuse(what);
			const py::ssize_t size = py::len(each);
			if (size != 3 && !(plane && size == 2)) refuse(what);
			for (py::ssize_t k = 0; k < size; ++k) {
				py::extract<Real> number(each[k]);
				if (!number.check()) refuse(what);
				p[k] = number();
			}
		}
		const std::string name = what + ", point " + std::to_string(i) + ", ";
		if (!p.allFinite()) fail("SphFluid: " + name + "is not finite");
		if (plane && p[2] != 0.0) fail("SphFluid: " + name + "has z = " + text(p[2]) + "; in the plane it must be 0");
		found.push_back(p);
	}
	if (found.empty()) fail("SphFluid: " + what + " has no points; give it one or more");
	return found;
}

void append(std::string& row, const char* format, double value) {
	char buffer[40];
	row.append(buffer, std::snprintf(buffer, sizeof buffer, format, value));
}

/// value(i) for all particles, in the order in which they were added.
template <class Value>
py::list inOrder(const sph::FluidParticles& fluid, const Value& value) {
	std::vector<int> at(fluid.id.size());
	for (int i = 0; i < fluid.size(); ++i) at[fluid.id[i]] = i;
	py::list all;
	for (const int i : at) all.append(value(i));
	return all;
}

}  // namespace sph_fluid

/// Particles can be added before the first step only.
void SphFluid::adding() const {
	if (passed >= 0) fail("SphFluid: the fluid has begun; add particles, walls and bodies before the first step");
	if (dimension != 2 && dimension != 3) fail("SphFluid.dimension is " + std::to_string(dimension) + "; it must be 2 or 3");
}

int SphFluid::addParticles(const py::object& given, const py::object& speed, const py::object& pressures) {
	adding();
	const std::vector<Vector3r> places = sph_fluid::points(given, "addParticles", dimension == 2);
	std::vector<Real>           p(places.size(), 0.0);
	if (!pressures.is_none()) {
		if (!PySequence_Check(pressures.ptr()) || py::len(pressures) != py::ssize_t(p.size()))
			fail("SphFluid: addParticles: pressures must be a list of " + std::to_string(p.size()) +
			     " numbers (Pa), one for each point");
		for (std::size_t i = 0; i < p.size(); ++i) {
			py::extract<Real> number(pressures[i]);
			if (!number.check() || !std::isfinite(number()) || (!tension && number() < 0.0))
				fail("SphFluid: addParticles: pressure " + std::to_string(i) + " must be a number" +
				     (tension ? "" : " >= 0") + " (Pa)");
			p[i] = number();
		}
	}
	Vector3r velocity = Vector3r::Zero();
	if (!speed.is_none()) {
		py::extract<Vector3r> three(speed);
		if (!three.check()) fail("SphFluid: addParticles: velocity must be a Vector3 (m/s)");
		velocity = three();
	}
	if (!velocity.allFinite() || (dimension == 2 && velocity[2] != 0.0))
		fail("SphFluid: addParticles: velocity must be finite, and in the plane without z (m/s)");
	solver.reset();
	firstPositions.insert(firstPositions.end(), places.begin(), places.end());
	firstVelocities.insert(firstVelocities.end(), places.size(), velocity);
	firstPressures.insert(firstPressures.end(), p.begin(), p.end());
	return static_cast<int>(firstPositions.size());
}

int SphFluid::add(int id, const std::vector<Vector3r>& points) {
	solver.reset();
	solidIds.push_back(id);
	solidSizes.push_back(static_cast<int>(points.size()));
	solidPoints.insert(solidPoints.end(), points.begin(), points.end());
	return static_cast<int>(solidIds.size()) - 1;
}

int SphFluid::addWall(const py::object& given) {
	adding();
	return add(-1, sph_fluid::points(given, "addWall", dimension == 2));
}

void SphFluid::mustFit(int id, const std::string& name) const {
	adding();
	Scene& here = *Omega::instance().getScene();
	if (id < 0 || !here.bodies->exists(id)) fail("SphFluid: " + name + " does not exist; append it to O.bodies first");
	const Body& body = *Body::byId(id, &here);
	if (body.isClumpMember()) fail("SphFluid: " + name + " belongs to the clump " + std::to_string(body.clumpId) + "; add that");
	if (std::count(solidIds.begin(), solidIds.end(), id) > 0) fail("SphFluid: " + name + " is in the fluid already");
	if (body.isDynamic() && !(body.state->mass > 0.0)) fail("SphFluid: " + name + " has no mass; set state.mass and state.inertia");
}

int SphFluid::addBody(int id, const py::object& given) {
	const std::string name = "addBody: body " + std::to_string(id);
	mustFit(id, name);
	std::vector<Vector3r> points = sph_fluid::points(given, name, dimension == 2);
	const State&          state  = *Body::byId(id, Omega::instance().getScene().get())->state;
	const Quaternionr     back   = state.ori.conjugate();
	for (Vector3r& p : points) p = back * (p - state.pos);
	return add(id, points);
}

int SphFluid::addBox(int id, const Vector3r& edges) {
	mustFit(id, "addBox: body " + std::to_string(id));
	if (dimension != 3) fail("SphFluid: addBox: boxes are for three dimensions; use addBody");
	std::array<int, 3> count{};
	try {
		count = sph::lattice_counts(vec(edges), spacing);
	} catch (const std::invalid_argument& wrong) {
		fail(std::string("SphFluid: addBox: ") + wrong.what());
	}
	std::vector<Vector3r> points;
	for (int i = 0; i < count[0]; ++i)
		for (int j = 0; j < count[1]; ++j)
			for (int k = 0; k < count[2]; ++k)
				points.push_back(spacing *
				                 Vector3r(i + 0.5 - 0.5 * count[0], j + 0.5 - 0.5 * count[1], k + 0.5 - 0.5 * count[2]));
	boxNumbers.push_back(add(id, points));
	boxEdges.push_back(edges);
	return boxNumbers.back();
}

void SphFluid::addPlane(const Vector3r& point, const Vector3r& normal) {
	adding();
	if (!point.allFinite() || !normal.allFinite() || normal.isZero())
		fail("SphFluid: addPlane: point must be finite, and normal not zero");
	solver.reset();
	planes.push_back(point);
	planes.push_back(normal);
}

py::list SphFluid::positions() {
	const sph::FluidParticles& f = fluid().scene().fluid;
	return sph_fluid::inOrder(f, [&](int i) { return vec(f.position[i]); });
}
py::list SphFluid::velocities() {
	const sph::FluidParticles& f = fluid().scene().fluid;
	return sph_fluid::inOrder(f, [&](int i) { return vec(f.velocity[i]); });
}
py::list SphFluid::densities() {
	const sph::FluidParticles& f = fluid().scene().fluid;
	return sph_fluid::inOrder(f, [&](int i) { return f.density[i]; });
}
py::list SphFluid::pressures() {
	const sph::FluidParticles& f = fluid().scene().fluid;
	return sph_fluid::inOrder(f, [&](int i) { return f.pressure[i]; });
}

std::string SphFluid::particleRows() {
	const sph::FluidParticles& f = fluid().scene().fluid;
	std::vector<int>           at(f.id.size());
	for (int i = 0; i < f.size(); ++i) at[f.id[i]] = i;
	std::string rest;
	sph_fluid::append(rest, "%.9g ", 0.5 * spacing);
	sph_fluid::append(rest, "%.9g ", particleMass());
	std::string text;
	for (std::size_t number = 0; number < at.size(); ++number) {
		const int i = at[number];
		sph_fluid::append(text, "%.0f 1 ", double(number + 1));
		for (const double x : {f.position[i].x, f.position[i].y, f.position[i].z}) sph_fluid::append(text, "%.10g ", x);
		for (const double x : {f.velocity[i].x, f.velocity[i].y, f.velocity[i].z}) sph_fluid::append(text, "%.7g ", x);
		text += rest;
		sph_fluid::append(text, "%.10g ", f.density[i]);
		sph_fluid::append(text, "%.7g\n", f.pressure[i]);
	}
	return text;
}

Vector3r SphFluid::force(int id) { return wallForce(static_cast<int>(numberOf(id))); }
Vector3r SphFluid::torque(int id) {
	const std::size_t k = numberOf(id);
	return vec(fluid().body(static_cast<int>(k)).torque);
}
Vector3r SphFluid::wallForce(int number) {
	if (number < 0 || number >= static_cast<int>(solidIds.size()))
		fail("SphFluid: there is no wall or body " + std::to_string(number) +
		     "; numbers are those that addWall and addBody returned");
	return vec(fluid().body(number).force);
}

py::dict SphFluid::energies() {
	const sph::Energies e = fluid().energies();
	py::dict            named;
	named["kinetic"]     = e.kinetic;
	named["potential"]   = e.potential;
	named["compression"] = e.compression;
	named["contact"]     = e.contact;
	named["viscous"]     = e.viscous;
	named["diffusive"]   = e.diffusive;
	named["boundary"]    = e.boundary;
	named["work"]        = e.work;
	return named;
}

Vector3r SphFluid::momentum() {
	const sph::FluidParticles& f = fluid().scene().fluid;
	sph::Vector                sum{};
	for (const sph::Vector& v : f.velocity) sum += v;
	return vec(particleMass() * sum);
}

Real SphFluid::particleMass() const { return density * std::pow(spacing, dimension); }
Real SphFluid::longestStep() const { return settings().longest_step(); }

}  // namespace yade
