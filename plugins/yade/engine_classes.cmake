# YADE's classes define their Python and serialization code inside the class, so every translation unit that sees such a class compiles
# that code again, and most of the time of a build goes there. A translation unit need not: the library that owns the class has it.
#
#   dembark_declare_engine_classes(HEADER <out> SOURCE_DIR <YADE's source tree> FOLDERS <core pkg/common ...> SOURCES <files ...>)
#
# writes HEADER, which is to be included first (-include) by SOURCES. It includes those of YADE's headers in FOLDERS that SOURCES include,
# with these members declared and not defined. The classes keep their layout: the same members are virtual, in the same order. FOLDERS
# must not own SOURCES. The wrappers of Boost.Python and of the archives run once a call from Python or once a file, so they are optimised
# less. What the loops of a simulation are made of is included before them: GCC inlines no function into one that is optimised more.
function(dembark_declare_engine_classes)
  cmake_parse_arguments(PARSE_ARGV 0 given "" "HEADER;SOURCE_DIR" "FOLDERS;SOURCES")
  list(JOIN given_FOLDERS "|" folders)
  set(included "")
  foreach(source ${given_SOURCES})
    file(STRINGS ${source} lines REGEX "^ *#[ \t]*include *[<\"](${folders})/[^/]*\\.hpp[>\"]")
    foreach(line ${lines})
      string(REGEX REPLACE "^[^<\"]*[<\"]([^>\"]*).*" "\\1" path "${line}")
      # YADE includes these only with the features they belong to.
      if(EXISTS ${given_SOURCE_DIR}/${path} AND NOT path MATCHES "/(Subdomain|MPIBodyContainer|OpenGLRenderer|G[Ll][^/]*)\\.hpp$")
        # A header that includes one of another folder could declare what SOURCES have to define.
        file(STRINGS ${given_SOURCE_DIR}/${path} foreign REGEX "^ *#[ \t]*include *[<\"](pkg|preprocessing|lib/opengl)/")
        list(FILTER foreign EXCLUDE REGEX "[<\"](${folders})/")
        file(STRINGS ${given_SOURCE_DIR}/${path} once REGEX "^#pragma once" LIMIT_COUNT 1)
        if(once AND NOT foreign)
          list(APPEND included ${path})
        endif()
      endif()
    endforeach()
  endforeach()
  list(REMOVE_DUPLICATES included)
  list(SORT included)
  set(text [[
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <complex>
#include <deque>
#include <fstream>
#include <functional>
#include <iomanip>
#include <iostream>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>
#include <boost/array.hpp>
#include <boost/foreach.hpp>
#include <boost/function.hpp>
#include <boost/make_shared.hpp>
#include <boost/optional.hpp>
#include <boost/range.hpp>
#include <boost/scoped_ptr.hpp>
#include <boost/shared_ptr.hpp>
#include <boost/tuple/tuple.hpp>
#include <boost/weak_ptr.hpp>
#include <boost/enable_shared_from_this.hpp>
#include <boost/smart_ptr/scoped_array.hpp>
#include <boost/smart_ptr/shared_array.hpp>
#pragma GCC push_options
#pragma GCC optimize("O1")
#include <boost/archive/binary_iarchive.hpp>
#include <boost/archive/binary_oarchive.hpp>
#include <boost/archive/xml_iarchive.hpp>
#include <boost/archive/xml_oarchive.hpp>
#include <boost/python.hpp>
#include <boost/serialization/export.hpp>
#pragma GCC pop_options
#include <lib/serialization/Serializable.hpp>
#pragma push_macro("_YADE_CLASS_BASE_DOC_ATTRS_DEPREC_PY")
#undef _YADE_CLASS_BASE_DOC_ATTRS_DEPREC_PY
#define _YADE_CLASS_BASE_DOC_ATTRS_DEPREC_PY(thisClass, baseClass, doc, attributes, deprecated, extras) \
  _REGISTER_BOOST_ATTRIBUTES(baseClass, attributes)                                                     \
public:                                                                                                 \
  void pySetAttr(const std::string& key, const ::boost::python::object& value) override;                \
  ::boost::python::dict pyDict() const override;                                                        \
  void callPostLoad(void) override;                                                                     \
  REGISTER_CLASS_AND_BASE(thisClass, baseClass)                                                         \
  BOOST_PP_SEQ_FOR_EACH(_ACCESS_DEPREC, thisClass, deprecated)                                          \
  void pyRegisterClass(::boost::python::object scope) override;
]])
  foreach(path ${included})
    string(APPEND text "#include <${path}>\n")
  endforeach()
  string(APPEND text "#pragma pop_macro(\"_YADE_CLASS_BASE_DOC_ATTRS_DEPREC_PY\")\n")
  file(CONFIGURE OUTPUT ${given_HEADER} CONTENT "${text}" @ONLY)
endfunction()
