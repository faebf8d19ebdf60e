// What a user may write for LcpImpact: numbers, dicts by material, walls. yade.dembark.impact_rows makes rows of numbers of it, which are
// saved with the scene; here they become the parameters of the model.
#include "LcpImpact.hpp"

#include <algorithm>
#include <cmath>

#include <core/Scene.hpp>

#include "report.hpp"

namespace yade {

using dembark_yade::fail;
using dembark_yade::text;
namespace impact = ::dembark::impact;

namespace lcp_input {

namespace py  = boost::python;
using Numbers = std::vector<Real>;

py::object module() { return py::import("yade.dembark.impact_rows"); }
bool       isDict(const py::object& value) { return PyDict_Check(value.ptr()); }

constexpr std::size_t frictionNumbers                  = 6;
constexpr Real        withoutFriction[frictionNumbers] = {0.0, 0.0, 0.0, ::dembark::unlimited_strength, 0.0, 0.0};

impact::ImpactPairLaw frictionLaw(const Real* n) {
	impact::ImpactPairLaw law;
	auto&                 f    = law.friction;
	f.static_friction          = n[0];
	f.kinetic_friction         = n[1];
	f.critical_slip_distance   = n[2];
	f.interface_shear_strength = n[3];
	f.healing_time             = n[4];
	law.contact_area           = n[5];
	return law;
}

void checkFriction(const Real* numbers, const std::string& where) {
	if (const char* const wrong = frictionLaw(numbers).friction.error()) fail(where + ": " + wrong);
}

/// An attribute that differs by materials, or by pairs of them. It is kept in rows of ids (-1 = all) and numbers.
struct Property {
	const char* name;
	std::size_t keys, width;

	/// The numbers of a material, or of a pair in either order; nullptr: none.
	const Real* find(const Numbers& rows, int a, int b = -1) const {
		for (std::size_t i = 0; i < rows.size(); i += keys + width) {
			const Real x = rows[i], y = rows[i + keys - 1];
			if (x < 0.0 || (x == a && (keys == 1 || y == b)) || (keys == 2 && x == b && y == a)) return &rows[i + keys];
		}
		return nullptr;
	}
	Numbers read(const py::object& value) const {
		const std::string where = std::string("LcpImpact.") + name;
		const Numbers     rows  = py::extract<Numbers>(module().attr("read")(name, value, where))();
		for (std::size_t i = keys; width == frictionNumbers && i < rows.size(); i += keys + width) checkFriction(&rows[i], where);
		return rows;
	}
	py::object show(const Numbers& rows) const { return module().attr("show")(name, rows); }
};

const Property stiffness{"stiffness", 1, 1};
const Property damping{"damping", 1, 1};
const Property friction{"friction", 2, frictionNumbers};

/// Give the words of `kw` that are no plain attributes to their setters, and take them out.
template <class Object>
void take(Object& object, py::dict& kw, std::initializer_list<std::pair<const char*, void (Object::*)(const py::object&)>> setters) {
	for (const auto& [word, setter] : setters)
		if (kw.has_key(word)) {
			const py::object value = kw[word];
			kw[word].del();
			(object.*setter)(value);
		}
}

}  // namespace lcp_input

void LogWall::postLoad(LogWall&) {
	const std::string where = "LogWall" + (name.empty() ? "" : " '" + name + "'");
	// Attributes arrive one after the other; LcpImpact asks for those that never came.
	if (!(stiffness >= 0.0) || !std::isfinite(stiffness)) fail(where + ".stiffness is " + text(stiffness) + "; it must be > 0 N/m");
	for (const int id : bodies)
		if (id < 0)
			fail(where + ".bodies: " + std::to_string(id) + " is no id of a body; give ids as O.bodies.append returns them");
}

void LogWall::pyHandleCustomCtorArgs(boost::python::tuple&, boost::python::dict& kw) {
	lcp_input::take<LogWall>(*this, kw, {{"friction", &LogWall::setFriction}});
	if (kw.has_key("bodies") && PyLong_Check(boost::python::object(kw["bodies"]).ptr())) {
		boost::python::list one;
		one.append(kw["bodies"]);
		kw["bodies"] = one;
	}
}

boost::python::object LogWall::getFriction() const {
	return frictionRows.empty() ? boost::python::object() : lcp_input::module().attr("friction_words")(frictionRows);
}

void LogWall::setFriction(const boost::python::object& value) {
	frictionRows.clear();
	if (value.is_none()) return;
	frictionRows = boost::python::extract<std::vector<Real>>(lcp_input::module().attr("friction_numbers")(value, "LogWall.friction"))();
	lcp_input::checkFriction(frictionRows.data(), "LogWall.friction");
}

/// What does not differ by materials.
impact::Settings LcpImpact::commonSettings() const {
	impact::Settings s;
	s.theta                               = theta;
	s.friction_sweeps                     = sweeps;
	s.lcp.tolerance                       = tolerance;
	s.lcp.method                          = ::dembark::lcp_method(method);
	s.pairs[0].tangential_stiffness_ratio = tangentialRatio;
	s.pairs[0].contact_damping            = contactDamping;
	return s;
}

void LcpImpact::postLoad(LcpImpact&) {
	try {
		const std::string wrong = impact::settings_error(commonSettings());
		if (!wrong.empty()) fail("LcpImpact: " + wrong);
	} catch (const std::invalid_argument& wrong) {
		fail("LcpImpact: " + std::string(wrong.what()));
	}
}

/// The parameters of the model for the materials of the present step.
impact::Settings LcpImpact::settings() const {
	const auto of = [&](const lcp_input::Property& property, const std::vector<Real>& rows, int a, int b = -1) {
		if (const Real* found = property.find(rows, a, b)) return found;
		const bool pairs = property.keys == 2;
		const auto name  = [](int id) {
			return id < 0 ? std::string("a material that is not in O.materials") : "material " + std::to_string(id);
		};
		fail(std::string("LcpImpact.") + property.name + " has no value for " + name(a) + (pairs ? " and " + name(b) : "") +
		     "; add " + (pairs ? "the pair" : "it") + " to the dict");
	};
	const auto law = [&](const Real* friction) {
		impact::ImpactPairLaw pair      = lcp_input::frictionLaw(friction);
		pair.tangential_stiffness_ratio = tangentialRatio;
		pair.contact_damping            = contactDamping;
		return pair;
	};
	const auto between = [&](int a, int b) {
		return frictionRows.empty() ? lcp_input::withoutFriction : of(lcp_input::friction, frictionRows, a, b);
	};
	impact::Settings result = commonSettings();
	result.dt               = scene->dt;
	result.materials.clear();
	result.pairs.clear();
	for (const int a : materials) {
		const double damping = dampingRows.empty() ? 0.0 : *of(lcp_input::damping, dampingRows, a);
		result.materials.push_back({*of(lcp_input::stiffness, stiffnessRows, a), damping});
		for (const int b : materials) result.pairs.push_back(law(between(a, b)));
	}
	for (std::size_t w = 0; w < wallList.size(); ++w) {
		const LogWall& wall = *wallList[w];
		if (wall.frictionRows.empty() && !frictionRows.empty() && frictionRows[0] >= 0.0)
			fail(wallName(w) + " has no friction, and LcpImpact.friction is by pairs of materials; give the wall its own");
		result.add({wall.stiffness, 0.0}, law(wall.frictionRows.empty() ? between(-1, -1) : wall.frictionRows.data()));
	}
	return result;
}

void LcpImpact::pyHandleCustomCtorArgs(boost::python::tuple&, boost::python::dict& kw) {
	lcp_input::take<LcpImpact>(*this, kw,
	                           {{"stiffness", &LcpImpact::setStiffness},
	                            {"damping", &LcpImpact::setDamping},
	                            {"friction", &LcpImpact::setFriction},
	                            {"walls", &LcpImpact::setWalls}});
}

boost::python::object LcpImpact::getStiffness() const { return lcp_input::stiffness.show(stiffnessRows); }
boost::python::object LcpImpact::getDamping() const { return lcp_input::damping.show(dampingRows); }
boost::python::object LcpImpact::getFriction() const { return lcp_input::friction.show(frictionRows); }
void                  LcpImpact::setStiffness(const boost::python::object& value) { stiffnessRows = lcp_input::stiffness.read(value); }
void                  LcpImpact::setDamping(const boost::python::object& value) { dampingRows = lcp_input::damping.read(value); }
void                  LcpImpact::setFriction(const boost::python::object& value) { frictionRows = lcp_input::friction.read(value); }

boost::python::list LcpImpact::getWalls() const {
	boost::python::list result;
	for (const auto& wall : wallList) result.append(wall);
	return result;
}

void LcpImpact::setWalls(const boost::python::object& value) {
	std::vector<shared_ptr<LogWall>> walls;
	const char* const                form = "LcpImpact.walls must be a list of LogWall objects or of dicts of their attributes";
	if (lcp_input::isDict(value) || PyUnicode_Check(value.ptr()) || !PySequence_Check(value.ptr())) fail(form);
	for (boost::python::ssize_t i = 0; i < boost::python::len(value); ++i) {
		const boost::python::object                 each = value[i];
		boost::python::extract<shared_ptr<LogWall>> object(each);
		if (!object.check() && !lcp_input::isDict(each)) fail(form);
		boost::python::tuple none;
		boost::python::dict  words = object.check() ? boost::python::dict() : boost::python::dict(each);
		walls.push_back(object.check() ? object() : Serializable_ctor_kwAttrs<LogWall>(none, words));
	}
	wallList = walls;
}

}  // namespace yade
