#include "packed_contacts.h"

#include <cstring>

#include "atom.h"
#include "force.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "update.h"

#include "contact_call.h"
#include "fix_capillary_liquid.h"
#include "pair_grains.h"

namespace dembark_lammps {

using dembark::ContactParameters;

bool PackedContacts::prepare(int freeze_bit, LAMMPS_NS::FixCapillaryLiquid* liquid, dembark::ContactTally* tally) {
  freeze_bit_ = freeze_bit;
  liquid_ = liquid;
  layout_ = coefficients_.layout();
  const ContactParameters& any = coefficients_(1, 1);
  tally_ = {};
  tally_.sums = tally;
  tally_.atom = atom;
  tally_.frozen = freeze_bit;
  tally_.rings_at = layout_.rings ? layout_.rings_at() : -1;
  tally_.angle_at = layout_.rolling ? layout_.rolling_at() : -1;
  return any.normal_law == dembark::NormalLaw::hertz && !any.liquid.viscous.on() && dembark::PairLoops::asked_lanes() != 1;
}

void PackedContacts::collect_laws() {
  const int types = atom->ntypes;
  laws_.assign(std::size_t(types + 1) * std::size_t(types + 1), {});
  for (int i = 1; i <= types; ++i)
    for (int j = 1; j <= types; ++j) {
      const ContactParameters& p = coefficients_(i, j);
      laws_[std::size_t(i * (types + 1) + j)] = {p.elasticity.effective_youngs_modulus,
                                                 p.elasticity.effective_shear_modulus,
                                                 p.elasticity.damping,
                                                 p.friction.static_friction,
                                                 p.friction.kinetic_friction,
                                                 p.friction.interface_shear_strength,
                                                 dembark::kept_slip(p.friction, update->dt),
                                                 p.friction.critical_slip_distance};
    }
}

void PackedContacts::step(const LAMMPS_NS::NeighList& list, const NeighborHistory& history, const double* masses) {
  if (list.inum == 0) return;
  collect_laws();
  const ContactParameters& any = coefficients_(1, 1);
  // The rolling spring stands behind the rings.
  const int more = layout_.rings || layout_.rolling ? layout_.rings_at() : -1;
  dembark::PairStep step{*this};
  dembark_family::describe_pairs(step, *atom, list);
  step.mass = masses_ = masses;
  step.memory = this;
  step.results = tally_.sums ? &tally_ : nullptr;
  step.laws = laws_.data();
  step.types = atom->ntypes + 1;
  step.one_law = atom->ntypes == 1;
  step.owned = force->newton_pair ? atom->nlocal + atom->nghost : atom->nlocal;
  step.rings = tally_.rings_at;
  step.more = more;
  step.more_numbers = layout_.imbalance_at() - layout_.rings_at();
  step.dt = update->dt;
  step.wet = layout_.bridge;
  step.limit_force = any.limit_force;
  step.tangential_damping = any.tangential_damping;
  step.elastic_limit = any.friction.friction_limit == dembark::FrictionLimit::elastic;
  // The scalar law knows that curve, and steps of zero length.
  step.pack_friction = any.friction.presliding != dembark::Presliding::exponential && update->dt > 0.0;
  step.rolls = any.rolling.model != dembark::RollingModel::off;
  step.frozen = freeze_bit_;
  step.stride = layout_.size();
  step.flags = history.firstflag;
  step.histories = history.firstvalue;
  step.contact_flags = step.bridge_flag = 1;
  packs_.lists(step, *block_);
}

const ContactParameters& PackedContacts::law(const PairBlock& block, int k) const {
  return coefficients_(atom->type[block.grain[k]], atom->type[block.partner[k]]);
}

Vec3 PackedContacts::friction(const PairBlock& block, int k, const Vec3& normal, double twist,
                              const dembark::NormalResponse<double>& response, const Vec3& velocity) {
  // What is no number neither sticks nor slips in a pack: pairs without a normal end up here.
  check_normal(error, atom->tag, normal, block.grain[k], block.partner[k]);
  double* const history = block.history[k];
  dembark::FrictionState<double> state = dembark::load_friction(history);
  dembark::SlipRings rings;
  if (layout_.rings) rings = dembark::load_rings(history + layout_.rings_at());
  const Vec3 out = contact_friction(law(block, k).friction, normal, twist, response, velocity, update->dt, state, &rings);
  dembark::store_friction(history, state);
  if (layout_.rings) dembark::store_rings(history + layout_.rings_at(), rings);
  return out;
}

Vec3 PackedContacts::rolling(const PairBlock& block, int k, const Vec3& normal, double twist, double normal_force,
                             double tangential_stiffness, const Vec3& spin) {
  const int i = block.grain[k], j = block.partner[k];
  const auto mass = [&](int grain) { return atom->mask[grain] & freeze_bit_ ? INFINITY : masses_[grain]; };
  double* const history = block.history[k] + layout_.rolling_at();
  Vec3 angle = layout_.rolling ? vector(history) : Vec3{};
  const dembark::RollingContact contact{normal,
                                        twist,
                                        dembark::reduced(atom->radius[i], atom->radius[j]),
                                        dembark::relative_inertia(mass(i), atom->radius[i], mass(j), atom->radius[j]),
                                        normal_force,
                                        tangential_stiffness,
                                        spin};
  const Vec3 couple = rolling_step(law(block, k).rolling, contact, update->dt, angle);
  if (layout_.rolling) std::memcpy(history, &angle, sizeof angle);
  tally_.note_rolling(k, law(block, k).rolling.on(), couple);
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

void PackedContacts::bridges(const PairBlock& block, int first, int count, const double* gap, double* pull) {
  for (int n = 0; n < count; ++n) {
    const int k = first + n, i = block.grain[k], j = block.partner[k];
    const bool touching = block.pick[k] & 1;
    double* const bridge = block.history[k] + layout_.bridge_at();
    const double before = bridge[0];
    pull[n] = bridge_step(law(block, k).liquid, atom->radius[i], atom->radius[j], gap[n], touching, bridge[0], bridge[1]);
    tally_.note_pull(k, pull[n]);
    if (bridge[0] > 0.0) *block.flags[k] = 1;
    if (bridge[0] > 0.0 && !(before > 0.0)) check_reach(error, bridge[1], neighbor->skin);
    if (liquid_)
      liquid_->report({i, j, false}, atom->radius[i], atom->radius[j], law(block, k).liquid, touching, before, bridge,
                      block.history[k] + layout_.imbalance_at());
  }
}

}  // namespace dembark_lammps
