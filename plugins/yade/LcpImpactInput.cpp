// What a user may write for LcpImpact: numbers, dicts by material, walls; read into rows of numbers, which are saved with the scene.
#include "LcpImpact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <core/Omega.hpp>
#include <core/Scene.hpp>

#include "report.hpp"

namespace yade {

using dembark_yade::fail;
namespace impact = ::dembark::impact;

namespace lcp_input {

namespace py = boost::python;

/// A table by materials, or by pairs of them, in an attribute of YADE: rows of ids (-1 = all) and numbers.
struct Table {
	std::size_t keys, width;

	/// The numbers of a material, or of a pair in either order; nullptr: none.
	const Real* find(const std::vector<Real>& rows, int a, int b = -1) const {
		for (std::size_t i = 0; i < rows.size(); i += keys + width) {
			const Real x = rows[i], y = rows[i + keys - 1];
			if (x < 0.0 || (x == a && (keys == 1 || y == b)) || (keys == 2 && x == b && y == a)) return &rows[i + keys];
		}
		return nullptr;
	}
};
constexpr Table byMaterial{1, 1}, byPair{2, 6};

/// The words of a friction law, and the numbers they stand for.
const char* const frictionWords[] = {"static", "kinetic", "slip", "strength", "healing", "area"};
using FrictionNumbers             = std::array<double*, 6>;
FrictionNumbers numbersOf(impact::PairLaw& law) {
	::dembark::FinnieRabinowicz& f = law.friction;
	return {&f.static_friction,          &f.kinetic_friction, &f.critical_slip_distance,
	        &f.interface_shear_strength, &f.healing_time,     &law.contact_area};
}
constexpr Real withoutFriction[] = {0.0, 0.0, 0.0, ::dembark::unlimited_strength, 0.0, 0.0};

impact::PairLaw frictionLaw(const Real* numbers) {
	impact::PairLaw law;
	for (double* to : numbersOf(law)) *to = *numbers++;
	return law;
}

/// Python's own text of a value, for messages.
std::string shown(const py::object& value) { return py::extract<std::string>(py::str(value)); }

Real number(const py::object& value, const std::string& what) {
	// A bool is a number in Python, but not here.
	if (!PyBool_Check(value.ptr())) {
		py::extract<double> plain(value);
		if (plain.check() && std::isfinite(plain())) return plain();
	}
	fail(what + " is " + shown(value) + "; it must be a finite number");
}

bool isDict(const py::object& value) { return PyDict_Check(value.ptr()); }
bool isText(const py::object& value) { return PyUnicode_Check(value.ptr()); }

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

using Parse = std::function<std::vector<Real>(const py::object& value, const std::string& what)>;
using Show  = std::function<py::object(const Real* numbers)>;

/// One value for all, or a dict by materials or pairs of them.
std::vector<Real> read(const Table& table, const py::object& value, const std::string& what, const Parse& parse) {
	std::vector<Real> rows;
	const auto        add = [&](std::initializer_list<Real> ids, const py::object& each, const std::string& where) {
		const std::vector<Real> numbers = parse(each, where);
		rows.insert(rows.end(), ids);
		rows.insert(rows.end(), numbers.begin(), numbers.end());
	};
	const py::list items = isDict(value) ? py::list(py::extract<py::dict>(value)().items()) : py::list();
	if (py::len(items) == 0 || (table.keys == 2 && isText(items[0][0]))) {
		table.keys == 1 ? add({-1}, value, what) : add({-1, -1}, value, what);
		return rows;
	}
	for (py::ssize_t i = 0; i < py::len(items); ++i) {
		const py::object  key   = items[i][0];
		const std::string where = what + "[" + shown(key) + "]";
		if (table.keys == 1) {
			add({material(key, what)}, items[i][1], where);
			continue;
		}
		if (!PyTuple_Check(key.ptr()) || py::len(key) != 2)
			fail(what + ": the key " + shown(key) + " is no pair; write {(material, material): friction, ...}");
		add({material(key[0], what), material(key[1], what)}, items[i][1], where);
	}
	return rows;
}

py::object toPython(const Table& table, const std::vector<Real>& rows, const Show& show) {
	if (rows.empty()) return py::object();
	if (rows[0] < 0.0) return show(&rows[table.keys]);
	py::dict result;
	for (std::size_t i = 0; i < rows.size(); i += table.keys + table.width) {
		const int first = static_cast<int>(rows[i]), last = static_cast<int>(rows[i + table.keys - 1]);
		result[table.keys == 1 ? py::object(first) : py::make_tuple(first, last)] = show(&rows[i + table.keys]);
	}
	return result;
}

/// A number that must be > 0, or >= 0.
Parse atLeast(bool positive, const char* must) {
	return [=](const py::object& value, const std::string& what) {
		const Real x = number(value, what);
		if (!(positive ? x > 0.0 : x >= 0.0)) fail(what + " is " + dembark_yade::text(x) + "; it must be " + must);
		return std::vector<Real>{x};
	};
}

/// One friction law: a coefficient, or a dict of words.
std::vector<Real> friction(const py::object& value, const std::string& what) {
	std::vector<Real> numbers(withoutFriction, withoutFriction + byPair.width);
	if (isDict(value)) {
		const py::dict words = py::extract<py::dict>(value);
		const py::list keys  = words.keys();
		for (py::ssize_t i = 0; i < py::len(keys); ++i) {
			const std::string word  = shown(keys[i]);
			const auto        found = std::find(std::begin(frictionWords), std::end(frictionWords), word);
			if (found == std::end(frictionWords))
				fail(what + ": '" + word + "' is unknown; the words are static, kinetic, slip, strength, healing, area");
			numbers[found - std::begin(frictionWords)] = number(words[word], what + "['" + word + "']");
		}
		if (!words.has_key("static")) fail(what + " has no 'static'; give at least the static friction coefficient");
		if (!words.has_key("kinetic")) numbers[1] = numbers[0];
	} else {
		numbers[0] = numbers[1] = number(value, what);
	}
	const impact::PairLaw pair = frictionLaw(numbers.data());
	if (const char* wrong = pair.friction.error()) fail(what + ": " + wrong);
	if (!(pair.contact_area >= 0.0))
		fail(what + ": area is " + dembark_yade::text(pair.contact_area) +
		     "; it must be > 0 m^2, or 0 = that of the contact of two circles");
	return numbers;
}

py::object oneNumber(const Real* numbers) { return py::object(*numbers); }

py::object frictionToPython(const Real* numbers) {
	py::dict words;
	for (std::size_t i = 0; i < byPair.width; ++i) words[frictionWords[i]] = numbers[i];
	return words;
}

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

using lcp_input::byMaterial;
using lcp_input::byPair;

void LogWall::postLoad(LogWall&) {
	const std::string where = "LogWall" + (name.empty() ? "" : " '" + name + "'");
	// Attributes arrive one after the other; LcpImpact asks for those that never came.
	if (!(stiffness >= 0.0) || !std::isfinite(stiffness))
		fail(where + ".stiffness is " + dembark_yade::text(stiffness) + "; it must be > 0 N/m");
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
	if (!value.is_none()) frictionRows = lcp_input::friction(value, "LogWall.friction");
}

void LcpImpact::postLoad(LcpImpact&) {
	const auto must = [](bool right, const char* name, double value, const char* what) {
		if (!right || !std::isfinite(value))
			fail(std::string("LcpImpact.") + name + " is " + dembark_yade::text(value) + "; it must be " + what);
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
	const auto name = [](int id) {
		return id < 0 ? std::string("a material that is not in O.materials") : "material " + std::to_string(id);
	};
	const auto one = [&](const std::vector<Real>& rows, int id, const char* what) {
		const Real* found = byMaterial.find(rows, id);
		if (!found) fail(std::string("LcpImpact.") + what + " has no value for " + name(id) + "; add it to the dict");
		return *found;
	};
	const auto law = [&](const Real* friction) {
		impact::PairLaw pair            = lcp_input::frictionLaw(friction);
		pair.tangential_stiffness_ratio = tangentialRatio;
		pair.contact_damping            = contactDamping;
		return pair;
	};
	const auto between = [&](int a, int b) {
		const Real* found = frictionRows.empty() ? lcp_input::withoutFriction : byPair.find(frictionRows, a, b);
		if (!found) fail("LcpImpact.friction has no value for " + name(a) + " and " + name(b) + "; add the pair to the dict");
		return found;
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
		result.materials.push_back(
			{one(stiffnessRows, a, "stiffness"), dampingRows.empty() ? 0.0 : one(dampingRows, a, "damping")});
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

boost::python::object LcpImpact::getStiffness() const { return lcp_input::toPython(byMaterial, stiffnessRows, lcp_input::oneNumber); }
void                  LcpImpact::setStiffness(const boost::python::object& value) {
	stiffnessRows = lcp_input::read(byMaterial, value, "LcpImpact.stiffness", lcp_input::atLeast(true, "> 0 N/m"));
}

boost::python::object LcpImpact::getDamping() const { return lcp_input::toPython(byMaterial, dampingRows, lcp_input::oneNumber); }
void                  LcpImpact::setDamping(const boost::python::object& value) {
	dampingRows = lcp_input::read(byMaterial, value, "LcpImpact.damping", lcp_input::atLeast(false, ">= 0 N s/m"));
}

boost::python::object LcpImpact::getFriction() const { return lcp_input::toPython(byPair, frictionRows, lcp_input::frictionToPython); }
void                  LcpImpact::setFriction(const boost::python::object& value) {
	frictionRows = lcp_input::read(byPair, value, "LcpImpact.friction", lcp_input::friction);
}

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
		if (object.check()) {
			walls.push_back(object());
		} else if (lcp_input::isDict(each)) {
			boost::python::tuple none;
			boost::python::dict  words = boost::python::extract<boost::python::dict>(each)().copy();
			walls.push_back(Serializable_ctor_kwAttrs<LogWall>(none, words));
		} else {
			fail(form);
		}
	}
	wallList = walls;
}

}  // namespace yade
