#include "packed_contacts.h"

#include <cstring>

using dembark::ContactParameters;

namespace dembark_family {

void PackedContacts::begin(const LAMMPS_NS::Atom& atom, const HistoryPlaces& places, int frozen, LiquidFix* liquid,
                           dembark::ContactTally* sums) {
  atom_ = &atom;
  liquid_ = liquid;
  tally_ = {};
  tally_.sums = sums;
  tally_.atom = &atom;
  tally_.frozen = frozen;
  tally_.at = places;
}

dembark::PairStep PackedContacts::describe(const LAMMPS_NS::NeighList& list, int types, const double* masses, int owned, double dt,
                                           bool keeps, bool keeps_bridges) {
  const HistoryPlaces& at = tally_.at;
  masses_ = masses;
  dt_ = dt;
  keeps_ = keeps;
  keeps_bridges_ = keeps_bridges;
  packed_laws_.assign(std::size_t(types + 1) * std::size_t(types + 1), {});
  for (int i = 1; i <= types; ++i)
    for (int j = 1; j <= types; ++j) packed_laws_[std::size_t(i * (types + 1) + j)] = packed_coefficients(law(i, j), dt);
  const ContactParameters& any = law(1, 1);
  dembark::PairStep step{*this};
  step.memory = this;
  step.results = tally_.sums && keeps ? &tally_ : nullptr;
  step.laws = packed_laws_.data();
  step.types = types + 1;
  step.one_law = types == 1;
  step.owned = owned;
  step.offset = at.friction;
  step.rings = at.rings;
  // The rolling spring stands behind the rings.
  step.more = at.rings >= 0 ? at.rings : at.rolling;
  step.more_numbers = (at.rings >= 0 ? dembark::ring_numbers : 0) + (at.rolling >= 0 ? 3 : 0);
  step.dt = dt;
  step.wet = any.cohesion.on();
  step.limit_force = any.limit_force;
  step.tangential_damping = any.tangential_damping;
  step.elastic_limit = any.friction.friction_limit == dembark::FrictionLimit::elastic;
  // Steps of zero length are for the scalar law, too.
  step.pack_friction = packs_know(any.friction) && dt > 0.0;
  step.rolls = any.rolling.model != dembark::RollingModel::off;
  step.x = atom_->x[0];
  step.v = atom_->v[0];
  step.omega = atom_->omega[0];
  step.radius = atom_->radius;
  step.mass = masses;
  step.type = atom_->type;
  step.mask = atom_->mask;
  step.f = atom_->f[0];
  step.torque = atom_->torque[0];
  step.frozen = tally_.frozen;
  step.count = list.inum;
  step.grains = list.ilist;
  step.numneigh = list.numneigh;
  step.neighbors = list.firstneigh;
  step.number_bits = NEIGHMASK;
  return step;
}

PackedContacts::Vec3 PackedContacts::friction(const PairBlock& block, int k, const Vec3& normal, double twist,
                                              const dembark::NormalResponse<double>& response, const Vec3& velocity) {
  // What is no number neither sticks nor slips in a pack: pairs without a normal end up here.
  if (dembark::has_no_direction(normal)) refuse_coincidence(block.grain[k], block.partner[k]);
  const HistoryPlaces& at = tally_.at;
  double* const row = block.history[k];
  dembark::FrictionState<double> state = dembark::load_friction(row + at.friction);
  dembark::SlipRings rings;
  if (at.rings >= 0) rings = dembark::load_rings(row + at.rings);
  const Vec3 force = contact_friction(law(block, k).friction, normal, twist, response, velocity, dt_, state, &rings);
  if (keeps_) dembark::store_friction(row + at.friction, state);
  if (keeps_ && at.rings >= 0) dembark::store_rings(row + at.rings, rings);
  return force;
}

PackedContacts::Vec3 PackedContacts::rolling(const PairBlock& block, int k, const Vec3& normal, double twist, double normal_force,
                                             double tangential_stiffness, const Vec3& spin) {
  const int i = block.grain[k], j = block.partner[k];
  const auto mass = [&](int grain) { return atom_->mask[grain] & tally_.frozen ? INFINITY : masses_[grain]; };
  double* const history = tally_.at.rolling >= 0 ? block.history[k] + tally_.at.rolling : nullptr;
  Vec3 angle = history ? vector(history) : Vec3{};
  const dembark::RollingContact contact{normal,
                                        twist,
                                        dembark::reduced(atom_->radius[i], atom_->radius[j]),
                                        dembark::relative_inertia(mass(i), atom_->radius[i], mass(j), atom_->radius[j]),
                                        normal_force,
                                        tangential_stiffness,
                                        spin};
  const dembark::RollingResistance& resistance = law(block, k).rolling;
  const Vec3 couple = rolling_step(resistance, contact, dt_, angle);
  if (keeps_ && history) std::memcpy(history, &angle, sizeof angle);
  tally_.note_rolling(k, resistance.on(), couple);
  return couple;
}

double PackedContacts::limit(const PairBlock& block, int k, double normal_force, double contact_area, double slip) {
  const dembark::FinnieRabinowicz& friction = law(block, k).friction;
  return shear_limit(friction, friction_coefficient(friction, slip), normal_force, contact_area);
}

double PackedContacts::sliding_limit(const PairBlock& block, int k, const dembark::RingMotion<double>& motion, const double* rings,
                                     double normal_force, double contact_area, double& slip) {
  return dembark::sliding_limit(law(block, k).friction, motion, rings, rings + dembark::SlipRings::count, normal_force, contact_area, slip);
}

void PackedContacts::bridges(const PairBlock& block, int first, int count, const double* gap, double* cohesive_force) {
  for (int n = 0; n < count; ++n) {
    const int k = first + n, i = block.grain[k], j = block.partner[k];
    const bool touching = block.pick[k] & 1;
    // Laws that hold no contact have no place in a history.
    double* const row = tally_.at.cohesion >= 0 ? block.history[k] + tally_.at.cohesion : nullptr;
    const dembark::CohesionState before = row ? dembark::load_cohesion(row) : dembark::CohesionState{};
    dembark::CohesionState now = before;
    const ContactParameters& p = law(block, k);
    cohesive_force[n] =
        cohesion_step(p.cohesion, {atom_->radius[i], atom_->radius[j], gap[n], touching, p.elasticity.effective_youngs_modulus}, now);
    tally_.note_cohesive_force(k, cohesive_force[n]);
    // One that cannot break in this pass, the set-up of a run, is looked at again in the next.
    if (!touching && (now.held() || (before.held() && !keeps_bridges_))) *block.flags[k] |= bridge_flag_;
    if (now.held() && !before.held()) check_reach(i, j, now.rupture_distance);
    if (!keeps_bridges_ || !row) continue;
    dembark::store_cohesion(row, now);
    if (liquid_)
      liquid_->report({i, j, false}, atom_->radius[i], atom_->radius[j], p.cohesion.liquid, touching, before.bridge_volume, row,
                      block.history[k] + tally_.at.imbalance);
  }
}

}  // namespace dembark_family
