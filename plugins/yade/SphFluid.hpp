// Smoothed particle hydrodynamics for YADE: a fluid beside the bodies of the scene, which push it and are pushed by it. The physics is
// that of dembark/sph; here YADE's bodies, steps and conventions are mapped to it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <core/GlobalEngine.hpp>

#include "SavedFormat.hpp"
#include "attributes.hpp"
#include "dembark/sph/solver.hpp"

namespace yade {

class SphFluid : public GlobalEngine {
public:
	virtual ~SphFluid() = default;
	void action() override;
	void preSave(SphFluid&);
	void postLoad(SphFluid&);

	int                 addParticles(const boost::python::object& points, const boost::python::object& velocity,
	                                 const boost::python::object& pressures);
	int                 addWall(const boost::python::object& points);
	int                 addBody(int id, const boost::python::object& points);
	int                 addBox(int id, const Vector3r& edges);
	void                addPlane(const Vector3r& point, const Vector3r& normal);
	boost::python::list positions();
	boost::python::list velocities();
	boost::python::list densities();
	boost::python::list pressures();
	std::string         particleRows();
	Vector3r            force(int id);
	Vector3r            torque(int id);
	Vector3r            wallForce(int number);
	boost::python::dict energies();
	Vector3r            momentum();
	Real                particleMass() const;
	Real                longestStep() const;

	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(SphFluid,GlobalEngine,"Weakly compressible fluid of smoothed particles with walls, and with bodies of YADE that float, fall or are moved in it. Its particles are no bodies of YADE. To be placed before :yref:`NewtonIntegrator`, whose gravity it takes and whose damping must be 0.",
		((Real,spacing,0,,"Distance [m] of the lattice that the fluid begins as, > 0. Required."))
		((Real,soundSpeed,0,,"[m/s], ten times the largest speed that will come, or more. Required."))
		((int,substeps,1,,"Steps of YADE in one of the fluid, >= 1: contacts want shorter steps. Bodies feel the fluid's force in each of them"))
		((int,dimension,3,,"2: the plane z = 0, masses and forces are those of a metre of depth; 3"))
		((Real,density,1000,,"At no pressure [kg/m^3]"))
		((Real,smoothing,1.3,,"h over the spacing, 0.8...3"))
		((string,kernel,"wendland_c2",,"'wendland_c2' or 'cubic_spline'"))
		((string,boundary,"extrapolated",,"Pressure of walls and bodies: 'extrapolated' from the fluid, or 'dynamic', by their own continuity"))
		((Real,alpha,0.02,,"Artificial viscosity, 0...1"))
		((Real,delta,0.1,,"Diffusion of density, 0...0.5"))
		((Real,gamma,7,,"Exponent of Tait's equation of state, >= 1"))
		((bool,tension,false,,"Keep negative pressures, for closed vessels"))
		((bool,noSlip,false,,"Viscosity acts at walls and bodies, too"))
		((string,moment,"lattice",,"What sums over gradients are divided by: the moment of the kernel on the 'lattice', or over each particle's neighbours, 'particles'"))
		((Real,shifting,0,,"Coefficient of shifting, 2 is usual; 0 = none"))
		((Real,xsph,0,,"Epsilon of XSPH, 0...1: how far particles drift with the mean velocity around them; 0 = none, 0.5 is usual"))
		((int,shepard,0,,"Steps of the fluid from one of Shepard's filters of density to the next; 0 = none, 30 is usual"))
		((Real,contactStiffness,0,,"Contact potential between fluid and bodies in the place of pressure [Pa/m^3, in the plane Pa/m^2]; 0 = none"))
		((int,contactExponent,4,,"Exponent of the contact potential, >= 1"))
		((Real,slitPressure,1,,"Share of the pressure around it that a film has between faces of boxes or on a plane, 0...1"))
		((Real,skin,0.2,,"Over h: how far beyond their support neighbours are searched"))
		((int,threads,1,,"The same bits come from any number"))
		((long,steps,0,Attr::readonly,"Steps that the fluid has made"))
		((Real,fluidTime,0,Attr::readonly,"Time of the fluid [s], from the step in which the engine ran first"))
		((vector<Vector3r>,firstPositions,,Attr::hidden,"Of the fluid, at the beginning [m]"))
		((vector<Vector3r>,firstVelocities,,Attr::hidden,"[m/s]"))
		((vector<Real>,firstPressures,,Attr::hidden,"[Pa]"))
		((vector<int>,solidIds,,Attr::hidden,"Body of each wall and body of the fluid, -1 = a wall at rest"))
		((vector<int>,solidSizes,,Attr::hidden,"Number of its particles"))
		((vector<Vector3r>,solidPoints,,Attr::hidden,"Their places [m], in the frames of the bodies"))
		((vector<int>,boxNumbers,,Attr::hidden,"Numbers of the bodies that are boxes"))
		((vector<Vector3r>,boxEdges,,Attr::hidden,"Their edges [m]"))
		((vector<Vector3r>,planes,,Attr::hidden,"Point and normal of each plane"))
		((vector<Vector3r>,ways,,Attr::hidden,"Of each: displacement and turn since the fluid's last step [m, rad], velocities at its end"))
		((Real,elapsed,0,Attr::hidden,"Since the fluid's last step [s]"))
		((int,passed,-1,Attr::hidden,"Steps of the scene since the fluid's last one; -1 = it has not begun"))
		((Real,lastLength,0,Attr::hidden,"Length of the step of the scene before [s]"))
		((long,lastIteration,-1,Attr::hidden,"Step of the scene that was the last: one saved in its middle is done again after loading"))
		((Vector3r,gravity,Vector3r::Zero(),Attr::hidden,"That the fluid was made with [m/s^2]"))
		((string,savedState,"",Attr::hidden,"State of the fluid, filled in before saving"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.def("addParticles",&SphFluid::addParticles,(boost::python::arg("points"),boost::python::arg("velocity")=boost::python::object(),boost::python::arg("pressures")=boost::python::object()),"Add particles of fluid at points [m], of one velocity [m/s] (None: at rest), with pressures [Pa] (a list; None: 0); returns how many there are now. Before the first step.")
		.def("addWall",&SphFluid::addWall,(boost::python::arg("points")),"Add a wall at rest, of particles at points [m]; returns its number. Before the first step.")
		.def("addBody",&SphFluid::addBody,(boost::python::arg("id"),boost::python::arg("points")),"Give the body id, a clump or a single one, particles at points [m], where it is now; returns its number. Before the first step.")
		.def("addBox",&SphFluid::addBox,(boost::python::arg("id"),boost::python::arg("edges")),"Give the body id, a clump or a single one, the particles of a box with these edges [m] along its axes, around its centre: whole numbers of the spacing. Between boxes, and on planes, films have the pressure around them times slitPressure. Returns its number. Before the first step.")
		.def("addPlane",&SphFluid::addPlane,(boost::python::arg("point"),boost::python::arg("normal")),"Say that boxes can stand on the plane through point [m], solid on the side that normal points away from.")
		.def("positions",&SphFluid::positions,"Of the particles of fluid [m], in the order in which they were added; so are the others.")
		.def("velocities",&SphFluid::velocities,"[m/s]")
		.def("densities",&SphFluid::densities,"[kg/m^3]")
		.def("pressures",&SphFluid::pressures,"[Pa]")
		.def("particleRows",&SphFluid::particleRows,"Lines 'id type x y z vx vy vz radius mass density pressure' for a dump file: type 1, and as radius half of the spacing.")
		.def("force",&SphFluid::force,(boost::python::arg("id")),"Of the fluid on a body [N].")
		.def("torque",&SphFluid::torque,(boost::python::arg("id")),"Of the fluid on a body, about its centre [N m].")
		.def("wallForce",&SphFluid::wallForce,(boost::python::arg("number")),"Of the fluid on the wall or body with this number [N].")
		.def("energies",&SphFluid::energies,"Energies of the fluid and what it has lost and got since the beginning [J], by name.")
		.def("momentum",&SphFluid::momentum,"Of the fluid [N s], at the time of its positions.")
		.def("particleMass",&SphFluid::particleMass,"Of one particle [kg].")
		.def("longestStep",&SphFluid::longestStep,"Longest stable step of the fluid, 0.6 h/soundSpeed [s]; two thirds of it are usual.")
	);
	// clang-format on

private:
	const Vector3r&          weight() const;
	::dembark::sph::Settings settings() const;
	::dembark::sph::Solver&  fluid();
	void                     adding() const;
	int                      add(int id, const std::vector<Vector3r>& points);
	void                     mustFit(int id, const std::string& name) const;
	const Body*              bodyOf(std::size_t k) const;
	std::size_t              numberOf(int id) const;
	void                     place(std::size_t k, ::dembark::sph::Body& body) const;
	void                     push();

	std::unique_ptr<::dembark::sph::Solver>   solver;
	std::vector<::dembark::sph::DrivenMotion> motions;  // of each wall and body
};
REGISTER_SERIALIZABLE(SphFluid);

}  // namespace yade

DEMBARK_SAVED_FORMAT(SphFluid, 2)
