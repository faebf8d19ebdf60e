// How the classes of this plugin tell a user's mistake: in one line, as a RuntimeError of Python that leaves the session as it is.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "dembark/message_text.hpp"

struct _object;  // PyObject

namespace yade {

class Scene;

namespace dembark_yade {

/// Throws std::runtime_error with "dembark: " and the line. A script that runs by `yade -x` ends with this line and `code`, 2 for
/// wrong input and 1 for a run that failed. From a loop that YADE runs with OpenMP no exception can leave: what YADE calls there
/// must catch it and postpone() it.
[[noreturn]] void fail(const std::string& line, int code = 2);
/// The same by the exception of Python `kind`, for what a script does outside of a run.
[[noreturn]] void failAs(_object* kind, const std::string& line);
/// Writes "WARNING: dembark: " and the line to stderr.
void warn(const std::string& line);

/// In a catch block: lets the engine after the present one throw what was caught in a parallel loop; outside of one throws it on.
void postpone(Scene& scene, const std::exception& error, bool inCollider = false);
/// Whether that is still to come: then nothing in the loop counts any more.
bool postponed(const Scene& scene);

/// A number in such lines.
inline std::string text(double value) { return ::dembark::number_text(value); }

/// Sets `option` to the one of `names` that an attribute holds; fails with one line for another word.
template <class Option>
void choose(const std::string& attribute, const std::string& word, const std::vector<std::string>& names, Option& option) {
	if (!::dembark::option_from_name(names, word, option))
		fail(attribute + " is '" + word + "'; it must be " + ::dembark::names_text(names));
}

}  // namespace dembark_yade

}  // namespace yade
