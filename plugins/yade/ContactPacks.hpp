// Pairs of touching spheres, picked by SphereContactLoop and computed in packs (dembark/pairs): the laws and the bits of the law's own
// steps, many contacts at once.
#pragma once

#include <utility>
#include <vector>

#include "FinnieRabinowicz.hpp"
#include "dembark/contact_history.hpp"
#include "dembark/pairs/pair_step.hpp"

namespace yade::dembark_yade {

/// What a step needs of the spheres, by id: rows of numbers in one place of the memory. Behind the bodies there is room for the images of
/// partners across a periodic boundary, a block for each thread.
class Spheres {
public:
	void collect(const Scene& scene, int threads);

	bool     known(Body::id_t id) const { return isSphere[id]; }
	bool     dynamic(Body::id_t id) const { return !fixed[id]; }
	Real     radius(long at) const { return radii[at]; }
	Real     mass(long at) const { return masses[at]; }
	Vector3r pos(long at) const { return Vector3r::Map(&places[3 * at]); }
	Vector3r vel(long at) const { return Vector3r::Map(&velocities[3 * at]); }
	Vector3r angVel(long at) const { return Vector3r::Map(&spins[3 * at]); }
	/// Where the image of `id`, moved by `shift` and faster by `drift`, then stands: place `k` of the thread's block.
	int addImage(int thread, int k, Body::id_t id, const Vector3r& shift, const Vector3r& drift);
	/// Into a step of packs.
	void describe(::dembark::PairStep& step) const;

private:
	void set(long at, const Vector3r& pos, const Vector3r& vel, const Vector3r& angVel, Real radius, Real mass);

	std::vector<double> places, velocities, spins, radii, masses;
	std::vector<char>   isSphere;  // by id; pairs of other bodies are dispatched
	std::vector<int>    fixed;     // by place: 1 if the mass is infinite, as packs want it
	long                count   = 0;
	bool                anyHeld = false;
};

/// The contacts of one thread that wait to be computed.
class ContactPacks : ::dembark::ContactCallbacks, ::dembark::ResultStore {
public:
	typedef Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz Law;

	/// Of a step: forces go to those of the calling thread. `law`: of all that is added; null if there is none.
	ContactPacks(Scene&, Spheres&, Law* law);
	/// Whether packs know the law of the contact.
	bool know(const FinnieRabinowiczPhys& data) const { return data.kind >= 0 && data.kind < static_cast<int>(kinds.size()); }
	/// Such a contact, of spheres that touch. Computes those that wait when there is no room for more.
	void add(const Interaction&, FinnieRabinowiczPhys&);
	/// Computes all that wait, unless the run is about to stop: before forces are added in any other way, so that all are summed in the
	/// order of the interactions.
	void finish();
	/// Number of contacts so far.
	long computed() const { return done; }

private:
	typedef ::dembark::Vec3<double> Vec3;
	typedef ::dembark::PairBlock    Block;

	Vec3 friction(const Block&, int k, const Vec3& normal, double twist, const ::dembark::NormalResponse<double>&,
	              const Vec3& velocity) override;
	void bridges(const Block&, int first, int count, const double* gap, double* cohesiveForce) override;
	void store(const Block&, int first, int count, const ::dembark::PackResults&) override;

	static const ::dembark::PairLoops& loops();

	Scene&                                             scene;
	Spheres&                                           spheres;
	::dembark::PairStep                                step;
	std::vector<::dembark::PackedCoefficients<double>> kinds;
	Block                                              block;
	double                                             histories[Block::room][5];  // displacement, slip and energy of friction
	FinnieRabinowiczPhys*                              phys[Block::room];
	ScGeom*                                            geom[Block::room];
	Body::id_t                                         partner[Block::room];
	Vector3r *                                         forces, *torques;  // of the thread, by id
	int                                                waiting = 0;
	long                                               done    = 0;
};

/// As Ig2_Sphere_Sphere_ScGeom does it: the same bits, for all that look at them.
inline void setSphereGeometry(ScGeom& geom, const Vector3r& pos1, Real radius1, const Vector3r& pos2, Real radius2) {
	geom.normal     = pos2 - pos1;
	const Real norm = geom.normal.norm();
	geom.normal /= norm;
	geom.penetrationDepth = radius1 + radius2 - norm;
	geom.contactPoint     = pos1 + (radius1 - 0.5 * geom.penetrationDepth) * geom.normal;
	geom.radius1          = radius1;
	geom.radius2          = radius2;
}

}  // namespace yade::dembark_yade
