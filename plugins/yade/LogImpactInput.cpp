// What a user may write for LogImpact: numbers, dicts by material, walls; read into rows of numbers, which are saved with the scene.
#include "LogImpact.hpp"

#include <core/Omega.hpp>
#include <core/Scene.hpp>

#include "report.hpp"

namespace yade {

using dembark_yade::fail;

namespace log_input {

namespace py = boost::python;

const char* const     frictionWords[] = {"static", "kinetic", "slip", "strength", "healing", "area"};
constexpr std::size_t frictionWidth   = 8;  // two materials and six numbers

/// Python's own text of a value, for messages.
std::string shown(const py::object& value) { return py::extract<std::string>(py::str(value)); }

double number(const py::object& value, const std::string& what) {
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
int material(const py::object& key, const std::string& what) {
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

/// Number, or dict of numbers by material, as rows (material or -1, number); each number must be >= 0, or > 0 when `positive`.
std::vector<Real> perMaterial(const py::object& value, const std::string& what, bool positive) {
	std::vector<Real> rows;
	const auto        add = [&](int id, const py::object& each, const std::string& where) {
		const double x = number(each, where);
		if (!(positive ? x > 0.0 : x >= 0.0))
			fail(where + " is " + dembark_yade::text(x) + "; it must be " + (positive ? "> 0 N/m" : ">= 0 N s/m"));
		rows.push_back(id);
		rows.push_back(x);
	};
	if (!isDict(value)) {
		add(-1, value, what);
		return rows;
	}
	const py::list items = py::extract<py::dict>(value)().items();
	for (py::ssize_t i = 0; i < py::len(items); ++i) {
		const py::object key = items[i][0];
		add(material(key, what), items[i][1], what + "[" + shown(key) + "]");
	}
	return rows;
}

py::object perMaterialToPython(const std::vector<Real>& rows) {
	if (rows.empty()) return py::object();
	if (rows[0] < 0.0) return py::object(rows[1]);
	py::dict result;
	for (std::size_t i = 0; i + 1 < rows.size(); i += 2) result[static_cast<int>(rows[i])] = rows[i + 1];
	return result;
}

/// One friction law: a coefficient, or a dict of words.
std::vector<Real> frictionValue(const py::object& value, const std::string& what) {
	::dembark::FinnieRabinowicz law;
	law.static_friction = law.kinetic_friction = 0.0;
	law.critical_slip_distance                 = 0.0;
	double area                                = 0.0;
	if (isDict(value)) {
		const py::dict words = py::extract<py::dict>(value);
		const py::list keys  = words.keys();
		for (py::ssize_t i = 0; i < py::len(keys); ++i) {
			const std::string word = shown(keys[i]);
			if (std::find(std::begin(frictionWords), std::end(frictionWords), word) == std::end(frictionWords))
				fail(what + ": '" + word + "' is unknown; the words are static, kinetic, slip, strength, healing, area");
		}
		if (!words.has_key("static")) fail(what + " has no 'static'; give at least the static friction coefficient");
		const auto take = [&](const char* word, double otherwise) {
			return words.has_key(word) ? number(words[word], what + "['" + word + "']") : otherwise;
		};
		law.static_friction          = take("static", 0.0);
		law.kinetic_friction         = take("kinetic", law.static_friction);
		law.critical_slip_distance   = take("slip", 0.0);
		law.interface_shear_strength = take("strength", ::dembark::unlimited_strength);
		law.healing_time             = take("healing", 0.0);
		area                         = take("area", 0.0);
	} else {
		law.static_friction = law.kinetic_friction = number(value, what);
	}
	if (const char* wrong = law.error()) fail(what + ": " + wrong);
	if (!(area >= 0.0))
		fail(what + ": area is " + dembark_yade::text(area) + "; it must be > 0 m^2, or 0 = that of the contact of two circles");
	return {law.static_friction,          law.kinetic_friction, law.critical_slip_distance,
	        law.interface_shear_strength, law.healing_time,     area};
}

py::object frictionToPython(const Real* numbers) {
	py::dict words;
	for (int i = 0; i < 6; ++i) words[frictionWords[i]] = numbers[i];
	return words;
}

/// Friction laws by pairs of materials, as rows (material or -1, material or -1, six numbers).
std::vector<Real> frictionPairs(const py::object& value, const std::string& what) {
	std::vector<Real> rows;
	const auto        add = [&](int a, int b, const py::object& law, const std::string& where) {
		rows.push_back(a);
		rows.push_back(b);
		for (const Real x : frictionValue(law, where)) rows.push_back(x);
	};
	const py::list items = isDict(value) ? py::list(py::extract<py::dict>(value)().items()) : py::list();
	if (py::len(items) == 0 || isText(items[0][0])) {
		add(-1, -1, value, what);
		return rows;
	}
	for (py::ssize_t i = 0; i < py::len(items); ++i) {
		const py::object key = items[i][0];
		if (!PyTuple_Check(key.ptr()) || py::len(key) != 2)
			fail(what + ": the key " + shown(key) + " is no pair; write {(material, material): friction, ...}");
		add(material(key[0], what), material(key[1], what), items[i][1], what + "[" + shown(key) + "]");
	}
	return rows;
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

}  // namespace log_input

void LogWall::postLoad(LogWall&) {
	const std::string where = "LogWall" + (name.empty() ? "" : " '" + name + "'");
	// Attributes arrive one after the other; LogImpact asks for those that never came.
	if (!(stiffness >= 0.0) || !std::isfinite(stiffness))
		fail(where + ".stiffness is " + dembark_yade::text(stiffness) + "; it must be > 0 N/m");
	for (const int id : bodies)
		if (id < 0)
			fail(where + ".bodies: " + std::to_string(id) + " is no id of a body; give ids as O.bodies.append returns them");
}

void LogWall::pyHandleCustomCtorArgs(boost::python::tuple&, boost::python::dict& kw) {
	log_input::take<LogWall>(*this, kw, {{"friction", &LogWall::setFriction}});
	if (kw.has_key("bodies") && PyLong_Check(boost::python::object(kw["bodies"]).ptr())) {
		boost::python::list one;
		one.append(kw["bodies"]);
		kw["bodies"] = one;
	}
}

boost::python::object LogWall::getFriction() const {
	return frictionRows.empty() ? boost::python::object() : log_input::frictionToPython(frictionRows.data());
}

void LogWall::setFriction(const boost::python::object& value) {
	frictionRows.clear();
	if (!value.is_none()) frictionRows = log_input::frictionValue(value, "LogWall.friction");
}

void LogImpact::pyHandleCustomCtorArgs(boost::python::tuple&, boost::python::dict& kw) {
	log_input::take<LogImpact>(*this, kw,
	                           {{"stiffness", &LogImpact::setStiffness},
	                            {"damping", &LogImpact::setDamping},
	                            {"friction", &LogImpact::setFriction},
	                            {"walls", &LogImpact::setWalls}});
}

boost::python::object LogImpact::getStiffness() const { return log_input::perMaterialToPython(stiffnessRows); }
void                  LogImpact::setStiffness(const boost::python::object& value) {
	stiffnessRows = log_input::perMaterial(value, "LogImpact.stiffness", true);
}

boost::python::object LogImpact::getDamping() const { return log_input::perMaterialToPython(dampingRows); }
void LogImpact::setDamping(const boost::python::object& value) { dampingRows = log_input::perMaterial(value, "LogImpact.damping", false); }

boost::python::object LogImpact::getFriction() const {
	if (frictionRows.empty()) return boost::python::object();
	if (frictionRows[0] < 0.0) return log_input::frictionToPython(frictionRows.data() + 2);
	boost::python::dict result;
	for (std::size_t i = 0; i + log_input::frictionWidth <= frictionRows.size(); i += log_input::frictionWidth)
		result[boost::python::make_tuple(static_cast<int>(frictionRows[i]), static_cast<int>(frictionRows[i + 1]))] =
			log_input::frictionToPython(&frictionRows[i + 2]);
	return result;
}
void LogImpact::setFriction(const boost::python::object& value) { frictionRows = log_input::frictionPairs(value, "LogImpact.friction"); }

boost::python::list LogImpact::getWalls() const {
	boost::python::list result;
	for (const auto& wall : wallList) result.append(wall);
	return result;
}

void LogImpact::setWalls(const boost::python::object& value) {
	std::vector<shared_ptr<LogWall>> read;
	const char* const                form = "LogImpact.walls must be a list of LogWall objects or of dicts of their attributes";
	if (log_input::isDict(value) || log_input::isText(value) || !PySequence_Check(value.ptr())) fail(form);
	for (boost::python::ssize_t i = 0; i < boost::python::len(value); ++i) {
		const boost::python::object                 each = value[i];
		boost::python::extract<shared_ptr<LogWall>> object(each);
		if (object.check()) {
			read.push_back(object());
		} else if (log_input::isDict(each)) {
			boost::python::tuple none;
			boost::python::dict  words = boost::python::extract<boost::python::dict>(each)().copy();
			read.push_back(Serializable_ctor_kwAttrs<LogWall>(none, words));
		} else {
			fail(form);
		}
	}
	wallList = read;
}

}  // namespace yade
