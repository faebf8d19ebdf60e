// Prescribed motion of walls for YADE: dembark/motion/prescribed_motion.hpp, exact to the step.
#pragma once

#include <vector>

#include <core/GlobalEngine.hpp>

#include "SavedFormat.hpp"
#include "attributes.hpp"
#include "dembark/energy_ledger.hpp"
#include "dembark/motion/prescribed_motion.hpp"
#include "dembark/motion/wall_work.hpp"

namespace yade {

class WallMotion : public GlobalEngine {
public:
	virtual ~WallMotion() = default;
	void action() override;
	void postLoad(WallMotion&);
	/// Gives the bodies the velocity of the half step before the present one.
	void start();
	/// Takes up the motion and the forces of the present step, once.
	void measure();
	/// Calls visit(id, velocity) for the bodies that `lastStep` moved, whatever `ids` is now. The velocity is that of the half step
	/// after it, with the wall where it was in that step: what mean velocities are made with. A body that turns has another one when it
	/// has come to its next place.
	template <class Visit>
	void eachAfter(const Visit& visit) const {
		for (std::size_t k = 0; k < next.size(); ++k) visit(begunIds[k], next[k]);
	}
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(WallMotion,GlobalEngine,"Moves held bodies (facets, boxes, walls, spheres) together by a prescribed motion: a sum of terms whose place, velocity and acceleration are known at any time, and which no force changes. Stands after :yref:`InteractionLoop` and :yref:`EnergyAccount`, and before :yref:`NewtonIntegrator`. Contact laws see [x(n) - x(n-1)] / dt, the velocity of the half step of which the grains' velocities are. Attributes hold the motion and what the bodies do to the others at the step that measure() or the last step took.",
		((std::vector<int>,ids,,,"Bodies that move"))
		((std::string,motion,"",Attr::triggerPostLoad,"Terms, e.g. 'harmonic amplitude 0 0 1e-3 frequency 20': harmonic, circular, rocking, rotation, uniform, jolts, table; SI units. It begins where the bodies stand; so does one that is set later"))
		((Vector3r,displacement,Vector3r::Zero(),Attr::readonly,"[m]"))
		((Vector3r,velocity,Vector3r::Zero(),Attr::readonly,"Exact derivative of the displacement [m/s]"))
		((Vector3r,acceleration,Vector3r::Zero(),Attr::readonly,"[m/s2]"))
		((Real,angle,0,Attr::readonly,"About the axis [rad]"))
		((Real,rate,0,Attr::readonly,"[rad/s]"))
		((Real,angularAcceleration,0,Attr::readonly,"[rad/s2]"))
		((Vector3r,force,Vector3r::Zero(),Attr::readonly,"Of the bodies on the others [N]"))
		((Vector3r,torque,Vector3r::Zero(),Attr::readonly,"The same about the point of the axis, which moves with the translation [Nm]"))
		((Real,power,0,Attr::readonly,"Of the bodies on the others, with the exact velocity [W]"))
		((Real,work,0,Attr::readonly,"Sum of the power over all steps, by the trapezoidal rule [J]"))
		((Vector3r,impulse,Vector3r::Zero(),Attr::readonly,"The same of the force [Ns]"))
		((long,lastStep,-1,Attr::readonly,"Step in which the bodies got their velocities last; -1 = none"))
		((long,measured,-1,Attr::readonly,"Step whose forces the attributes hold; -1 = none"))
		((Vector3r,lastForce,Vector3r::Zero(),Attr::hidden,"Force of the step before"))
		((Real,lastPower,0,Attr::hidden,"Power of the step before"))
		((Real,begun,-1,Attr::readonly,"Time at which the motion began, from where the bodies stood: that of the first step, or of start(); -1 = not yet [s]"))
		((long,begunStep,-1,Attr::hidden,"Step of that time"))
		((std::string,begunMotion,"",Attr::hidden,"What began then"))
		((std::vector<int>,begunIds,,Attr::hidden,"Bodies of which it began"))
		((Vector3r,clock,Vector3r::Zero(),Attr::hidden,"Time, step and length of a step from there on"))
		((std::vector<Vector3r>,places,,Attr::hidden,"Of the bodies without the motion [m], from the point"))
		((std::vector<Real>,orientations,,Attr::hidden,"Of the bodies without the motion: x y z w of each"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.def("start",&WallMotion::start,"Give the bodies the velocity that they have before the present step; for walls that move from the beginning on.")
		.def("measure",&WallMotion::measure,"Take up motion and forces of the present step, from an engine between :yref:`InteractionLoop` and this one.")
	);
	// clang-format on

private:
	void   check() const;
	void   begin();
	void   take();
	Real   now(long step);
	State& state(std::size_t k) const;
	void   refer(const ::dembark::WallState&);

	::dembark::PrescribedMotion       prescribed;
	std::vector<::dembark::SixVector> next;
};
REGISTER_SERIALIZABLE(WallMotion);

}  // namespace yade

DEMBARK_SAVED_FORMAT(WallMotion, 1)
