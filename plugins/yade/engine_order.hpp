// Where an engine that looks at the forces of a step has to stand among the engines of its scene.
#pragma once

#include <core/GlobalEngine.hpp>
#include <core/InteractionLoop.hpp>
#include <core/Scene.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#include "report.hpp"

namespace yade::dembark_yade {

/// The scene's only NewtonIntegrator; fails unless `own` stands before it, and InteractionLoop before `own`.
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
		if (newton && found) refuse(": there is more than one NewtonIntegrator in O.engines; it needs exactly one");
		if (newton) found = newton;
	}
	if (!found) refuse(": there is no NewtonIntegrator in O.engines; it needs exactly one after it");
	return *found;
}

}  // namespace yade::dembark_yade
