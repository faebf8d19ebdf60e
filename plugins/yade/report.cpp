#include <Python.h>

#include "report.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <iostream>
#include <mutex>
#include <utility>
#include <vector>

#include <boost/python/errors.hpp>

#include <core/Engine.hpp>
#include <core/Scene.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace yade::dembark_yade {

namespace {

struct Failure : std::runtime_error {
	Failure(const std::string& line, int exitCode) : std::runtime_error(line), code(exitCode) {}
	int code;
};

bool parallel() {
#ifdef _OPENMP
	return omp_get_level() > 0;
#else
	return false;
#endif
}

/// Leaves the line where the start script reads it; with the interpreter.
void announce(const std::string& line, int code, bool logged) {
	PyObject* said = Py_BuildValue("(siO)", line.c_str(), code, logged ? Py_True : Py_False);
	PySys_SetObject("dembark_failure", said);
	Py_XDECREF(said);
}

[[noreturn]] void raise(const std::string& line, int code) {
	// In YADE's own thread the interpreter is only free once the main thread waits for the run: O.wait overlooks one that ends before.
	// YADE writes what ends that thread into its log; the start script need not say it again.
	const bool             logged = !PyGILState_Check();
	const PyGILState_STATE held   = PyGILState_Ensure();
	announce(line, code, logged);
	PyGILState_Release(held);
	throw std::runtime_error(line);
}

/// The first failure of a parallel loop, and the engines in whose places others stand that will raise it.
std::mutex                      guard;
std::atomic<bool>               waiting{false};
std::vector<shared_ptr<Engine>> replaced;
long                            stopAt = 0;
Failure                         first("", 0);

class RaiseFailure : public Engine {
public:
	void action() override {
		const std::vector<shared_ptr<Engine>> all = scene->engines;  // this engine lives until the function ends
		std::copy(replaced.begin(), replaced.end(), scene->engines.begin());
		scene->stopAtIter = stopAt;
		replaced.clear();
		waiting = false;
		raise(first.what(), first.code);
	}
};

bool raises(const Scene& scene) {
	return std::any_of(scene.engines.begin(), scene.engines.end(),
	                   [](const shared_ptr<Engine>& each) { return dynamic_cast<const RaiseFailure*>(each.get()); });
}

}  // namespace

void fail(const std::string& line, int code) {
	if (parallel()) throw Failure("dembark: " + line, code);
	raise("dembark: " + line, code);
}

void failAs(PyObject* kind, const std::string& line) {
	const std::string said = "dembark: " + line;
	announce(said, 2, false);
	PyErr_SetString(kind, said.c_str());
	boost::python::throw_error_already_set();
	std::abort();  // never reached
}

void warn(const std::string& line) { std::cerr << "WARNING: dembark: " << line << std::endl; }

void postpone(Scene& scene, const std::exception& error, bool inCollider) {
	if (!parallel()) throw;
	const std::lock_guard<std::mutex> lock(guard);
	if (raises(scene)) return;
	const auto* known = dynamic_cast<const Failure*>(&error);
	first             = known ? *known : Failure(error.what(), 1);
	replaced          = scene.engines;
	// In their places: YADE goes through this list at the moment. The collider looks for NewtonIntegrator in it.
	for (shared_ptr<Engine>& each : scene.engines)
		if (!(inCollider && dynamic_cast<const NewtonIntegrator*>(each.get()))) each = shared_ptr<Engine>(new RaiseFailure);
	// After the last engine of a step it takes another step.
	stopAt  = std::exchange(scene.stopAtIter, 0);
	waiting = true;
}

bool postponed(const Scene& scene) { return waiting && raises(scene); }

}  // namespace yade::dembark_yade
