#include "fix_sph_contact.h"

#include <algorithm>
#include <stdexcept>

#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "update.h"

#include "dembark/keyword_reader.hpp"
#include "fix_sph_body.h"
#include "pair_sph_coupled.h"

using namespace LAMMPS_NS;
using namespace FixConst;
using namespace dembark::sph;
using dembark::keywords::Reader;
using dembark::keywords::text;

FixSphContact::FixSphContact(LAMMPS *lmp, int narg, char **arg) : SharedFix(lmp, narg, arg) {
  if (domain->dimension != 3) fail("boxes are for three dimensions");
  checked([&] { read(std::vector<std::string>(arg + 3, arg + narg)); });
  restart_global = 1;
  vector_flag = 1;
  size_vector = 3;
  global_freq = 1;
  extvector = 0;
}

void FixSphContact::read(const std::vector<std::string> &words) {
  Reader in(words);
  double friction = 0.5, restitution = 0.5, shortest = 0.0;
  bool stiff = false;
  while (in.left()) {
    const std::string of = in.word("sph/contact", "a keyword");
    if (of == "stiffness") {
      contacts_.stiffness = in.positive(of, "k of a corner (N/m)");
      stiff = true;
    } else if (of == "rounding") {
      contacts_.radius = in.positive(of, "the radius of edges and corners (m)");
    } else if (of == "friction") {
      friction = in.number(of, "the coefficient between boxes");
    } else if (of == "friction_speed") {
      contacts_.friction_speed = in.number(of, "the speed (m/s) of friction, 0: Coulomb's with a spring");
      if (!(contacts_.friction_speed >= 0.0)) dembark::keywords::refuse("friction_speed must not be negative");
    } else if (of == "restitution") {
      restitution = in.number(of, "the coefficient between boxes");
    } else if (of == "slit_pressure") {
      slit_pressure_ = in.number(of, "the share of the pressure around it that a film has, 0 ... 1");
      if (!(slit_pressure_ >= 0.0 && slit_pressure_ <= 1.0)) dembark::keywords::refuse("slit_pressure must be between 0 and 1");
    } else if (of == "box") {
      names_.push_back(in.word(of, "the ID of a fix sph/body"));
      const double a = in.positive(of, "an edge (m)"), b = in.positive(of, "an edge (m)"), c = in.positive(of, "an edge (m)");
      contacts_.half.push_back(0.5 * Vector{a, b, c});
      const double least = std::min({a, b, c});
      shortest = names_.size() == 1 ? least : std::min(shortest, least);
    } else if (of == "plane") {
      ContactPlane plane;
      plane.point = read_vector(in, of, "x, y and z of a point (m)");
      plane.normal = read_vector(in, of, "x, y and z of the normal, into the space of the boxes");
      const double length = norm(plane.normal);
      if (!(length > 0.0)) dembark::keywords::refuse("plane: the normal must not be zero");
      plane.normal = (1.0 / length) * plane.normal;
      const double mu = in.number(of, "the coefficient of friction"), e = in.number(of, "the coefficient of restitution");
      plane.touch = Touch::of(e, mu);
      if (const char *const wrong = plane.touch.error()) dembark::keywords::refuse(std::string("plane: ") + wrong);
      contacts_.planes.push_back(plane);
    } else {
      dembark::keywords::refuse("'" + of +
                                "' is no keyword; known are stiffness, rounding, friction, friction_speed, restitution, slit_pressure, box "
                                "and plane");
    }
  }
  contacts_.between = Touch::of(restitution, friction);
  if (const char *const wrong = contacts_.between.error()) dembark::keywords::refuse(wrong);
  if (!stiff) dembark::keywords::refuse("stiffness (N/m) is missing: of one corner");
  if (names_.empty()) dembark::keywords::refuse("there is no box; name fixes sph/body with their edges");
  if (!(2.0 * contacts_.radius < shortest))
    dembark::keywords::refuse("rounding must be less than half of the shortest edge, " + text(shortest) + " m, not " +
                              text(contacts_.radius) + " m");
}

int FixSphContact::setmask() { return POST_FORCE; }

void FixSphContact::init() {
  fixes_.clear();
  bodies_.clear();
  for (const std::string &name : names_) {
    const int at = modify->find_fix(name.c_str());
    auto *const solid = at < 0 ? nullptr : dynamic_cast<FixSphBody *>(modify->fix[at]);
    if (!solid || !solid->body().free) fail("box: '" + name + "' is the ID of no fix sph/body");
    if (std::count(names_.begin(), names_.end(), name) > 1) fail("box: '" + name + "' stands there twice");
    fixes_.push_back(solid);
    bodies_.push_back(&solid->body());
  }
  const double most = contacts_.longest_step(bodies_);
  if (update->dt > most)
    fail("the time step must be at most " + text(most) + " s for this stiffness, not " + text(update->dt) + " s; take a softer one");
  if (slit_pressure_ == 0.0) return;
  PairSphCoupled *const pair = PairSphCoupled::find(force);
  if (!pair) fail(PairSphCoupled::missing);
  std::vector<LatticePlane> planes;
  for (const ContactPlane &plane : contacts_.planes) planes.push_back({plane.point, plane.normal});
  std::vector<int> numbers;
  for (const FixSphBody *const solid : fixes_) numbers.push_back(pair->number(solid));
  checked([&] { pair->films().begin(fixes_, names_, numbers, contacts_.half, planes, slit_pressure_); });
}

/// Forces of the state as it is.
void FixSphContact::setup(int) { push(false); }

void FixSphContact::post_force(int) { push(true); }

/// All ranks have the places of all bodies, and do the same.
void FixSphContact::push(bool remember) {
  const std::vector<ContactWrench> &wrenches = contacts_.push(remember ? update->dt : 0.0, bodies_, remember);
  // Twice as deep, two edges have passed each other, and their springs push on.
  if (!remember && contacts_.deepest > contacts_.radius)
    fail("boxes overlap by " + text(contacts_.deepest) + " m, more than the rounding, " + text(contacts_.radius) +
         " m, as the run begins; put their centres, edges, planes and normals right, or the rounding");
  if (contacts_.deepest > contacts_.radius)
    fail("at step " + std::to_string(update->ntimestep) + " boxes overlap by " + text(contacts_.deepest) + " m, more than the rounding, " +
         text(contacts_.radius) + " m; take a higher stiffness");
  for (std::size_t k = 0; k < fixes_.size(); ++k) fixes_[k]->add_load(wrenches[k].force, wrenches[k].torque);
}

/// Energy in the springs (J), largest overlap (m), how many points touch.
double FixSphContact::compute_vector(int n) { return n == 0 ? contacts_.stored : n == 1 ? contacts_.deepest : double(contacts_.count); }

std::string FixSphContact::written_boxes() const {
  const auto numbers = [](const Vector &v) { return text(v.x) + " " + text(v.y) + " " + text(v.z); };
  std::string all = "rounding " + text(contacts_.radius);
  for (std::size_t k = 0; k < names_.size(); ++k) all += " box " + names_[k] + " " + numbers(2.0 * contacts_.half[k]);
  for (const ContactPlane &plane : contacts_.planes) all += " plane " + numbers(plane.point) + " " + numbers(plane.normal);
  return all;
}

void FixSphContact::write_restart(FILE *file) {
  if (comm->me != 0) return;
  const std::string boxes = written_boxes();
  write_part(file, {{boxes.c_str(), boxes.size() + 1}, {contacts_.stretches.data(), contacts_.stretches.size() * sizeof(Vector)}});
}

void FixSphContact::restart(char *buffer) {
  checked([&] {
    dembark_family::SavedPart part(buffer);
    if (const std::string boxes = part.text(); boxes != written_boxes())
      throw std::invalid_argument("the state has contacts of '" + boxes + "', not of '" + written_boxes() + "'");
    contacts_.stretches = part.rest<Vector>();
  });
}
