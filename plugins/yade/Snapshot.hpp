// State of a YADE scene as lines of LAMMPS dump files and as sums, in C++ because a loop over bodies in Python costs a thousand times more.
#pragma once

#include <lib/serialization/Serializable.hpp>
#include <core/Omega.hpp>

namespace yade {

class DembarkSnapshot : public Serializable {
public:
	virtual ~DembarkSnapshot() = default;
	std::string grainRows() const;
	std::string contactRows() const;
	Real        kineticEnergy() const;
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(DembarkSnapshot,Serializable,"Rows for dump files, and sums, of the present scene. To be used between :yref:`InteractionLoop` and :yref:`NewtonIntegrator`: positions and forces are then of one time, and velocities, which YADE keeps half a step earlier, are moved on by v + dt/2 a to the same.",
		((vector<int>,types,,,"For each body its type in the dump, 1 = moving grain, 0 = not in the dump"))
		((vector<int>,columns,,,"For each body the number of the wall to whose force on the grains it contributes, -1 = none"))
		((int,wallCount,0,,"Number of walls"))
		((Vector3r,gravity,Vector3r::Zero(),,"Acceleration [m/s^2] that :yref:`NewtonIntegrator` adds"))
		((Vector3r,low,Vector3r::Zero(),,"Lower corner of the dump's box [m]"))
		((Vector3r,high,Vector3r::Zero(),,"Upper corner [m]"))
		((Vector3i,periodic,Vector3i::Zero(),,"1 for each axis along which positions are wrapped into the box"))
		, /*ctor*/
		, /*py*/
		.def("grainRows",&DembarkSnapshot::grainRows,"Lines 'id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass' and three forces for each wall.")
		.def("contactRows",&DembarkSnapshot::contactRows,"Lines 'x1 y1 z1 x2 y2 z2 id1 id2 periodic fx fy fz' of all contacts and bridges between bodies of the dump.")
		.def("kineticEnergy",&DembarkSnapshot::kineticEnergy,"Translational kinetic energy [J] of the grains (type 1).")
	);
	// clang-format on
private:
	Vector3i image(const Vector3r& position) const;
	Vector3r wrapped(const Vector3r& position) const { return position - image(position).cast<Real>().cwiseProduct(high - low); }
};
REGISTER_SERIALIZABLE(DembarkSnapshot);

}  // namespace yade
