// The contacts of one step for EnergyAccount: what they are made of when their forces are known, their powers when the mean velocities
// of the step are.
#pragma once

#include <vector>

#include "ContactView.hpp"
#include "dembark/energy_ledger.hpp"

namespace yade {

class Interaction;
class Scene;

namespace dembark_yade {

class ContactWorks {
public:
	/// J, summed over contacts.
	struct Stored {
		double normal = 0.0, tangential = 0.0;
		double half = 0.0;  // work of the normal springs in the half step up to these positions
		void   add(const Stored&);
	};
	typedef std::vector<::dembark::EnergyBody> Bodies;  // by id

	/// Takes up all interactions of the scene after their law has run.
	Stored record(Scene&, int threads);
	/// Powers of the contacts that were recorded, with the bodies' mean velocities of the step `dt`.
	::dembark::Powers powers(const Bodies& mean, double dt, int threads);
	/// What the normal springs of these bodies' contacts hold and no work explains: all of it when they begin to be tallied, its
	/// negative when they are tallied no more.
	double unexplained(const std::vector<bool>& bodies, bool arriving) const;
	void   clear() { contacts.clear(); }

private:
	struct Contact {
		bool                      acting = false;
		Body::id_t                id1 = 0, id2 = 0;
		ContactView               view;
		::dembark::ContactForce   whole;  // of dembark/contact.hpp what ContactParts needs
		::dembark::ContactParts   parts;
		double                    half = 0.0, work = 0.0;  // J, of the normal spring, as in Stored, and in the whole step
		::dembark::RelativeMotion motion() const { return ::dembark::relative_motion(view.bodies, whole.normal, whole.overlap); }
	};
	void recordOne(Contact&, const Interaction&, Scene&, Stored&) const;
	void addPowers(Contact&, const Bodies& mean, double dt, ::dembark::Powers&) const;
	template <class Sums, class Visit>
	Sums overAll(int threads, Visit visit);

	std::vector<Contact> contacts;
};

}  // namespace dembark_yade
}  // namespace yade
