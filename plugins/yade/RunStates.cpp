// Saved states of a run and its output files, for yade.dembark.states; the rules are those of dembark/restart.
#include <core/Omega.hpp>
#include <lib/serialization/Serializable.hpp>

#include "attributes.hpp"
#include "dembark/restart/run_record.hpp"
#include "dembark/restart/state_files.hpp"
#include "report.hpp"

namespace yade {

namespace states = ::dembark::restart;

class DembarkStates : public Serializable {
public:
	virtual ~DembarkStates() = default;
	static long                  newest(const std::string& base) { return states::newest_state(base, ending).step; }
	static void                  keep(const std::string& part, const std::string& base, long step);
	static void                  remove(const std::string& base) { states::delete_states(base, 0, ending); }
	static std::string           record(const std::vector<std::string>& outputs);
	static boost::python::list   cut(const std::vector<std::string>& outputs, const std::string& record, long step);
	static constexpr const char* ending = ".yade.gz";
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(DembarkStates,Serializable,"States of a run, files base.<step>.yade.gz with a check sum next to each, and its output files; for yade.dembark.run.",
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.def("newest",&DembarkStates::newest,"Step of the newest state that is complete; -1 = none.").staticmethod("newest")
		.def("keep",&DembarkStates::keep,"Make the saved scene `part` the state of a step, and delete all but the last two.").staticmethod("keep")
		.def("remove",&DembarkStates::remove,"Delete all states.").staticmethod("remove")
		.def("record",&DembarkStates::record,"Lengths and hashes of the files that are there, as a text.").staticmethod("record")
		.def("cut",&DembarkStates::cut,"Cut the files to their length in the `record` of a step, others before the rows and frames of that step. Returns lines about what could not be done.").staticmethod("cut")
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(DembarkStates);

YADE_PLUGIN((DembarkStates));

namespace {

template <class Work>
auto ofFiles(const Work& work) {
	try {
		return work();
	} catch (const std::runtime_error& wrong) {
		dembark_yade::fail(wrong.what(), 1);
	}
}

}  // namespace

void DembarkStates::keep(const std::string& part, const std::string& base, long step) {
	ofFiles([&] { states::keep_state(part, base, {step, {1, 1, 1}}, ending); });
}

std::string DembarkStates::record(const std::vector<std::string>& outputs) {
	for (const std::string& path : outputs) states::sync_file(path);
	states::RunRecord run;
	run.files = states::output_files(outputs);
	return run.text();
}

boost::python::list DembarkStates::cut(const std::vector<std::string>& outputs, const std::string& record, long step) {
	boost::python::list lines;
	// The rows of a step are written in its beginning.
	const auto said =
		ofFiles([&] { return states::cut_outputs(outputs, states::RunRecord::read(record).files, step, step - 1, false); });
	for (const std::string& line : said) lines.append(line);
	return lines;
}

}  // namespace yade
