// The laws as a device computes them (device_code.cpp), compared with those that the processor's programs have.
#include "catch.hpp"

#include <cmath>
#include <vector>

#include "dembark/capillary/bridge_law.hpp"
#include "every_law.hpp"

using namespace dembark;

void every_law_as_device_code(const void* bridges, double* results);

TEST_CASE("a device computes the same laws", "[device]") {
  std::vector<capillary::BridgeForce> bridges;
  // Lives as long as its tables are needed.
  const capillary::BridgeLaw exact(capillary::Model::exact, 0.4);
  for (int model = 0; model < tests::bridge_models; ++model)
    bridges.push_back(model == 0 ? exact : capillary::BridgeLaw(static_cast<capillary::Model>(model), 0.4));

  const std::size_t count = std::size_t(tests::law_count) * tests::results_of_path;
  std::vector<double> host(count), device(count);
  tests::follow_every_law(bridges.data(), host.data());
  every_law_as_device_code(bridges.data(), device.data());
  for (std::size_t k = 0; k < count; ++k) {
    CAPTURE(k / tests::results_of_path, k % tests::results_of_path);
    CHECK(std::isfinite(host[k]));
    CHECK(device[k] == host[k]);
  }
}
