#include "self_test.h"

#include <mpi.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <vector>

#include "atom.h"
#include "force.h"
#include "input.h"
#include "modify.h"

#include "pair_dembark_granular.h"

namespace dembark_lammps {
namespace {

using dembark::Vec3;
using LAMMPS_NS::LAMMPS;

constexpr int contacts = 10, steps = 3;
constexpr double dt = 1e-6, density = 2500.0, tolerance = 1e-9;  // s, kg/m^3, of the largest component

/// Contact `k`: no two have the same sizes, overlaps, directions and motions. They do not move, as no fix integrates them.
dembark::ContactBodies contact(int k) {
  dembark::ContactBodies b;
  b.radius_1 = 2e-3 + 1e-4 * k;
  b.radius_2 = 3e-3 - 1e-4 * k;
  const double angle = 0.6 * k, overlap = 2e-6 * (k + 1);
  b.separation = (b.radius_1 + b.radius_2 - overlap) * Vec3<double>{0.8 * std::cos(angle), 0.8 * std::sin(angle), 0.6};
  b.velocity_1 = {0.1, 0.02 * k, -0.3};
  b.velocity_2 = {-0.05 * k, 0.1, 0.2};
  b.angular_velocity_1 = {5.0, -3.0 * k, 8.0};
  b.angular_velocity_2 = {2.0 * k, 4.0, -6.0};
  const auto mass = [](double radius) { return density * 4.0 / 3.0 * M_PI * radius * radius * radius; };
  b.mass_1 = mass(b.radius_1);
  b.mass_2 = mass(b.radius_2);
  return b;
}

std::string text(double value) {
  char digits[32];
  std::snprintf(digits, sizeof digits, " %.17g", value);
  return digits;
}
std::string text(const Vec3<double>& v) { return text(v.x) + text(v.y) + text(v.z); }

std::vector<std::string> script() {
  std::vector<std::string> lines = {"units si",
                                    "atom_style sphere",
                                    "boundary f f f",
                                    "newton off",
                                    "comm_modify vel yes",
                                    "region domain block -0.02 0.22 -0.02 0.02 -0.02 0.02 units box",
                                    "create_box 1 domain",
                                    "neighbor 0.001 bin",
                                    "pair_style dembark/granular presliding partial_slip rolling_resistance elastic_plastic",
                                    "pair_coeff * * youngs_modulus 5e6 poissons_ratio 0.3 restitution 0.5 static_friction 0.6 "
                                    "kinetic_friction 0.5 critical_slip_distance 1e-5 "
                                    "interface_shear_strength 1e5 rolling_friction 0.1",
                                    "timestep" + text(dt)};
  const auto grain = [&](int id, const Vec3<double>& x, double radius, const Vec3<double>& v, const Vec3<double>& spin) {
    lines.push_back("create_atoms 1 single" + text(x) + " units box");
    lines.push_back("set atom " + std::to_string(id) + " diameter" + text(2.0 * radius) + " density" + text(density) + " vx" + text(v.x) +
                    " vy" + text(v.y) + " vz" + text(v.z) + " omega" + text(spin));
  };
  for (int k = 0; k < contacts; ++k) {
    const dembark::ContactBodies b = contact(k);
    const Vec3<double> middle{0.02 * k, 0.0, 0.0};
    grain(2 * k + 1, middle + 0.5 * b.separation, b.radius_1, b.velocity_1, b.angular_velocity_1);
    grain(2 * k + 2, middle - 0.5 * b.separation, b.radius_2, b.velocity_2, b.angular_velocity_2);
  }
  lines.push_back("run " + std::to_string(steps));
  return lines;
}

std::string compare(LAMMPS* lammps) {
  using LAMMPS_NS::PairDembarkGranular;
  const auto* const pair = dynamic_cast<PairDembarkGranular*>(lammps->force->pair);
  if (!pair || lammps->atom->nlocal != 2 * contacts) return "LAMMPS has not taken the grains or the pair style";
  std::vector<std::array<Vec3<double>, 2>> found(2 * contacts);
  for (int i = 0; i < lammps->atom->nlocal; ++i)
    found.at(std::size_t(lammps->atom->tag[i] - 1)) = {dembark_family::vector(lammps->atom->f[i]),
                                                       dembark_family::vector(lammps->atom->torque[i])};
  for (int k = 0; k < contacts; ++k) {
    const dembark::ContactBodies b = contact(k);
    dembark::ContactState state;
    dembark::ContactForce right;
    for (int step = 0; step < steps; ++step) right = contact_step(pair->coefficients()(1, 1), b, dt, state);
    const auto differ = [](const Vec3<double>& one, const Vec3<double>& other) { return !(norm(one - other) <= tolerance * norm(other)); };
    const auto &first = found[std::size_t(2 * k)], &second = found[std::size_t(2 * k + 1)];
    if (differ(first[0], right.force) || differ(second[0], -right.force))
      return "the force of contact " + std::to_string(k + 1) + " is wrong";
    if (differ(first[1], right.torque_1) || differ(second[1], right.torque_2))
      return "the torque of contact " + std::to_string(k + 1) + " is wrong";
  }
  return "";
}

/// Sets an environment variable back when it goes.
class Hidden {
 public:
  explicit Hidden(const char* name) : name_(name), was_(std::getenv(name) ? std::getenv(name) : "") { unsetenv(name); }
  ~Hidden() {
    if (!was_.empty()) setenv(name_, was_.c_str(), 1);
  }

 private:
  const char* name_;
  std::string was_;
};

}  // namespace

void enter(PluginStyle* style, void* host) {
  using namespace LAMMPS_NS;
  LAMMPS* const lammps = static_cast<LAMMPS*>(host);
  if (std::strcmp(style->style, "pair") == 0)
    (*lammps->force->pair_map)[style->name] = reinterpret_cast<Force::PairCreator>(style->creator.pair);
  else if (std::strcmp(style->style, "fix") == 0)
    (*lammps->modify->fix_map)[style->name] = reinterpret_cast<Modify::FixCreator>(style->creator.fix);
  else (*lammps->input->command_map)[style->name] = reinterpret_cast<Input::CommandCreator>(style->creator.command);
}

std::string self_test(void (*initialize)(void*, void*, void*)) {
  // Plugins that it loaded would be missing in the LAMMPS that asks.
  const Hidden plugins("LAMMPS_PLUGIN_PATH");
  std::vector<std::string> arguments = {"lammps", "-screen", "none", "-log", "none", "-nocite"};
  std::vector<char*> argv;
  for (std::string& word : arguments) argv.push_back(word.data());
  argv.push_back(nullptr);
  try {
    // It is never destroyed: with it LAMMPS would unload the plugins of all others.
    auto* const lammps = new LAMMPS(int(arguments.size()), argv.data(), MPI_COMM_SELF);
    initialize(lammps, nullptr, reinterpret_cast<void*>(&enter));
    for (const std::string& line : script()) lammps->input->one(line);
    return compare(lammps);
  } catch (const std::exception& wrong) {
    // LAMMPS adds the line of the script.
    const std::string text = wrong.what();
    return text.substr(0, text.find('\n'));
  }
}

}  // namespace dembark_lammps
