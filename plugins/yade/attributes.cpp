#include "attributes.hpp"

#include <map>
#include <string>

#include "report.hpp"

namespace yade::dembark_yade {

namespace py = boost::python;

namespace {

const char* const friction = "friction is staticFriction and kineticFriction of the Ip2 functor and of each contact (dembark.set_friction)";
const char* const damping  = "damping follows from restitution of the Ip2 functor and of each contact, and tangentialDamping of the law";
const char* const rolling  = "rolling is rollingFriction of the Ip2 functor, rollingDampingRatio, and rollingResistance of the law";
const char* const elastic =
	"elastic constants follow from the materials; those of a contact are effectiveYoungsModulus and effectiveShearModulus";
const char* const bridges  = "a liquid is bridgeVolume, surfaceTension and contactAngle of the Ip2 functor, and capillaryModel of the law";
const char* const energies = "energies are those of the engine EnergyAccount";
const char* const computed = "the law computes it in every step";

/// What stands here for attributes that the laws of YADE have.
const std::map<std::string, const char*> advice{
	{"tangensOfFrictionAngle", friction},
	{"frictAngle", friction},
	{"frictionAngle", friction},
	{"mu", friction},
	{"betan", damping},
	{"betas", damping},
	{"beta", damping},
	{"en", damping},
	{"es", damping},
	{"et", damping},
	{"tc", damping},
	{"cn", damping},
	{"cs", damping},
	{"useDamping", damping},
	{"eta", rolling},
	{"krot", rolling},
	{"ktwist", rolling},
	{"kr", rolling},
	{"ktw", rolling},
	{"mR", rolling},
	{"mRtype", rolling},
	{"includeMoment", rolling},
	{"momentBend", rolling},
	{"momentTwist", rolling},
	{"kno", elastic},
	{"kso", elastic},
	{"gamma", bridges},
	{"theta", bridges},
	{"Vb", bridges},
	{"capillaryPressure", bridges},
	{"CapillarType", bridges},
	{"Capillar", bridges},
	{"includeAdhesion", "adhesion is cohesion='constant', 'dmt' or 'jkr' of the law"},
	{"adhesionForce", "adhesion is cohesion='constant', 'dmt' or 'jkr' of the law"},
	{"traceEnergy", energies},
	{"calcEnergy", energies},
	{"plasticDissipation", energies},
	{"preventGranularRatcheting", "the tangential displacement follows the rotation of the contact without it"},
	{"neverErase", "contacts live until the surfaces part and their bridge ruptures"},
	{"shearForce", "the law computes it in every step from elasticDisplacement, which can be set"},
	{"usElastic", "the tangential displacement is elasticDisplacement"},
	{"kn", computed},
	{"ks", computed},
	{"normalForce", computed},
};

[[noreturn]] void refuse(const py::object& self, const std::string& name, const char* what) {
	const std::string type  = py::extract<std::string>(self.attr("__class__").attr("__name__"));
	const auto        known = advice.find(name);
	failAs(PyExc_AttributeError, type + what + "'" + name + "'" + (known == advice.end() ? "" : std::string("; ") + known->second));
}

}  // namespace

void setAttribute(const py::object& self, const py::object& name, const py::object& value) {
	PyObject* const type  = reinterpret_cast<PyObject*>(Py_TYPE(self.ptr()));
	PyObject* const found = PyObject_GetAttr(type, name.ptr());
	if (!found) {
		PyErr_Clear();
		refuse(self, py::extract<std::string>(name), " has no attribute ");
	}
	const py::object attribute{py::handle<>(found)};
	if (PyObject_HasAttrString(found, "fset") && py::object(attribute.attr("fset")).is_none())
		refuse(self, py::extract<std::string>(name), ": a script cannot set ");
	if (PyObject_GenericSetAttr(self.ptr(), name.ptr(), value.ptr()) < 0) py::throw_error_already_set();
}

}  // namespace yade::dembark_yade
