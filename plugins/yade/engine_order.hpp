// Where an engine that looks at the forces of a step has to stand among the engines of its scene.
#pragma once

#include <string>

#include <core/GlobalEngine.hpp>
#include <core/InteractionLoop.hpp>
#include <core/Scene.hpp>
#include <core/TimeStepper.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#include "report.hpp"

namespace yade::dembark_yade {

/// The scene's only NewtonIntegrator; fails unless `own` stands before it, and InteractionLoop and what chooses the time step before `own`.
inline const NewtonIntegrator& integratorAfter(const Engine& own, const Scene& scene) {
	const auto              refuse = [&own](const char* what) { fail(own.getClassName() + what); };
	const NewtonIntegrator* found  = nullptr;
	bool                    passed = false;
	for (const auto& engine : scene.engines) {
		passed = passed || engine.get() == &own;
		if (engine->dead) continue;
		const auto* newton = dynamic_cast<const NewtonIntegrator*>(engine.get());
		if ((newton && !passed) || (passed && dynamic_cast<const InteractionLoop*>(engine.get())))
			refuse(" must stand in O.engines after InteractionLoop and before NewtonIntegrator");
		if (const auto* stepper = dynamic_cast<const TimeStepper*>(engine.get()); stepper && stepper->active && passed && !found)
			fail(own.getClassName() + " must stand in O.engines after " + stepper->getClassName() +
			     ", which changes the time step for which it counts");
		if (newton && found) refuse(": there is more than one NewtonIntegrator in O.engines; it needs exactly one");
		if (newton) found = newton;
	}
	if (!found) refuse(": there is no NewtonIntegrator in O.engines; it needs exactly one after it");
	return *found;
}

/// The same of an engine whose forces need an integrator that adds none and bodies that have their own masses, without periodic images.
inline const NewtonIntegrator& undampedIntegratorAfter(const Engine& own, const Scene& scene) {
	const NewtonIntegrator& found = integratorAfter(own, scene);
	const std::string       name  = own.getClassName();
	if (found.damping > 0.0) fail("NewtonIntegrator.damping is " + text(found.damping) + "; it must be 0 with " + name);
	if (found.densityScaling) fail("NewtonIntegrator.densityScaling is on; it must be off with " + name);
	if (scene.isPeriodic) fail(name + ": the scene is periodic; use an aperiodic one");
	return found;
}

}  // namespace yade::dembark_yade
