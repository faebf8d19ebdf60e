// What the sources of LcpImpact share.
#pragma once

#include <string>
#include <vector>

#include "LcpImpact.hpp"

namespace yade {

/// The logs and walls of one step.
struct LcpImpact::Gathered {
	struct Mesh {
		::dembark::impact::Wall          wall;
		std::vector<::dembark::Triangle> triangles;
	};
	std::vector<::dembark::impact::Body>  bodies;     // in the order of their ids; held spheres have infinite mass
	std::vector<int>                      materials;  // ids of YADE, increasing; the index is that of the model
	int                                   axis = -1;  // blocked translation of all logs that move
	std::vector<::dembark::impact::Plane> planes;
	std::vector<::dembark::impact::Drum>  drums;
	std::vector<Mesh>                     meshes;
	double                                wallSpeed = 0.0;  // of the fastest point of a surface
};

namespace lcp_impact {

inline ::dembark::Vec3<double> plain(const Vector3r& v) { return {v[0], v[1], v[2]}; }
inline Vector3r                eigen(const ::dembark::Vec3<double>& v) { return Vector3r(v.x, v.y, v.z); }

/// A table by materials, or by pairs of them, in an attribute of YADE: rows of ids (-1 = all) and numbers.
struct Table {
	std::size_t keys, width;
	/// The numbers of a material, or of a pair in either order; nullptr: none.
	const Real* find(const std::vector<Real>& rows, int a, int b = -1) const;
};
constexpr Table byMaterial{1, 1}, byPair{2, 6};
/// static, kinetic, slip, strength, healing, area
constexpr Real withoutFriction[] = {0.0, 0.0, 0.0, ::dembark::unlimited_strength, 0.0, 0.0};
void           setFriction(::dembark::impact::PairLaw&, const Real* numbers);

inline std::string wallName(std::size_t number, const LogWall& wall) {
	return "LcpImpact.walls[" + std::to_string(number) + "]" + (wall.name.empty() ? "" : " '" + wall.name + "'");
}

inline std::string logName(Body::id_t id) { return "LcpImpact: log " + std::to_string(id) + " "; }

}  // namespace lcp_impact

}  // namespace yade
