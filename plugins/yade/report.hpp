// How the classes of this plugin tell a user's mistake.
#pragma once

#include <Python.h>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace yade::dembark_yade {

/// Throws std::runtime_error to Python where that can be: in a thread that holds the interpreter. From a loop that YADE runs with OpenMP
/// no exception can leave, and YADE's simulation thread loses its text: there the line goes to stderr and the process ends with
/// `code`, 2 for wrong input and 1 for a run that failed.
[[noreturn]] inline void fail(const std::string& line, int code = 2) {
#ifdef _OPENMP
	const bool parallel = omp_get_level() > 0;
#else
	const bool parallel = false;
#endif
	if (parallel || !PyGILState_Check()) {
		std::fprintf(stderr, "dembark: %s\n", line.c_str());
		std::fflush(nullptr);
		std::_Exit(code);
	}
	throw std::runtime_error("dembark: " + line);
}

/// Shortest of the usual forms of a number, for such lines.
inline std::string text(double value) {
	char buffer[32];
	std::snprintf(buffer, sizeof buffer, "%.6g", value);
	return buffer;
}

}  // namespace yade::dembark_yade
