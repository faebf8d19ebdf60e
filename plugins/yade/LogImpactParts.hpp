// What the sources of LogImpact share.
#pragma once

#include <string>
#include <vector>

#include "LogImpact.hpp"

namespace yade {

namespace log_impact {

/// The bodies of a wall as the model's shapes.
struct WallShapes {
	::dembark::impact::Wall                  common;
	std::vector<::dembark::impact::Plane>    planes;
	std::vector<bool>                        twoSided;
	std::vector<::dembark::impact::Drum>     drums;
	std::vector<::dembark::impact::Triangle> triangles;
	double                                   speed = 0.0;  // of the fastest point of a surface
};

}  // namespace log_impact

/// The logs and walls of one step.
struct LogImpact::Gathered {
	std::vector<::dembark::impact::Body> bodies;     // in the order of their ids; held spheres have infinite mass
	std::vector<int>                     materials;  // ids of YADE, increasing; the index is that of the model
	int                                  axis = -1;  // blocked translation of all logs that move
	std::vector<log_impact::WallShapes>  walls;
	double                               wallSpeed = 0.0;
};

namespace log_impact {

inline ::dembark::Vec3<double> plain(const Vector3r& v) { return {v[0], v[1], v[2]}; }
inline Vector3r                eigen(const ::dembark::Vec3<double>& v) { return Vector3r(v.x, v.y, v.z); }

inline std::string wallName(std::size_t number, const LogWall& wall) {
	return "LogImpact.walls[" + std::to_string(number) + "]" + (wall.name.empty() ? "" : " '" + wall.name + "'");
}

inline std::string logName(Body::id_t id) { return "LogImpact: log " + std::to_string(id) + " "; }

}  // namespace log_impact

}  // namespace yade
