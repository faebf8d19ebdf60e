// What a user may write for LcpImpact: numbers, dicts by material, walls; read into rows of numbers, which are saved with the scene.
#include "LcpImpact.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <core/Omega.hpp>
#include <core/Scene.hpp>

#include "report.hpp"

namespace yade {

using dembark_yade::fail;
using dembark_yade::text;
namespace impact = ::dembark::impact;

namespace lcp_input {

namespace py  = boost::python;
using Numbers = std::vector<Real>;

/// Python's own text of a value, for messages.
std::string shown(const py::object& value) { return py::extract<std::string>(py::str(value)); }
bool        isDict(const py::object& value) { return PyDict_Check(value.ptr()); }
bool        isText(const py::object& value) { return PyUnicode_Check(value.ptr()); }

Real number(const py::object& value, const std::string& what) {
	// A bool is a number in Python, but not here.
	if (!PyBool_Check(value.ptr())) {
		py::extract<double> plain(value);
		if (plain.check() && std::isfinite(plain())) return plain();
	}
	fail(what + " is " + shown(value) + "; it must be a finite number");
}

/// Id of a shared material, from its id or its label.
Real material(const py::object& key, const std::string& what) {
	const auto& materials = Omega::instance().getScene()->materials;
	if (isText(key)) {
		const std::string label = py::extract<std::string>(key);
		for (const auto& each : materials)
			if (each->label == label) return each->id;
	} else if (!PyBool_Check(key.ptr())) {
		py::extract<int> id(key);
		if (id.check() && id() >= 0 && id() < static_cast<int>(materials.size())) return id();
	}
	fail(what + ": no material " + shown(key) + "; give the id or the label of one in O.materials (there are " +
	     std::to_string(materials.size()) + ")");
}

/// An attribute that differs by materials, or by pairs of them. It is kept in rows of ids (-1 = all) and numbers.
struct Property {
	std::string name;
	std::size_t keys, width;
	Numbers (*parse)(const py::object& value, const std::string& what);
	py::object (*show)(const Real* numbers);

	/// The numbers of a material, or of a pair in either order; nullptr: none.
	const Real* find(const Numbers& rows, int a, int b = -1) const {
		for (std::size_t i = 0; i < rows.size(); i += keys + width) {
			const Real x = rows[i], y = rows[i + keys - 1];
			if (x < 0.0 || (x == a && (keys == 1 || y == b)) || (keys == 2 && x == b && y == a)) return &rows[i + keys];
		}
		return nullptr;
	}

	/// One value for all, or a dict by materials or pairs of them.
	Numbers read(const py::object& value) const {
		Numbers    rows;
		const auto add = [&](const Numbers& ids, const py::object& each, const std::string& what) {
			const Numbers numbers = parse(each, what);
			rows.insert(rows.end(), ids.begin(), ids.end());
			rows.insert(rows.end(), numbers.begin(), numbers.end());
		};
		const py::list items = isDict(value) ? py::list(py::extract<py::dict>(value)().items()) : py::list();
		if (py::len(items) == 0 || (keys == 2 && isText(items[0][0]))) add(Numbers(keys, -1.0), value, name);
		else
			for (py::ssize_t i = 0; i < py::len(items); ++i) {
				const py::object  key   = items[i][0];
				const std::string where = name + "[" + shown(key) + "]";
				const bool        pair  = PyTuple_Check(key.ptr()) && py::len(key) == 2;
				if (keys == 1) add({material(key, name)}, items[i][1], where);
				else if (pair) add({material(key[0], name), material(key[1], name)}, items[i][1], where);
				else fail(name + ": the key " + shown(key) + " is no pair; write {(material, material): friction, ...}");
			}
		return rows;
	}

	py::object toPython(const Numbers& rows) const {
		if (rows.empty()) return py::object();
		if (rows[0] < 0.0) return show(&rows[keys]);
		py::dict result;
		for (std::size_t i = 0; i < rows.size(); i += keys + width) {
			const int first = static_cast<int>(rows[i]), last = static_cast<int>(rows[i + keys - 1]);
			result[keys == 1 ? py::object(first) : py::make_tuple(first, last)] = show(&rows[i + keys]);
		}
		return result;
	}
};

/// The words of a friction law, and what they stand for.
std::array<std::pair<const char*, double*>, 6> wordsOf(impact::PairLaw& law) {
	::dembark::FinnieRabinowicz& f = law.friction;
	return {{{"static", &f.static_friction},
	         {"kinetic", &f.kinetic_friction},
	         {"slip", &f.critical_slip_distance},
	         {"strength", &f.interface_shear_strength},
	         {"healing", &f.healing_time},
	         {"area", &law.contact_area}}};
}

impact::PairLaw frictionLaw(const Real* numbers) {
	impact::PairLaw law;
	for (const auto& [word, to] : wordsOf(law)) *to = *numbers++;
	return law;
}
constexpr Real withoutFriction[] = {0.0, 0.0, 0.0, ::dembark::unlimited_strength, 0.0, 0.0};

/// One friction law: a coefficient, or a dict of words.
Numbers frictionNumbers(const py::object& value, const std::string& what) {
	impact::PairLaw              law = frictionLaw(withoutFriction);
	::dembark::FinnieRabinowicz& f   = law.friction;
	const auto                   all = wordsOf(law);
	if (isDict(value)) {
		const py::dict given = py::extract<py::dict>(value);
		const py::list keys  = given.keys();
		for (py::ssize_t i = 0; i < py::len(keys); ++i) {
			const std::string word = shown(keys[i]);
			const auto found = std::find_if(all.begin(), all.end(), [&](const auto& known) { return known.first == word; });
			if (found == all.end())
				fail(what + ": '" + word + "' is unknown; the words are static, kinetic, slip, strength, healing, area");
			*found->second = number(given[word], what + "['" + word + "']");
		}
		if (!given.has_key("static")) fail(what + " has no 'static'; give at least the static friction coefficient");
		if (!given.has_key("kinetic")) f.kinetic_friction = f.static_friction;
	} else {
		f.static_friction = f.kinetic_friction = number(value, what);
	}
	if (const char* wrong = f.error()) fail(what + ": " + wrong);
	if (!(law.contact_area >= 0.0))
		fail(what + ": area is " + text(law.contact_area) + "; it must be > 0 m^2, or 0 = that of the contact of two circles");
	Numbers numbers;
	for (const auto& [word, from] : all) numbers.push_back(*from);
	return numbers;
}

py::object frictionToPython(const Real* numbers) {
	impact::PairLaw law = frictionLaw(numbers);
	py::dict        words;
	for (const auto& [word, from] : wordsOf(law)) words[word] = *from;
	return words;
}

Numbers positive(const py::object& value, const std::string& what) {
	const Real x = number(value, what);
	if (!(x > 0.0)) fail(what + " is " + text(x) + "; it must be > 0 N/m");
	return {x};
}

Numbers notNegative(const py::object& value, const std::string& what) {
	const Real x = number(value, what);
	if (!(x >= 0.0)) fail(what + " is " + text(x) + "; it must be >= 0 N s/m");
	return {x};
}

py::object oneNumber(const Real* numbers) { return py::object(*numbers); }

const Property stiffness{"LcpImpact.stiffness", 1, 1, positive, oneNumber};
const Property damping{"LcpImpact.damping", 1, 1, notNegative, oneNumber};
const Property friction{"LcpImpact.friction", 2, 6, frictionNumbers, frictionToPython};

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
	return frictionRows.empty() ? boost::python::object() : lcp_input::frictionToPython(frictionRows.data());
}

void LogWall::setFriction(const boost::python::object& value) {
	frictionRows.clear();
	if (!value.is_none()) frictionRows = lcp_input::frictionNumbers(value, "LogWall.friction");
}

void LcpImpact::postLoad(LcpImpact&) {
	const auto must = [](bool right, const char* name, double value, const char* what) {
		if (!right || !std::isfinite(value)) fail(std::string("LcpImpact.") + name + " is " + text(value) + "; it must be " + what);
	};
	must(contactDamping >= 0.0, "contactDamping", contactDamping, ">= 0 N s/m");
	must(theta >= 0.5 && theta <= 1.0, "theta", theta, "in 0.5...1");
	must(tangentialRatio > 0.0, "tangentialRatio", tangentialRatio, "> 0");
	must(tolerance > 0.0, "tolerance", tolerance, "> 0");
	must(sweeps >= 1, "sweeps", sweeps, ">= 1");
	try {
		::dembark::lcp_method(method);
	} catch (const std::invalid_argument&) {
		fail("LcpImpact.method is '" + method + "'; it must be auto, energy, block, murty or pgs");
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
		fail(property.name + " has no value for " + name(a) + (pairs ? " and " + name(b) : "") + "; add " +
		     (pairs ? "the pair" : "it") + " to the dict");
	};
	const auto law = [&](const Real* friction) {
		impact::PairLaw pair            = lcp_input::frictionLaw(friction);
		pair.tangential_stiffness_ratio = tangentialRatio;
		pair.contact_damping            = contactDamping;
		return pair;
	};
	const auto between = [&](int a, int b) {
		return frictionRows.empty() ? lcp_input::withoutFriction : of(lcp_input::friction, frictionRows, a, b);
	};
	impact::Settings result;
	result.dt              = scene->dt;
	result.theta           = theta;
	result.friction_sweeps = sweeps;
	result.lcp.tolerance   = tolerance;
	result.lcp.method      = ::dembark::lcp_method(method);
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

void LogImpact::pyHandleCustomCtorArgs(boost::python::tuple& words, boost::python::dict& kw) {
	// With warnings made errors, Python has one set.
	if (PyErr_WarnEx(PyExc_FutureWarning, "dembark: LogImpact is now LcpImpact; the old name goes with the next version", 1) < 0)
		boost::python::throw_error_already_set();
	LcpImpact::pyHandleCustomCtorArgs(words, kw);
}

boost::python::object LcpImpact::getStiffness() const { return lcp_input::stiffness.toPython(stiffnessRows); }
boost::python::object LcpImpact::getDamping() const { return lcp_input::damping.toPython(dampingRows); }
boost::python::object LcpImpact::getFriction() const { return lcp_input::friction.toPython(frictionRows); }
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
	if (lcp_input::isDict(value) || lcp_input::isText(value) || !PySequence_Check(value.ptr())) fail(form);
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
