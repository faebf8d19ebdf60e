// The contacts of one step for EnergyAccount: what they are made of when their forces are known, their works when the velocities have
// moved on.
#pragma once

#include <array>
#include <vector>

#include "ContactView.hpp"
#include "dembark/contact_energy.hpp"

namespace yade {

class Interaction;
class Scene;

namespace dembark_yade {

/// How a body moves: before a step, or in the mean of it.
struct BodyMotion {
	Vector3r velocity = Vector3r::Zero(), spin = Vector3r::Zero();
	unsigned blocked = 0;  // degrees of freedom that forces do not change, bits of State
};

inline bool isFree(unsigned blocked, int axis, bool rotation) { return !(blocked & State::axisDOF(axis, rotation)); }

/// Sum of a * b over the axes that are free or, with `free` false, those that are blocked.
inline Real along(const Vector3r& a, const Vector3r& b, unsigned blocked, bool rotation, bool free = true) {
	if (blocked == State::DOF_NONE || blocked == State::DOF_ALL) return (blocked == State::DOF_NONE) == free ? a.dot(b) : 0.0;
	Real sum = 0.0;
	for (int i = 0; i < 3; ++i)
		if (isFree(blocked, i, rotation) == free) sum += a[i] * b[i];
	return sum;
}

class ContactWorks {
public:
	/// J, summed over contacts.
	struct Sums {
		std::array<double, ::dembark::contact_part_count> parts{};
		double onFree = 0.0, onBlocked = 0.0;  // works on degrees of freedom that forces change, and on those that they do not
		double normalStored = 0.0, tangentialStored = 0.0;
		double half = 0.0;  // work of the normal springs in the half step up to these positions
		void   add(const Sums&);
	};

	/// Takes up all interactions of the scene after their law has run; fills what is stored, and `half`.
	Sums record(Scene&, int threads);
	/// Works of the step that was recorded, `mean` being the mean motions of the bodies by id in it; fills the rest.
	Sums book(const std::vector<BodyMotion>& mean, double dt, int threads);
	/// What the normal springs of these bodies' contacts hold and no work explains: when they begin to be booked all of it, when they
	/// are booked no more its negative.
	double unexplained(const std::vector<bool>& bodies, bool arriving) const;
	void   clear() { contacts.clear(); }

private:
	struct Contact {
		bool                    acting = false;
		Body::id_t              id1 = 0, id2 = 0;
		ContactView             view;
		::dembark::ContactForce whole;  // of dembark/contact.hpp what ContactParts needs
		::dembark::ContactParts parts;
		double                  half = 0.0, work = 0.0;  // J, of the normal spring, as in Sums, and in the whole step
	};
	void recordOne(Contact&, const Interaction&, Scene&, Sums&) const;
	void bookOne(Contact&, const std::vector<BodyMotion>& mean, double dt, Sums&) const;
	template <class Visit>
	Sums overAll(int threads, Visit visit);

	std::vector<Contact> contacts;
};

}  // namespace dembark_yade
}  // namespace yade
