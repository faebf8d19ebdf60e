// Fluid, walls and bodies, as the passes of a step (passes.hpp) and adapters share them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "ledger.hpp"
#include "parallel.hpp"
#include "particle_records.hpp"
#include "slits.hpp"
#include "solids.hpp"

namespace dembark::sph {

struct FluidParticles {
  // Of the particles of this process, and then of the images of others'.
  std::vector<Vector> position, velocity;  ///< m, m/s
  std::vector<double> density, pressure;   ///< kg/m^3, Pa
  std::vector<Record> records;             ///< and one far away, as with the sums
  std::vector<double> rate, diffused;      ///< of density, kg/m^3/s; its diffusion apart where moments are summed
  std::vector<double> correction;          ///< moment_correction()
  std::vector<Quad> sum, shift_sum;        ///< accelerations but for gravity, m/s^2; of shifting, of XSPH
  // Of its own particles.
  std::vector<int> id;                      ///< number as they were given
  std::vector<Vector> acceleration, shift;  ///< m/s^2, m
  std::vector<Rows> pairs;                  ///< each pair once, by slabs of particles
  Rows border;                              ///< images near its particles; another process has the same pairs

  int size() const { return int(id.size()); }
  int with_images() const { return int(position.size()); }
};

struct Scene {
  Settings settings{};
  FluidParticles fluid{};
  std::vector<Solids> solids = std::vector<Solids>(2);  ///< those that act by pressure, and those that act by the contact potential
  std::vector<Body> bodies;
  Slits slits{};
  Energies lost{};  ///< losses and work so far
  long step = 0;    ///< number of the last step, or of that under way, from 1 on

  bool shifts() const { return settings.shifting.coefficient > 0.0; }
  /// Whether the rates of density come with sums over the places of neighbours.
  bool sums_places() const { return shifts() || settings.corrects(); }
  /// After a search: room for records and sums. far (m): a place beyond the reach of all particles.
  void resize(const Vector& far) {
    const std::size_t n = fluid.position.size() + 1;
    fluid.records.resize(n);
    fluid.rate.resize(n);
    fluid.sum.resize(n);
    if (settings.displaces() || sums_places()) fluid.shift_sum.resize(n);
    if (sums_places()) fluid.diffused.resize(n);
    if (settings.corrects()) fluid.correction.resize(n, 1.0);
    fluid.records.back() = far_record(far);
    for (Solids& set : solids) {
      set.resize();
      set.records.back() = far_record(far);
    }
  }
  /// Calls work(i) for the first n particles of the fluid.
  template <class Work>
  void each(int n, const Work& work) const {
    constexpr int chunk = 2048;
    parallel_for((n + chunk - 1) / chunk, settings.threads, [&](int c) {
      for (int i = c * chunk; i < std::min((c + 1) * chunk, n); ++i) work(i);
    });
  }
};

}  // namespace dembark::sph
