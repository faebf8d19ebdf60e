// What fix lcp/impact keeps in restart files, bit for bit: the model's state, the forces of the last step and what they were computed
// for, and how far the file of impacts had got.
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "comm.h"
#include "domain.h"
#include "update.h"

#include "fix_lcp_impact.h"

using namespace LAMMPS_NS;
using dembark::impact::ContactResult;

namespace {

constexpr double format = 1.0;

class Writer {
 public:
  std::vector<double> numbers;
  Writer &operator<<(double v) {
    numbers.push_back(v);
    return *this;
  }
  Writer &operator<<(const dembark::Vec3<double> &v) { return *this << v.x << v.y << v.z; }
  Writer &operator<<(const std::string &s) {
    *this << double(s.size());
    for (const char c : s) *this << double(static_cast<unsigned char>(c));
    return *this;
  }
  Writer &operator<<(const std::vector<double> &v) {
    *this << double(v.size());
    numbers.insert(numbers.end(), v.begin(), v.end());
    return *this;
  }
  Writer &operator<<(const std::vector<dembark::Vec3<double>> &v) {
    *this << double(v.size());
    for (const dembark::Vec3<double> &x : v) *this << x;
    return *this;
  }
};

class Reader {
 public:
  /// From the first number on, which is the count of all.
  explicit Reader(const double *from) : at_(from + 1), end_(from + static_cast<std::size_t>(from[0])) {}
  double number() {
    if (at_ == end_) throw std::invalid_argument("the restart file ends within the state of the fix");
    return *at_++;
  }
  Reader &operator>>(double &v) {
    v = number();
    return *this;
  }
  Reader &operator>>(dembark::Vec3<double> &v) { return *this >> v.x >> v.y >> v.z; }
  Reader &operator>>(std::string &s) {
    s.resize(size());
    for (char &c : s) c = static_cast<char>(static_cast<unsigned char>(number()));
    return *this;
  }
  Reader &operator>>(std::vector<double> &v) {
    v.resize(size());
    for (double &x : v) x = number();
    return *this;
  }
  Reader &operator>>(std::vector<dembark::Vec3<double>> &v) {
    v.resize(size());
    for (dembark::Vec3<double> &x : v) *this >> x;
    return *this;
  }
  template <class Integer>
  void integer(Integer &v) {
    v = static_cast<Integer>(number());
  }
  std::size_t size() {
    const double n = number();
    if (!(n >= 0.0 && n <= double(end_ - at_)))
      throw std::invalid_argument("the restart file holds something else than the state of this fix");
    return static_cast<std::size_t>(n);
  }

 private:
  const double *at_, *end_;
};

constexpr std::size_t per_body = 10;  // tag, position, velocity, spin

}  // namespace

/// Remembers the bodies as they are at the end of a step. Collective.
void FixLcpImpact::take_snapshot() {
  last_bodies_.clear();
  if (last_step_ != update->ntimestep) return;
  gather_bodies();
  Writer w;
  for (const dembark::impact::Body &b : bodies_) w << double(b.id) << b.position << b.velocity << b.spin;
  last_bodies_.swap(w.numbers);
}

/// Whether the bodies are still those of the snapshot: nothing was moved, added or removed since, but for whole periods of the box.
bool FixLcpImpact::same_bodies() const {
  if (last_bodies_.size() != per_body * bodies_.size() || last_force_.size() != bodies_.size()) return false;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const dembark::impact::Body &b = bodies_[i];
    const double *v = &last_bodies_[per_body * i];
    if (double(b.id) != v[0]) return false;
    const double now[9] = {b.position.x, b.position.y, b.position.z, b.velocity.x, b.velocity.y,
                           b.velocity.z, b.spin.x,     b.spin.y,     b.spin.z};
    for (int k = 0; k < 9; ++k) {
      if (now[k] == v[1 + k]) continue;
      if (k >= 3 || !domain->periodicity[k]) return false;
      if (std::fabs(std::fabs(now[k] - v[1 + k]) - domain->prd[k]) > 1e-12 * domain->prd[k]) return false;
    }
  }
  return true;
}

std::vector<double> FixLcpImpact::pack() const {
  Writer w;
  w << 0.0 << format << double(options_.stiffness.size()) << double(options_.walls.size());
  for (const dembark_liggghts::ImpactWall &wall : options_.walls) w << wall.name;
  w << double(last_step_) << last_dt_ << clock_time_ << double(clock_step_);
  w << last_bodies_ << last_force_ << last_torque_;
  w << record_name_ << double(record_.is_open() ? record_.bytes() : record_kept_);
  const dembark::impact::StepReport &r = report_;
  w << r.contacts << r.active << r.pivots << r.block_steps << double(r.impacts_begun) << double(r.pivots_total) << r.impulse_sum
    << r.peak_force << r.peak_force_so_far << r.dissipated_energy << r.elastic_energy << r.certificate << r.worst_certificate;
  const std::vector<ContactResult> &contacts = results();
  w << double(contacts.size());
  for (const ContactResult &c : contacts)
    w << double(c.a) << double(c.key_a) << double(c.key_b) << c.gap << c.normal_force << c.opening << c.tangential << c.normal << c.place;
  w << (system_ ? system_->state() : restored_);
  w.numbers[0] = double(w.numbers.size());
  return w.numbers;
}

void FixLcpImpact::write_restart(FILE *file) {
  take_snapshot();
  if (me_ != 0) return;
  const std::vector<double> numbers = pack();
  const int bytes = static_cast<int>(numbers.size() * sizeof(double));
  fwrite(&bytes, sizeof(int), 1, file);
  fwrite(numbers.data(), sizeof(double), numbers.size(), file);
}

void FixLcpImpact::restart(char *buffer) {
  Reader in(reinterpret_cast<const double *>(buffer));  // the engine hands over the numbers without their count
  try {
    if (in.number() != format) throw std::invalid_argument("the restart file holds the state of another version of this fix");
    const std::size_t types = in.size(), walls = in.size();
    if (types != options_.stiffness.size())
      throw std::invalid_argument("the restart file has " + std::to_string(types) + " atom types, the command " +
                                  std::to_string(options_.stiffness.size()));
    for (std::size_t k = 0; k < walls; ++k) {
      std::string name;
      in >> name;
      if (k < options_.walls.size() && options_.walls[k].name != name)
        throw std::invalid_argument("wall " + std::to_string(k + 1) + " is " + name + " in the restart file and " + options_.walls[k].name +
                                    " in the command; keep the order, add walls at the end, take them away from the end");
    }
    in.integer(last_step_);
    in >> last_dt_ >> clock_time_;
    in.integer(clock_step_);
    in >> last_bodies_ >> last_force_ >> last_torque_;
    std::string name;
    in >> name;
    in.integer(record_kept_);
    if (name != options_.impacts_file) record_kept_ = -1;  // another file begins anew
    dembark::impact::StepReport &r = report_;
    in.integer(r.contacts);
    in.integer(r.active);
    in.integer(r.pivots);
    in.integer(r.block_steps);
    in.integer(r.impacts_begun);
    in.integer(r.pivots_total);
    in >> r.impulse_sum >> r.peak_force >> r.peak_force_so_far >> r.dissipated_energy >> r.elastic_energy;
    in >> r.certificate >> r.worst_certificate;
    results_.resize(in.size());
    for (ContactResult &c : results_) {
      in.integer(c.a);
      in.integer(c.key_a);
      in.integer(c.key_b);
      in >> c.gap >> c.normal_force >> c.opening >> c.tangential >> c.normal >> c.place;
    }
    in >> restored_;
  } catch (const std::invalid_argument &e) {
    refuse(e.what());
  }
}
