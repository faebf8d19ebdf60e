// Energy of a run: the works of all parts of all contacts, of gravity, walls and numerical damping, beside the kinetic energy. Its sums,
// and the reason why they balance to round-off, are those of dembark/energy_ledger.hpp.
#pragma once

#include <mutex>
#include <vector>

#include <boost/weak_ptr.hpp>

#include <core/Body.hpp>
#include <core/GlobalEngine.hpp>

#include "dembark/energy_ledger.hpp"

namespace yade {

class NewtonIntegrator;

class EnergyAccount : public GlobalEngine {
public:
	virtual ~EnergyAccount() = default;
	void                action() override;
	void                preSave(EnergyAccount&);
	void                postLoad(EnergyAccount&);
	void                reset();
	Real                get(const std::string& name);
	boost::python::list keys() { return energies().keys(); }
	boost::python::list items() { return energies().items(); }
	boost::python::dict energies();
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(EnergyAccount,GlobalEngine,"Energies [J] of a scene whose contacts are those of :yref:`Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz`: kinetic energy, what springs hold, and the works of all parts of the contacts' forces, of gravity, walls, numerical damping and other forces, which balance the kinetic energy to round-off in each step. Stands after :yref:`InteractionLoop` and all engines that add forces, and before :yref:`NewtonIntegrator`. Read like :yref:`O.energy<Omega.energy>`: account['gravity'], account.keys(), account.items().",
		((vector<Real>,saved,,Attr::hidden,"The numbers of the ledger, when the scene is saved"))
		((vector<Real>,known,,Attr::hidden,"Kinetic energy [J] of each body by id, -1 = no body"))
		((long,step,-1,Attr::readonly,"Last step whose works are in the sums; -1 = none"))
		, /*ctor*/
		, /*py*/
		.def("__getitem__",&EnergyAccount::get,(boost::python::arg("name")),"One of the energies [J] by its name.")
		.def("keys",&EnergyAccount::keys,"Names of the energies.")
		.def("items",&EnergyAccount::items,"Tuples (name, energy [J]).")
		.def("energies",&EnergyAccount::energies,"All energies [J] by name.")
		.def("reset",&EnergyAccount::reset,"Begin anew with the next step: all works are zero there.")
	);
	// clang-format on

private:
	/// What a contact is made of while its forces are known, until the mean velocities of the step are.
	struct Contact {
		bool                     acting = false;
		Body::id_t               one = 0, two = 0;  // the bodies 1 and 2 of the parts
		::dembark::ContactParts  parts;
		::dembark::ContactLevers levers;
		Real                     half = 0.0, work = 0.0;  // J, of the normal spring: in the half step up to here, and in the step
	};

	const NewtonIntegrator& integrator() const;
	void                    update();
	void                    tally(const Scene&);
	void                    record(const NewtonIntegrator&, bool first);
	bool                    recordBodies(const NewtonIntegrator&, bool first);
	void                    recordForces(const Body&, const NewtonIntegrator&);
	void                    recordContact(Contact&, const Interaction&) const;
	bool                    changes(const Contact& c) const { return c.acting && (changed[c.one] || changed[c.two]); }
	void                    begin();

	::dembark::EnergyLedger            ledger;
	std::vector<const Body*>           present;  // by id, to tell whether it is still the same; to own it could mean to end a Python
	                                             // object without the interpreter
	std::vector<::dembark::EnergyBody> bodies;   // by id, before the step that is to be tallied, and then in the mean of it
	std::vector<bool>                  changed;  // by id: came, left, or is another one than a step ago
	std::vector<Contact>               contacts;
	bool                               pending  = false;  // the step `recorded` is not in the sums yet
	long                               recorded = -1;
	Real                               length   = 0.0;  // s, of that step
	boost::weak_ptr<Scene>             home;
	std::mutex                         guard;
};
REGISTER_SERIALIZABLE(EnergyAccount);

}  // namespace yade
