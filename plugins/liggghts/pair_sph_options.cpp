#include "pair_sph_options.h"

#include <cmath>

#include "dembark/keyword_reader.hpp"

namespace dembark_liggghts {

using namespace dembark::sph;
using dembark::keywords::Reader;
using dembark::keywords::refuse;
using dembark::keywords::text;

/// A whole number of steps, 0: never.
static int read_interval(Reader &in, const std::string &of) {
  const double steps = in.number(of, "the steps from one filter to the next, 0: never");
  if (!(steps >= 0.0 && steps <= 1e9 && steps == std::floor(steps))) refuse(of + ": the steps are a whole number >= 0, not " + text(steps));
  return int(steps);
}

Settings read_fluid_settings(const std::vector<std::string> &words, int dimension) {
  Reader in(words);
  Settings s;
  s.dimension = dimension;
  s.state.sound_speed = 0.0;
  const std::vector<std::string> no_yes{"no", "yes"};
  while (in.left()) {
    const std::string of = in.word("sph/coupled", "a keyword");
    if (of == "spacing") s.spacing = in.number(of, "dx (m)");
    else if (of == "sound_speed") s.state.sound_speed = in.number(of, "c (m/s)");
    else if (of == "density") s.state.density = in.number(of, "the density at no pressure (kg/m^3)");
    else if (of == "gamma") s.state.gamma = in.number(of, "the exponent");
    else if (of == "tension") s.state.tension = in.choice(of, "the value", no_yes) == 1;
    else if (of == "smoothing") s.smoothing = in.number(of, "h over the spacing");
    else if (of == "kernel") s.kernel = KernelName(in.choice(of, "the kernel", kernel_names()));
    else if (of == "alpha") s.alpha = in.number(of, "the coefficient");
    else if (of == "delta") s.delta = in.number(of, "the coefficient");
    else if (of == "boundary") s.boundary = Boundary(in.choice(of, "the pressure of walls", boundary_names()));
    else if (of == "moment") s.moment = Moment(in.choice(of, "what gradients are divided by", moment_names()));
    else if (of == "no_slip") s.no_slip = in.choice(of, "the value", no_yes) == 1;
    else if (of == "shifting") s.shifting.coefficient = in.number(of, "the coefficient");
    else if (of == "xsph") s.xsph.epsilon = in.number(of, "epsilon");
    else if (of == "shepard") s.shepard = read_interval(in, of);
    else if (of == "coupling") {
      if (in.choice(of, "the force between fluid and bodies", {"pressure", "potential"}) == 0) continue;
      s.contact.stiffness = in.positive(of, "K (Pa/m^3, in the plane Pa/m^2)");
      const double exponent = in.at_least(1.0, of, "the exponent n");
      if (exponent != std::floor(exponent) || exponent > 100.0) refuse(of + ": n is a whole number from 1 to 100, not " + text(exponent));
      s.contact.exponent = int(exponent);
    } else {
      refuse("'" + of +
             "' is no keyword; known are spacing, sound_speed, density, gamma, tension, smoothing, kernel, alpha, delta, "
             "boundary, no_slip, moment, shifting, xsph, shepard and coupling");
    }
  }
  if (s.spacing == 0.0) refuse("spacing (m) is missing: that of the lattice that the fluid begins as");
  if (s.state.sound_speed == 0.0) refuse("sound_speed (m/s) is missing: ten times the largest speed that will come, or more");
  if (const char *const wrong = s.error()) refuse(wrong);
  return s;
}

}  // namespace dembark_liggghts
