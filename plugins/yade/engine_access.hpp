// What YADE keeps to itself and the loop over contacts cannot do without, with the reason. Where another version of YADE has it otherwise
// this does not compile.
#pragma once

#include <utility>
#include <vector>

#include <core/ForceContainer.hpp>
#include <core/Scene.hpp>

namespace yade::dembark_yade {

inline int threadNumber() {
#ifdef YADE_OPENMP
	return omp_get_thread_num();
#else
	return 0;
#endif
}

/// Forces and torques on all bodies, by id, to which the calling thread adds its own; valid until the number of bodies changes. Reason:
/// four calls of ForceContainer::addForce() and addTorque(), each of which asks for the number of the thread twice, cost as much as a
/// packed contact does.
std::pair<Vector3r*, Vector3r*> threadForces(Scene& scene);

/// Keeps the state that Python has of the calling thread for as long as the thread lives. YADE's own thread has none: every PyRunner makes
/// and drops one, for some 17 us, a third of a step of twenty logs.
void keepThreadState();

}  // namespace yade::dembark_yade
