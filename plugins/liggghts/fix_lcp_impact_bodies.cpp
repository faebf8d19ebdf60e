// Bodies and candidates of fix lcp/impact: from the atoms of all ranks, and back.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "neighbor.h"

#include "fix_lcp_impact.h"

using namespace LAMMPS_NS;
using dembark::impact::Body;
using dembark::impact::Contact;
using dembark_liggghts::ImpactWall;

namespace {

// One body on its way between ranks: tag, type, mass, radius, position, velocity, spin, force, torque.
constexpr int width = 19;

/// I / (m r^2) with which the engine's nve/sphere turns atoms.
double engine_inertia(const Domain &domain) { return domain.dimension == 2 ? 0.5 : 0.4; }

}  // namespace

double FixLcpImpact::inertia_factor() const { return options_.solid_cylinder ? 0.5 : 0.4; }

/// What the model has to know about an own atom, as numbers that travel between ranks.
void FixLcpImpact::read_atom(int i, double *row) const {
  // The engine turns a torque into spin with its own inertia; what the model is told has the same effect with the inertia of a log.
  const double scale = inertia_factor() / engine_inertia(*domain);
  const double *x = atom->x[i], *v = atom->v[i], *w = atom->omega[i], *f = atom->f[i], *t = atom->torque[i];
  const double numbers[width] = {double(atom->tag[i]),
                                 double(atom->type[i]),
                                 atom->rmass[i],
                                 atom->radius[i],
                                 x[0],
                                 x[1],
                                 x[2],
                                 v[0],
                                 v[1],
                                 v[2],
                                 w[0],
                                 w[1],
                                 w[2],
                                 f[0],
                                 f[1],
                                 f[2],
                                 t[0] * scale,
                                 t[1] * scale,
                                 t[2] * scale};
  std::copy(numbers, numbers + width, row);
}

/// Fills bodies_, sorted by tag. Collective.
void FixLcpImpact::gather_bodies() {
  own_atom_.clear();
  for (int i = 0; i < atom->nlocal; ++i)
    if (atom->mask[i] & groupbit) own_atom_.push_back(i);
  std::size_t first = 0, n = own_atom_.size();  // of this rank's rows among all, and how many there are
  const bool alone = comm->nprocs == 1;
  if (!alone) {
    own_row_.resize(n * width);
    for (std::size_t k = 0; k < n; ++k) read_atom(own_atom_[k], &own_row_[k * width]);
    const int count = int(own_row_.size());
    std::vector<int> counts(std::size_t(comm->nprocs)), offsets(std::size_t(comm -> nprocs), 0);
    MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
    for (int r = 1; r < comm->nprocs; ++r) offsets[r] = offsets[r - 1] + counts[r - 1];
    all_row_.resize(std::size_t(offsets.back() + counts.back()));
    MPI_Allgatherv(own_row_.data(), count, MPI_DOUBLE, all_row_.data(), counts.data(), offsets.data(), MPI_DOUBLE, world);
    first = std::size_t(offsets[me_]) / width;
    n = all_row_.size() / width;
  }
  const auto tag = [&](std::size_t row) { return alone ? double(atom->tag[own_atom_[row]]) : all_row_[row * width]; };
  // Atoms seldom change their places in the engine's arrays: the order of the last step is tried first.
  bool sorted = order_.size() == n;
  for (std::size_t i = 1; sorted && i < n; ++i) sorted = tag(order_[i - 1]) < tag(order_[i]);
  if (!sorted) {
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), std::size_t(0));
    std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) { return tag(a) < tag(b); });
  }
  bodies_.resize(n);
  own_body_.resize(own_atom_.size());
  double row[width];
  for (std::size_t i = 0; i < n; ++i) {
    if (alone) read_atom(own_atom_[order_[i]], row);
    const double *v = alone ? row : &all_row_[order_[i] * width];
    if (order_[i] - first < own_body_.size()) own_body_[order_[i] - first] = int(i);
    Body &b = bodies_[i];
    b.id = static_cast<std::int64_t>(v[0]);
    if (i > 0 && bodies_[i - 1].id == b.id) refuse("two atoms have the number " + std::to_string(b.id));
    b.material = int(v[1]) - 1;
    b.mass = v[2];
    b.radius = v[3];
    b.inertia = inertia_factor() * b.mass * b.radius * b.radius;
    b.position = {v[4], v[5], v[6]};
    b.velocity = {v[7], v[8], v[9]};
    b.spin = {v[10], v[11], v[12]};
    b.force = {v[13], v[14], v[15]};
    b.torque = {v[16], v[17], v[18]};
  }
}

void FixLcpImpact::apply() {
  const double scale = engine_inertia(*domain) / inertia_factor();
  for (std::size_t k = 0; k < own_atom_.size(); ++k) {
    const Vec &f = force_[std::size_t(own_body_[k])], &t = torque_[std::size_t(own_body_[k])];
    double *to_f = atom->f[own_atom_[k]], *to_t = atom->torque[own_atom_[k]];
    to_f[0] += f.x;
    to_f[1] += f.y;
    to_f[2] += f.z;
    to_t[0] += scale * t.x;
    to_t[1] += scale * t.y;
    to_t[2] += scale * t.z;
  }
}

/// Appends to `bodies` the images, across periodic boundaries, of those that may touch something there; `origin` gets their indices.
void FixLcpImpact::add_periodic_images(double reach, std::vector<Body> &bodies, std::vector<int> &origin) {
  double largest = 0.0;
  for (const Body &b : bodies) largest = std::max(largest, b.radius);
  // Atoms may be outside of the box by what they move between two neighbour lists.
  const double range = 2.0 * largest + reach + neighbor->skin;
  double Vec::*const axes[3] = {&Vec::x, &Vec::y, &Vec::z};
  for (int k = 0; k < 3; ++k) {
    if (!domain->periodicity[k] || (k == 2 && domain->dimension == 2)) continue;
    if (domain->prd[k] < 2.0 * range) {
      // Between bodies that all lie in one plane across the axis (logs in cross-section) no image can touch anything.
      double low = bodies.front().position.*axes[k], high = low;
      for (const Body &b : bodies) low = std::min(low, b.position.*axes[k]), high = std::max(high, b.position.*axes[k]);
      if (domain->prd[k] - (high - low) > 2.0 * largest + reach) continue;
      refuse(std::string("the periodic box is too short along ") + "xyz"[k] + ": " + std::to_string(domain->prd[k]) +
             " m; a body would touch another one twice; it needs " + std::to_string(2.0 * range) + " m or a boundary that is not periodic");
    }
    const std::size_t n = bodies.size();
    for (std::size_t i = 0; i < n; ++i) {
      const double p = bodies[i].position.*axes[k];
      const double shift = p < domain->boxlo[k] + range ? domain->prd[k] : p > domain->boxhi[k] - range ? -domain->prd[k] : 0.0;
      if (shift == 0.0) continue;
      bodies.push_back(bodies[i]);
      bodies.back().position.*axes[k] += shift;
      origin.push_back(origin[i]);
    }
  }
}

void FixLcpImpact::find_contacts(double reach, std::vector<Contact> &contacts) {
  if (bodies_.empty()) return;
  const bool periodic = domain->xperiodic || domain->yperiodic || domain->zperiodic;
  std::vector<Body> with_images;
  std::vector<int> origin;
  if (periodic) {
    with_images = bodies_;
    origin.resize(bodies_.size());
    std::iota(origin.begin(), origin.end(), 0);
    add_periodic_images(reach, with_images, origin);
  }
  const bool images = with_images.size() > bodies_.size();
  const std::vector<Body> &all = images ? with_images : bodies_;
  const int own = int(bodies_.size());

  pairs_.find(all, reach, contacts);
  if (images) {
    // A contact across a boundary is found from both sides; that whose first body is no image stays.
    contacts.erase(std::remove_if(contacts.begin(), contacts.end(), [own](const Contact &c) { return c.a >= own; }), contacts.end());
    for (Contact &c : contacts) c.b = origin[std::size_t(c.b)];
  }
  const int types = int(options_.stiffness.size());
  double Vec::*const axes[3] = {&Vec::x, &Vec::y, &Vec::z};
  for (std::size_t w = 0; w < options_.walls.size(); ++w) {
    const ImpactWall &wall = options_.walls[w];
    dembark::impact::Wall common;
    common.id = dembark::impact::wall_key(std::int64_t(w));
    common.material = types + int(w);
    common.stiffness = wall.stiffness;
    if (wall.shape == ImpactWall::plane) {
      dembark::impact::Plane plane;
      static_cast<dembark::impact::Wall &>(plane) = common;
      plane.normal = Vec();
      plane.normal.*axes[wall.axis] = wall.free_above ? 1.0 : -1.0;
      plane.point.*axes[wall.axis] = wall.position;
      dembark::impact::plane_contacts(bodies_, plane, reach, contacts);
    } else if (wall.shape == ImpactWall::cylinder) {
      dembark::impact::Drum drum;
      static_cast<dembark::impact::Wall &>(drum) = common;
      drum.axis = Vec();
      drum.axis.*axes[wall.axis] = 1.0;
      drum.point.*axes[wall.axis == 0 ? 1 : 0] = wall.centre[0];
      drum.point.*axes[wall.axis == 2 ? 1 : 2] = wall.centre[1];
      drum.radius = wall.radius;
      drum.omega = wall.omega;
      dembark::impact::cylinder_contacts(bodies_, drum, reach, contacts);
    } else {
      // Without images: at the end of a mesh that goes through to a periodic boundary they would touch an edge that is none.
      const std::size_t from = contacts.size();
      mesh_[w].contacts(bodies_, common, reach, contacts);
      if (!mesh_[w].velocity_known())  // better no relative motion than a wrong one, which the springs would remember
        for (std::size_t k = from; k < contacts.size(); ++k) {
          const Body &b = bodies_[std::size_t(contacts[k].a)];
          contacts[k].point_velocity = b.velocity - b.radius * cross(b.spin, contacts[k].normal);
        }
    }
  }
}
