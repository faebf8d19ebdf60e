#include <Python.h>

#include "engine_access.hpp"

#include <core/BodyContainer.hpp>

namespace yade::dembark_yade {

#ifdef YADE_OPENMP
typedef std::vector<std::vector<Vector3r>> Sums;  // by thread and id
#else
typedef std::vector<Vector3r> Sums;
#endif

Sums& forcesOf(ForceContainer&);
Sums& torquesOf(ForceContainer&);

// An explicit instantiation may name what is private.
template <Sums ForceContainer::* Forces, Sums ForceContainer::* Torques>
struct Opened {
	friend Sums& forcesOf(ForceContainer& container) { return container.*Forces; }
	friend Sums& torquesOf(ForceContainer& container) { return container.*Torques; }
};
#ifdef YADE_OPENMP
template struct Opened<&ForceContainer::_forceData, &ForceContainer::_torqueData>;
#else
template struct Opened<&ForceContainer::_force, &ForceContainer::_torque>;
#endif

std::pair<Vector3r*, Vector3r*> threadForces(Scene& scene) {
	// Room for all, and the sums count as changed.
	const auto last = static_cast<Body::id_t>(scene.bodies->size()) - 1;
	scene.forces.addForce(last, Vector3r::Zero());
	scene.forces.addTorque(last, Vector3r::Zero());
#ifdef YADE_OPENMP
	const int thread = threadNumber();
	return {forcesOf(scene.forces)[thread].data(), torquesOf(scene.forces)[thread].data()};
#else
	return {forcesOf(scene.forces).data(), torquesOf(scene.forces).data()};
#endif
}

void keepThreadState() {
	static thread_local bool asked = false;
	if (std::exchange(asked, true) || PyGILState_GetThisThreadState()) return;
	PyGILState_Ensure();  // never released
	PyEval_SaveThread();
}

}  // namespace yade::dembark_yade
