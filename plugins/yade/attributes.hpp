// Names that scripts set on objects of this plugin. Boost.Python takes any name in silence, so that an attribute of another law
// (i.phys.tangensOfFrictionAngle, ip2.betan) or a misspelt one would do nothing.
#pragma once

#include <boost/python.hpp>

namespace yade::dembark_yade {

/// Sets an attribute that the class of `self` has; AttributeError, with what to set in its place, for another one and for one that can
/// only be read.
void setAttribute(const boost::python::object& self, const boost::python::object& name, const boost::python::object& value);

}  // namespace yade::dembark_yade

/// Among the Python definitions of each class; a derived class inherits it.
#define DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES .def("__setattr__", &::yade::dembark_yade::setAttribute)
