#include "SphereContactLoop.hpp"

#include <algorithm>
#include <stdexcept>
#include <typeinfo>
#include <utility>

#include <core/Scene.hpp>
#include <pkg/common/Sphere.hpp>
#include <pkg/dem/Ig2_Sphere_Sphere_ScGeom.hpp>

#include "ContactView.hpp"
#include "engine_access.hpp"
#include "report.hpp"

namespace yade {

YADE_PLUGIN((SphereContactLoop));

using dembark_yade::ContactPacks;
using dembark_yade::ContactView;
using dembark_yade::imageDrift;
using dembark_yade::imageShift;

namespace {

/// The last of `functors` whose class is `Functor` itself.
template <class Functor, class List>
Functor* lastOf(const List& functors) {
	Functor* found = nullptr;
	for (const auto& each : functors)
		if (typeid(*each) == typeid(Functor)) found = static_cast<Functor*>(each.get());
	return found;
}

void prefetch(const void* from, std::size_t bytes) {
	for (std::size_t at = 0; at < bytes; at += 64) __builtin_prefetch(static_cast<const char*>(from) + at);
}

}  // namespace

/// Interactions, their geometry and physics are strewn over the memory: the loop asks for those that come next while it works.
void SphereContactLoop::fetchAhead(const InteractionContainer& all, long i, long end) const {
	constexpr long far = 32, near = 16;
	const auto     looksAt = [&](long k) { return k < end && all[k] != distant[k].interaction; };
	if (looksAt(i + far)) prefetch(all[i + far].get(), sizeof(Interaction));
	if (!looksAt(i + near) || !all[i + near]->isReal()) return;
	prefetch(all[i + near]->geom.get(), sizeof(ScGeom));
	prefetch(all[i + near]->phys.get(), FinnieRabinowiczPhys::ofEveryStep);
}

/// Whether both are spheres, too far apart to touch.
bool SphereContactLoop::separated(Body::id_t id1, Body::id_t id2, const Vector3i& cellDist) const {
	if (!spheres.known(id1) || !spheres.known(id2)) return false;
	const Vector3r pos2 = spheres.pos(id2) + imageShift(*scene, cellDist);
	const Real     sum  = spheres.radius(id1) + spheres.radius(id2);
	return (pos2 - spheres.pos(id1)).squaredNorm() > reach * sum * sum;
}

/// What the short path does for the pair: nothing, or no more than to see that it is too far apart to touch, or its step.
SphereContactLoop::PairPath SphereContactLoop::take(const shared_ptr<Interaction>& interaction, ContactPacks& packs) {
	if (!meeting || interaction->functorCache.geom.get() != meeting) return PairPath::none;
	const Body::id_t id1 = interaction->getId1(), id2 = interaction->getId2();
	if (!interaction->isReal()) return separated(id1, id2, interaction->cellDist) ? PairPath::apart : PairPath::none;
	if (!spheres.known(id1) || !spheres.known(id2)) return PairPath::none;
	const Vector3r pos1 = spheres.pos(id1), pos2 = spheres.pos(id2) + imageShift(*scene, interaction->cellDist);
	const Real     radius1 = spheres.radius(id1), radius2 = spheres.radius(id2), sum = radius1 + radius2;
	const Real     squared = (pos2 - pos1).squaredNorm();
	if (!law || interaction->functorCache.constLaw.get() != law || interaction->functorCache.phys.get() != physics)
		return PairPath::none;
	auto& phys = static_cast<FinnieRabinowiczPhys&>(*interaction->phys);
	if (phys.preparedBy != law->revision || !(spheres.dynamic(id1) || spheres.dynamic(id2))) return PairPath::none;
	// Those at the very end of a contact, and those without a normal, are left to the law.
	if (packs.know(phys) && squared > 0.0 && squared < (1.0 - 1e-9) * sum * sum) {
		packs.add(*interaction, phys);
		return PairPath::touching;
	}

	packs.finish();
	ContactView view;
	view.setSpheres(pos1 - pos2, radius1, radius2, spheres.mass(id1), spheres.mass(id2));
	view.move(spheres.vel(id1), spheres.angVel(id1), spheres.vel(id2) + imageDrift(*scene, interaction->cellDist), spheres.angVel(id2));
	const ::dembark::ContactForce out = law->act(phys, *interaction, view);
	dembark_yade::setSphereGeometry(static_cast<ScGeom&>(*interaction->geom), pos1, radius1, pos2, radius2);
	if (!out.interacting) scene->interactions->requestErase(interaction);
	return PairPath::touching;
}

/// One interaction by the functors of the three dispatchers, each found once and then known to the interaction.
void SphereContactLoop::dispatch(const shared_ptr<Interaction>& interaction, ContactPacks& packs) {
	const shared_ptr<Body>*first = &Body::byId(interaction->getId1(), scene), *second = &Body::byId(interaction->getId2(), scene);
	if (!*first || !*second) return scene->interactions->requestErase(interaction);
#ifdef YADE_MPI
	if ((*first)->subdomain != scene->subdomain && (*second)->subdomain != scene->subdomain)
		return scene->interactions->requestErase(interaction->getId1(), interaction->getId2());
#endif
	auto& known = interaction->functorCache;
	if ((*first)->isClump() || (*second)->isClump() || !known.geomExists || !(*first)->shape || !(*second)->shape) return;

	bool swapped = false;
	if (!known.geom) known.geom = geomDispatcher->getFunctor2D((*first)->shape, (*second)->shape, swapped);
	known.geomExists = static_cast<bool>(known.geom);
	if (!known.geom) return;
	if (swapped) {
		interaction->swapOrder();
		std::swap(first, second);
	}
	const Body &   body1 = **first, &body2 = **second;
	const bool     wasReal = interaction->isReal();
	const Vector3r shift   = imageShift(*scene, interaction->cellDist);
	const bool     meets   = known.geom->go(body1.shape, body2.shape, *body1.state, *body2.state, shift, false, interaction);
	if (!meets) {
		if (wasReal) scene->interactions->requestErase(interaction);
		return;
	}

	if (!known.phys) known.phys = physDispatcher->getFunctor2D((*first)->material, (*second)->material, swapped);
	if (!known.phys)
		dembark_yade::fail("SphereContactLoop: no Ip2 functor for the materials of bodies " + std::to_string(body1.getId()) +
		                   " and " + std::to_string(body2.getId()) + ", " + body1.material->getClassName() + " and " +
		                   body2.material->getClassName());
	known.phys->go(body1.material, body2.material, interaction);
	if (!wasReal) interaction->iterMadeReal = scene->iter;

	if (!known.constLaw) known.constLaw = lawDispatcher->getFunctor2D(interaction->geom, interaction->phys, swapped);
	if (!known.constLaw)
		dembark_yade::fail("SphereContactLoop: no Law2 functor for " + interaction->geom->getClassName() + " and " +
		                   interaction->phys->getClassName() + " of bodies " + std::to_string(body1.getId()) + " and " +
		                   std::to_string(body2.getId()));
	packs.finish();
	if (!known.constLaw->go(interaction->geom, interaction->phys, interaction.get())) scene->interactions->requestErase(interaction);
}

void SphereContactLoop::action() {
	dembark_yade::keepThreadState();
	const InteractionContainer& all     = *scene->interactions;
	const bool                  removal = all.iterColliderLastRun >= 0 && all.iterColliderLastRun == scene->iter;
	shortWay = packed = 0;
	if (!callbacks.empty() || loopOnSortedInteractions || removal) {
		distant.clear();
		return InteractionLoop::action();
	}

	geomDispatcher->scene = physDispatcher->scene = lawDispatcher->scene = scene;
	geomDispatcher->updateScenePtr();
	physDispatcher->updateScenePtr();
	lawDispatcher->updateScenePtr();
	const auto* const pairs = lastOf<Ig2_Sphere_Sphere_ScGeom>(geomDispatcher->functors);
	meeting                 = pairs;
	physics                 = lastOf<Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys>(physDispatcher->functors);
	law                     = lastOf<Law>(lawDispatcher->functors);
	// A little beyond where the functor sees a contact: it has the last word there.
	reach            = pairs ? 1.000001 * pairs->interactionDetectionFactor * pairs->interactionDetectionFactor : 0.0;
	const long count = static_cast<long>(scene->interactions->size());
	long       taken = 0, inPacks = 0;
	int        threads = 1;
#ifdef YADE_OPENMP
	threads = ompThreads > 0 ? std::min(ompThreads, omp_get_max_threads()) : omp_get_max_threads();
#endif
	if (std::exchange(distantFor, meeting) != meeting) distant.clear();
	distant.resize(count);
	if (count == 0) return;
	spheres.collect(*scene, threads);
	// Blocks: no thread looks at what another one works on.
	const long size   = std::clamp(count / (4 * threads), 16L, 256L);
	const auto safely = [this](auto work) {
		try {
			work();
		} catch (const std::exception& error) {
			dembark_yade::postpone(*scene, error);
		}
	};
#ifdef YADE_OPENMP
#pragma omp parallel num_threads(threads) reduction(+ : taken, inPacks)
#endif
	{
		ContactPacks packs(*scene, spheres, law);
#ifdef YADE_OPENMP
#pragma omp for schedule(guided) nowait
#endif
		for (long begin = 0; begin < count; begin += size) {
			const long end = std::min(begin + size, count);
			for (long i = begin; i < end && !dembark_yade::postponed(*scene); ++i)
				safely([&] {
					fetchAhead(all, i, end);
					Apart& known = distant[i];
					if (known.interaction == all[i] && separated(known.id1, known.id2, known.cellDist)) return;
					const PairPath path = take(all[i], packs);
					if (path == PairPath::apart) known = {all[i], all[i]->getId1(), all[i]->getId2(), all[i]->cellDist};
					else known.interaction.reset();
					if (path == PairPath::none) dispatch(all[i], packs);
					taken += path == PairPath::touching;
				});
		}
		safely([&] { packs.finish(); });
		inPacks += packs.computed();
	}
	shortWay = taken;
	packed   = inPacks;
}

}  // namespace yade
