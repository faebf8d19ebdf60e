// A few bodies, walls and constant forces on their own, without an engine: the leapfrog that engines run, around impact::System.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "attitude.hpp"
#include "geometry.hpp"
#include "start.hpp"
#include "system.hpp"

namespace dembark {
namespace impact {

/// Velocities given are those at time 0; the first step has half a kick, as the set-up of velocity Verlet. The `force` and `torque` of the
/// bodies stay as they are (weight).
class Scene {
 public:
  ContactGeometry around;
  double reach = 0.0;  ///< m, of the search for candidates; 0 = as large as the motion asks for
  bool row = false;    ///< bodies along x that never change places: contacts between neighbours by number, and with the planes only

  Scene(Settings settings, std::vector<Body> bodies) : system_(std::move(settings)), bodies_(std::move(bodies)) {
    velocity_.resize(bodies_.size());
    spin_.resize(bodies_.size());
  }
  /// Bodies with a length and an orientation.
  Scene(Settings settings, std::vector<Capsule> capsules) : Scene(std::move(settings), std::vector<Body>()) {
    for (Capsule& c : capsules) {
      c.begin();
      bodies_.push_back(c);
      attitudes_.push_back({c.length, normalised(c.orientation), {}});
      attitudes_.back().begin(c);
    }
    velocity_.resize(bodies_.size());
    spin_.resize(bodies_.size());
  }

  System& system() { return system_; }
  const System& system() const { return system_; }
  /// Positions at the moment, velocities half a step before it (at it before the first step).
  const std::vector<Body>& bodies() const { return bodies_; }
  /// s
  double time() const { return double(count_) * system_.settings().dt; }
  /// Of the moment; need forces().
  const std::vector<Vec3<double>>& velocity() const { return velocity_; }
  const std::vector<Vec3<double>>& spin() const { return spin_; }
  /// Of the moment; empty where the bodies have none.
  const std::vector<Attitude>& attitudes() const { return attitudes_; }

  /// One line where bodies overlap now by more than a start may, else nothing.
  std::string start_error() {
    std::vector<Contact> contacts;
    if (row) row_contacts(contacts);
    else find(0.0, contacts);
    return impact::start_error(bodies_, contacts, "body", [](std::int64_t wall) { return "wall " + std::to_string(wall + 1); });
  }

  /// Contact forces of the moment. Asking twice changes nothing.
  const StepReport& forces() {
    const double kick = count_ == 0 ? 0.5 : 1.0, dt = system_.settings().dt;
    const auto search = [this](double far, std::vector<Contact>& contacts) {
      if (row) row_contacts(contacts);
      else find(far, contacts);
    };
    const StepReport& report = system_.step(bodies_, search, around.wall_speed(), time(), kick, row ? INFINITY : reach);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Body& b = bodies_[i];
      velocity_[i] = b.velocity;
      spin_[i] = b.spin;
      if (count_ == 0) continue;
      velocity_[i] += (0.5 * dt / b.mass) * (b.force + system_.wrenches()[i].force);
      spin_[i] += kicked(b, b.torque + system_.wrenches()[i].torque, 0.5 * dt);
    }
    return report;
  }

  /// One step on with the forces of the moment, which must have been asked for.
  void advance() {
    const double dt = system_.settings().dt, kick = (count_ == 0 ? 0.5 : 1.0) * dt;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      Body& b = bodies_[i];
      b.velocity += (kick / b.mass) * (b.force + system_.wrenches()[i].force);
      b.position += dt * b.velocity;
      const Vec3<double> torque = b.torque + system_.wrenches()[i].torque;
      if (attitudes_.empty()) {
        b.spin += kicked(b, torque, kick);
        continue;
      }
      if (!std::isinf(b.inertia)) attitudes_[i].momentum += kick * torque;
      attitudes_[i].turn(b, dt);
    }
    for (Plane& p : around.planes) p.point += dt * p.velocity;
    for (Drum& d : around.drums) d.point += dt * d.velocity;
    ++count_;
  }

  void run(std::int64_t steps) {
    for (std::int64_t i = 0; i < steps; ++i) {
      forces();
      advance();
    }
    forces();
  }

  /// J, of the velocities half a step before the moment (with the elastic and the dissipated energy it balances the work of the forces).
  double kinetic_energy_of_half_step() const {
    double sum = 0.0;
    for (const Body& b : bodies_) {
      if (!std::isinf(b.mass)) sum += 0.5 * b.mass * dot(b.velocity, b.velocity);
      if (std::isinf(b.inertia)) continue;
      sum += attitudes_.empty() ? 0.5 * b.inertia * dot(b.spin, b.spin) : inertia_of(b).energy(b.spin, axis_of(b));
    }
    return sum;
  }

  /// Everything needed to go on bit for bit.
  std::vector<double> state() const {
    Archive out;
    const_cast<Scene*>(this)->archive(out);  // writing changes nothing
    return out.numbers();
  }
  void restore(const std::vector<double>& state) {
    Archive in(state);
    archive(in);
    in.end();
  }

 private:
  /// Bodies may leave a periodic box, and their contacts are those of their images in it.
  void find(double far, std::vector<Contact>& contacts) {
    const PeriodicBox& box = around.pairs.box;
    if (!box.periodic[0] && !box.periodic[1] && !box.periodic[2]) return around.find(bodies_, far, contacts);
    inside_ = bodies_;
    double Vec3<double>::* const axes[3] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z};
    for (int k = 0; k < 3; ++k)
      for (std::size_t i = 0; box.periodic[k] && i < inside_.size(); ++i) {
        double& at = inside_[i].position.*axes[k];
        at -= box.length.*axes[k] * std::floor((at - box.low.*axes[k]) / (box.length.*axes[k]));
      }
    around.find(inside_, far, contacts);
  }

  void archive(Archive& a) {
    std::vector<double> system = system_.state();
    a(system), a(count_);
    if (a.reading()) system_.restore(system);
    for (Body& b : bodies_) a(b.position), a(b.velocity), a(b.spin);
    for (std::size_t i = 0; i < attitudes_.size(); ++i) {
      a(attitudes_[i].orientation), a(attitudes_[i].momentum);
      attitudes_[i].lay(bodies_[i]);
    }
    for (Plane& p : around.planes) a(p.point);
    for (Drum& d : around.drums) a(d.point);
  }

  void row_contacts(std::vector<Contact>& contacts) {
    for (std::size_t i = 0; i + 1 < bodies_.size(); ++i) {
      const Body &a = bodies_[i], &b = bodies_[i + 1];
      contacts.push_back({int(i), int(i + 1), a.id, b.id, b.position.x - a.position.x - a.radius - b.radius, Vec3<double>{-1.0, 0.0, 0.0}});
    }
    for (const Plane& p : around.planes) {
      if (bodies_.empty()) break;
      const std::size_t end = p.normal.x > 0.0 ? 0 : bodies_.size() - 1;
      const double gap = (bodies_[end].position.x - p.point.x) * p.normal.x - bodies_[end].radius;
      detail::wall_contact(p, int(end), bodies_[end], p.id, gap, p.normal, p.velocity, contacts);
    }
  }

  System system_;
  std::vector<Body> bodies_;
  std::vector<Vec3<double>> velocity_, spin_;
  std::vector<Body> inside_;         ///< see find()
  std::vector<Attitude> attitudes_;  ///< of capsules
  std::int64_t count_ = 0;
};

}  // namespace impact
}  // namespace dembark
