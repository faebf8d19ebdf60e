#include <cmath>
#include <stdexcept>
#include <vector>

#include "catch.hpp"

#include "dembark/integration/monitor_run.hpp"

using namespace dembark;

namespace {

/// With tallies, a contact with a wall, and impacts under way.
MonitorRun used() {
  MonitorRun run(MonitorCommand::read({"speed", "2", "length", "0.005", "impacts", "1"}));
  run.begin(1e-5, 0);
  LocalError e;
  e.velocity = {0.1, 0.0, 0.0, 0.0, 0.0, 1.0};
  run.monitor.interval.errors.add(e, 0.0025, 12, run.monitor.settings.scales);
  run.monitor.close_interval();
  run.monitor.take_contact(1e-4, 1e3, 1e-5, 7, monitor_wall);
  ShadowImpact impact;
  impact.one = 3, impact.two = 4, impact.speed = 0.1;
  run.shadows.add({impact, impact});
  return run;
}

bool comes_back(const MonitorRun& run, const std::vector<double>& saved, int process, int processes) {
  MonitorRun again = run;
  again.restore(saved, process, processes);
  return again.saved({again.state()}) == saved;
}

}  // namespace

TEST_CASE("monitor: what was saved comes back", "[monitor]") {
  const MonitorRun run = used();
  const std::vector<double> saved = run.saved({run.state()});
  for (const double number : saved) CHECK_FALSE(std::isnan(number));  // text files keep no bits of these
  CHECK(comes_back(MonitorRun(), saved, 0, 1));
  MonitorRun again;
  again.restore(saved);
  CHECK(again.monitor.interval.contact.two == monitor_wall);
  CHECK(again.monitor.run.impacts.body == -1);
  CHECK(again.shadows.all().size() == 2);
  CHECK(again.step() == 1e-5);
}

TEST_CASE("monitor: an interval ends in time when the engine counts its steps anew", "[monitor]") {
  MonitorRun run(MonitorCommand::read({"speed", "2", "length", "0.005", "action", "adapt", "rows", "100"}));
  run.begin(1e-5, 1000000);
  CHECK(run.interval_end() == 1000100);
  run.begin(1e-5, 1000040);
  CHECK(run.interval_end() == 1000100);
  run.begin(1e-5, 0);
  CHECK(run.interval_end() == 100);
}

TEST_CASE("monitor: on another number of processes the first has the tallies of all", "[monitor]") {
  const MonitorRun run = used();
  const std::vector<double> saved = run.saved({run.state(), run.state()});
  const auto count = [&](int process, int processes) {
    MonitorRun again;
    again.restore(saved, process, processes);
    return again.monitor.run.errors.velocity.count;
  };
  CHECK(count(0, 2) == 1.0);
  CHECK(count(1, 2) == 1.0);
  CHECK(count(0, 3) == 2.0);
  CHECK(count(1, 3) == 0.0);
}

TEST_CASE("monitor: what is cut off, too long or of another version is refused", "[monitor]") {
  const MonitorRun run = used();
  const std::vector<double> saved = run.saved({run.state()});
  MonitorRun again;
  for (std::size_t size = 0; size < saved.size(); ++size)
    CHECK_THROWS_AS(again.restore({saved.begin(), saved.begin() + std::ptrdiff_t(size)}), std::invalid_argument);
  std::vector<double> other = saved;
  other.push_back(0.0);
  CHECK_THROWS_AS(again.restore(other), std::invalid_argument);
  other = saved;
  other[0] += 1.0;
  CHECK_THROWS_WITH(again.restore(other), "the saved state is that of another version of dembark");
  CHECK_THROWS_WITH(again.restore(run.saved({})), Catch::Contains("of no process"));
}
