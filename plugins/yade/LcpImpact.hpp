// Impacts of logs as one linear complementarity problem a step, for YADE: an engine that stands after all other forces and before
// NewtonIntegrator. The physics is that of dembark/impact; here YADE's bodies, walls and conventions are mapped to it.
#pragma once

#include <memory>

#include <core/GlobalEngine.hpp>
#include <pkg/dem/NewtonIntegrator.hpp>

#include "SavedFormat.hpp"
#include "attributes.hpp"
#include "dembark/impact/attitude.hpp"
#include "dembark/impact/impact_file.hpp"
#include "dembark/impact/system.hpp"
#include "dembark/impact/geometry.hpp"
#include "dembark/impact/start.hpp"

namespace yade {

class LogWall : public Serializable {
public:
	virtual ~LogWall() = default;
	void                  postLoad(LogWall&);
	void                  pyHandleCustomCtorArgs(boost::python::tuple&, boost::python::dict&) override;
	boost::python::object getFriction() const;
	void                  setFriction(const boost::python::object&);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(LogWall,Serializable,"Wall of :yref:`LcpImpact`: one or more bodies of YADE, all :yref:`Wall`, :yref:`CylinderWall` or :yref:`Facet`, that the engine moves with their velocity and angular velocity and that get the force of the logs.",
		((vector<int>,bodies,,Attr::triggerPostLoad,"Ids of the bodies; a list of :yref:`Facet` is one mesh"))
		((Real,stiffness,0,Attr::triggerPostLoad,"Local stiffness [N/m], > 0. Required."))
		((string,name,"",,"Name, for messages and :yref:`LcpImpact.wallForce`"))
		((Vector3r,force,Vector3r::Zero(),Attr::readonly,"Force [N] of the logs on the wall in the last step"))
		((vector<Real>,frictionRows,,Attr::hidden,"Friction against all materials, empty = that of the engine"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.add_property("friction",&LogWall::getFriction,&LogWall::setFriction,"Friction of logs on this wall: a number or a dict, as :yref:`LcpImpact.friction`; None = that of the engine.")
	);
	// clang-format on
};
REGISTER_SERIALIZABLE(LogWall);

class LcpImpact : public GlobalEngine {
public:
	virtual ~LcpImpact() = default;
	void action() override;
	void postLoad(LcpImpact&);
	void preSave(LcpImpact&);
	void pyHandleCustomCtorArgs(boost::python::tuple&, boost::python::dict&) override;

	boost::python::object getStiffness() const;
	void                  setStiffness(const boost::python::object&);
	boost::python::object getDamping() const;
	void                  setDamping(const boost::python::object&);
	boost::python::object getFriction() const;
	void                  setFriction(const boost::python::object&);
	boost::python::list   getWalls() const;
	void                  setWalls(const boost::python::object&);
	boost::python::list   contacts() const;
	Vector3r              wallForce(const std::string& name) const;

	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(LcpImpact,GlobalEngine,"Impacts of logs, spheres that mostly move in a plane, or :yref:`Capsule` in space: the contact forces of each step are the solution of a linear complementarity problem found by the energy criterion, with Finnie-Rabinowicz friction. To be placed after all engines that add forces and right before :yref:`NewtonIntegrator`, whose gravity it takes into account and whose damping must be 0. It finds its contacts itself: no collider, no :yref:`InteractionLoop`.",
		((Real,contactDamping,0,Attr::triggerPostLoad,"Damping [N s/m] of the deformation in each contact, >= 0"))
		((Real,theta,1,Attr::triggerPostLoad,"Weight of the end of the step in the law of contact, 0.5...1: 1 = the published scheme, 0.5 = without its numerical loss"))
		((Real,tangentialRatio,2./7.,Attr::triggerPostLoad,"Tangential stiffness of a contact in units of its normal stiffness, > 0"))
		((string,method,"auto",Attr::triggerPostLoad,"Solver: 'auto', 'energy', 'block', 'murty' or 'pgs'"))
		((Real,tolerance,1e-12,Attr::triggerPostLoad,"Scaled error that the solver may leave, > 0"))
		((int,sweeps,2,Attr::triggerPostLoad,"Normal forces and friction are solved in turn this many times, >= 1"))
		((int,mask,0,,"Only spheres whose :yref:`Body.mask` has a bit in common; 0 = all"))
		((vector<int>,ids,,,"Only these spheres; empty = all"))
		((bool,velocityAtStart,false,,"The velocities that the logs have when the engine runs first belong to the same time as their positions (as in LIGGGHTS), and are moved half a step back; False: they are already half a step behind, as YADE keeps them"))
		((string,impactsFile,"",Attr::triggerPostLoad,"File for one line, with a name that ends in .bin for one record, per ended impact; empty = none"))
		((long,contactCount,0,Attr::readonly,"Pairs near enough to be looked at in the last step"))
		((long,activeCount,0,Attr::readonly,"Contacts with a force in the last step"))
		((long,impactsBegun,0,Attr::readonly,"Impacts begun since the start"))
		((Real,peakForce,0,Attr::readonly,"Largest normal force [N] of the last step"))
		((Real,impulseSum,0,Attr::readonly,"Sum of all normal impulses [N s] since the start"))
		((Real,dissipatedEnergy,0,Attr::readonly,"Energy [J] lost since the start by damping and friction"))
		((Real,elasticEnergy,0,Attr::readonly,"Energy [J] in the contacts at the last step"))
		((long,pivots,0,Attr::readonly,"Pivots of the last step"))
		((long,blockSteps,0,Attr::readonly,"Block steps of the last step"))
		((long,pivotsTotal,0,Attr::readonly,"Pivots since the start"))
		((Real,certificate,0,Attr::readonly,"Scaled error of the last step's solution"))
		((Real,worstCertificate,0,Attr::readonly,"Largest scaled error since the start"))
		((Real,highestForce,0,Attr::readonly,"Largest normal force [N] since the start"))
		((long,steps,0,Attr::readonly,"Steps that the engine has done"))
		((long,lastIteration,-1,Attr::hidden,"Step of the scene that was the last: one saved in its middle is done again after loading"))
		((vector<Real>,stiffnessRows,,Attr::hidden,"Material id (-1 = all) and stiffness, in turn"))
		((vector<Real>,dampingRows,,Attr::hidden,"Material id (-1 = all) and damping, in turn"))
		((vector<Real>,frictionRows,,Attr::hidden,"Two material ids (-1 = all) and six numbers, in turn"))
		((vector<shared_ptr<LogWall>>,wallList,,Attr::hidden,"Walls"))
		((string,savedState,"",Attr::hidden,"State of the contacts and of the file of impacts, filled in before saving"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.add_property("stiffness",&LcpImpact::getStiffness,&LcpImpact::setStiffness,"Stiffness [N/m] of the logs' boundaries, > 0: a number, or a dict by id or label of the material. Required.")
		.add_property("damping",&LcpImpact::getDamping,&LcpImpact::setDamping,"Damping [N s/m] of a body's motion while it is in contact, >= 0: a number, or a dict by id or label of the material.")
		.add_property("friction",&LcpImpact::getFriction,&LcpImpact::setFriction,"Friction: a Coulomb coefficient; or a dict of 'static', 'kinetic', 'slip' (m), 'strength' (Pa), 'healing' (s), 'area' (m^2); or a dict of such values by pairs of materials (id or label).")
		.add_property("walls",&LcpImpact::getWalls,&LcpImpact::setWalls,"List of :yref:`LogWall` or of dicts of its attributes.")
		.def("contacts",&LcpImpact::contacts,"Contacts of the last step: tuples (id_a, id_b, normal, gap, N, T, point); id_b = -1, -2, ... is the first, second, ... wall, the normal and the force point to body a.")
		.def("wallForce",&LcpImpact::wallForce,"Force [N] of the logs on the wall of that name in the last step.")
	);
	// clang-format on

private:
	const NewtonIntegrator&     integrator() const;
	void                        gatherLogs(const Vector3r& gravity);
	::dembark::impact::Body     logOf(const Body&);
	void                        layCapsule(const State&, Real length, ::dembark::impact::Body&);
	void                        gatherWalls();
	void                        addShape(const Body&, const ::dembark::impact::Wall&, std::vector<::dembark::Triangle>&);
	void                        findContacts(double reach, std::vector<::dembark::impact::Contact>&);
	::dembark::impact::Settings commonSettings() const;
	::dembark::impact::Settings settings() const;
	void                        checkStart();
	void                        prepare();
	void                        moveBack() const;
	void                        turnCapsules(double kick);
	void                        pushWalls();
	void                        writeImpacts();
	void                        archive(::dembark::Archive&);
	std::string                 wallName(std::size_t number) const;

	/// Of a capsule after a step.
	struct Turned {
		std::int64_t            id = 0;
		::dembark::Vec3<double> momentum{};  ///< kg m^2/s, of rotation before the step, which may have to be done again
		::dembark::Vec3<double> spin{};      ///< rad/s, that it was given; another one is the user's
		auto                    fields() { return std::tie(id, momentum, spin); }
	};
	/// Of a capsule that moves, in the present step.
	struct Turning {
		std::size_t                 log;  ///< index into `logs`
		::dembark::impact::Attitude attitude;
	};

	std::unique_ptr<::dembark::impact::System> system;
	std::vector<double>                        loaded;         ///< its state in a saved scene
	Real                                       judgedDt = -1;  ///< of the last warning about the time step, or of none
	::dembark::impact::ContactGeometry         around;
	::dembark::impact::ImpactFile              file;
	std::vector<Turned>                        turned;  ///< in the order of their ids
	// Of the present step:
	std::vector<::dembark::impact::Body> logs;        // in the order of their ids; held spheres have infinite mass
	std::vector<Turning>                 capsules;    // those of them that move
	std::vector<int>                     materials;   // ids of YADE, increasing; the index is that of the model
	int                                  plane = -1;  // axis of the blocked translation of all logs that move
};
REGISTER_SERIALIZABLE(LcpImpact);

}  // namespace yade

DEMBARK_SAVED_FORMAT(LogWall, 1)
DEMBARK_SAVED_FORMAT(LcpImpact, 1)
