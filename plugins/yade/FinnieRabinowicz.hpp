// Hertz or Hooke contact with Finnie-Rabinowicz friction and a capillary bridge for YADE: data of a contact, its parameters from a
// pair of materials, and the law. The formulas are those of dembark/contact.hpp; here only YADE's conventions are mapped to them.
#pragma once

#include <array>
#include <atomic>
#include <mutex>

#include <boost/make_shared.hpp>

#include <core/Dispatching.hpp>
#include <lib/base/openmp-accu.hpp>
#include <pkg/common/ElastMat.hpp>
#include <pkg/common/MatchMaker.hpp>
#include <pkg/common/NormShearPhys.hpp>
#include <pkg/dem/ScGeom.hpp>

#include "CapillaryLiquid.hpp"
#include "SavedFormat.hpp"
#include "attributes.hpp"
#include "dembark/contact.hpp"
#include "dembark/parameters/contact_parameters.hpp"
#include "dembark/pairs/pair_step.hpp"

// Attributes by the table of parameters, from the lists of dembark/parameters/contact_parameters.hpp. YADE's macro appends a text to each
// description, hence the plus.
// clang-format off
#define DEMBARK_KEPT_NUMBER(scope, name, camel, ...) \
	((Real,camel,-1,Attr::triggerPostLoad,description(parameter(::dembark::ContactNumber::name))+))
#define DEMBARK_GIVEN_NUMBER(scope, ...) DEMBARK_GIVEN_NUMBER_##scope(__VA_ARGS__)
#define DEMBARK_GIVEN_NUMBER_pair(name, camel, ...) \
	((shared_ptr<MatchMaker>,camel,,Attr::triggerPostLoad,description(parameter(::dembark::ContactNumber::name))+))
#define DEMBARK_GIVEN_NUMBER_global(name, camel, ...) \
	((Real,camel,::dembark::parameter(::dembark::ContactNumber::name).otherwise,,description(parameter(::dembark::ContactNumber::name))+))
#define DEMBARK_CHOICE(name, camel, type, first, names, doc) \
	((string,camel,#first,Attr::triggerPostLoad,dembark_yade::listed(doc,::dembark::names())+))
// clang-format on

namespace yade {

namespace dembark_yade {

struct ContactView;

/// "doc: 'a', 'b' or 'c'".
std::string listed(const std::string& doc, const std::vector<std::string>& names);

/// Ends the run: the contact of these bodies has no finite force.
[[noreturn]] void refuseForce(const Scene&, Body::id_t, Body::id_t);

/// Different parameters of contacts as packs take them (dembark/pairs), each known by its number.
/// A set that once was in use counts until the law changes.
class LawKinds {
public:
	/// Of these parameters, a new one if need be; -1 if packs do not know the law, or if there are too many kinds.
	int  of(const ::dembark::ContactParameters&);
	void clear();
	/// For time steps of this length.
	std::vector<::dembark::PackedCoefficients<double>> laws(double dt);

private:
	struct Kind {
		::dembark::HertzParameters elasticity;
		::dembark::Friction        friction;
	};
	std::vector<Kind> kinds;
	std::mutex        guard;
};

}  // namespace dembark_yade

class FinnieRabinowiczPhys : public NormShearPhys {
public:
	virtual ~FinnieRabinowiczPhys() {
		if (bridgeVolume > 0.0) ++bridgesLost;
	}

	/// Bridges that did not break but went with their interaction, which a script erased, in all scenes so far.
	inline static std::atomic<long> bridgesLost{0};

	// What a dry contact takes and leaves in a step stands in the first so many bytes: from kn to dissipatedEnergy.
	static constexpr std::size_t ofEveryStep = 192;

	// The revision of the law that this contact is valid for, a whole number below zero. Here FrictPhys keeps tangensOfFrictionAngle:
	// setContactFriction() and the triaxial engines of YADE take every contact for a FrictPhys and write their coefficient, which is
	// not below zero, into it.
	static constexpr double unprepared = -0.5;
	double                  preparedBy = unprepared;
	int                     wallBody   = 0;   // 1 or 2: this body of the interaction is a wall; 0: two spheres
	int                     kind       = -1;  // of the law's kinds; -1: not for packs

	void                    postLoad(FinnieRabinowiczPhys&) { preparedBy = unprepared; }
	bool                    prepared() const { return preparedBy <= -1.0; }
	::dembark::ContactState state() const;
	void                    get(::dembark::ContactState& now) const;  // its rings only under partial slip
	void                    setState(const ::dembark::ContactState& now);
	/// A bridge of carried liquid forms between spheres of these radii (m; infinite = a wall).
	void setBridge(double volume, double imbalance, double radius1, double radius2) {
		bridgeVolume    = volume;
		bridgeImbalance = imbalance;
		ruptureDistance = contact.cohesion.liquid.force->rupture_distance(radius1, radius2, volume);
	}

	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(FinnieRabinowiczPhys,NormShearPhys,"Contact of :yref:`Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz`. :yref:`NormPhys.normalForce` holds the force along the normal with damping and bridge, so that it and :yref:`NormShearPhys.shearForce` are the whole force.",
		((Vector3r,elasticDisplacement,Vector3r::Zero(),,"Elastic tangential displacement [m] of the sphere (of body 1, of two spheres), in the plane of contact"))
		((Real,slip,0,,"Slip [m] since the contact last stuck"))
		((std::vector<Real>,slipRings,,Attr::readonly,"State of a contact with ``presliding='partial_slip'``: displacements [m] of eight rings along an axis and across it, the axis, the radius [m] of the first ring and of the contact"))
		((Real,dissipatedEnergy,0,,"Energy [J] lost by slip and tangential damping since the contact began"))
		((Real,bridgeVolume,0,,"Volume [m^3] of the liquid bridge that is there; 0 = no bridge"))
		((Real,ruptureDistance,0,,"Gap [m] beyond which that bridge, or the contact under 'jkr', breaks; 0 = nothing holds it"))
		((Real,bridgeImbalance,0,,"Volume [m^3] that body 1 (the sphere, of a sphere and a wall) gets back when a bridge of carried liquid breaks, less that of the other"))
		((Real,capillaryForce,0,Attr::readonly,"Force [N] of the bridge, or of the adhesion of dry surfaces, positive = attractive"))
		((Real,viscousForce,0,Attr::readonly,"Force [N] along the normal by which the liquid resists, positive = repulsive"))
		((Vector3r,viscousShearForce,Vector3r::Zero(),Attr::readonly,"Force [N] in the plane of contact by which the liquid resists; it is part of :yref:`NormShearPhys.shearForce`"))
		((Vector3r,rollingAngle,Vector3r::Zero(),,"State of a contact with ``rollingResistance='elastic_plastic'``: angle [rad] of the rolling spring, of the sphere (of body 1, of two spheres)"))
		((Vector3r,rollingTorque,Vector3r::Zero(),Attr::readonly,"Couple [N m] of rolling resistance on body 2"))
		((Real,effectiveYoungsModulus,0,Attr::triggerPostLoad,"E* [Pa], 1/E* = (1-nu1^2)/E1 + (1-nu2^2)/E2"))
		((Real,effectiveShearModulus,0,Attr::triggerPostLoad,"G* [Pa], 1/G* = (2-nu1)/G1 + (2-nu2)/G2"))
		((Real,newBridgeVolume,0,Attr::triggerPostLoad,"Volume [m^3] of a bridge that forms when the bodies touch; the numbers from here on are those of the Ip2 functor, -1: not given"))
		DEMBARK_CONTACT_NUMBERS(DEMBARK_KEPT_NUMBER),
		createIndex();
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.add_property("kn",+[](const FinnieRabinowiczPhys& c) { return c.kn; },"Normal stiffness [N/m] of the spring")
		.add_property("ks",+[](const FinnieRabinowiczPhys& c) { return c.ks; },"Tangential stiffness [N/m] of the spring")
		.add_property("normalForce",+[](const FinnieRabinowiczPhys& c) { return c.normalForce; },"Force [N] on body 2 along the normal, with damping and bridge")
		.add_property("shearForce",+[](const FinnieRabinowiczPhys& c) { return c.shearForce; },"Force [N] on body 2 in the plane of contact")
	);
	// clang-format on
	REGISTER_CLASS_INDEX(FinnieRabinowiczPhys, NormShearPhys);

	// Built from the attributes by the law; behind what every step takes, which shares few lines of the memory.
	::dembark::ContactParameters contact;
};
REGISTER_SERIALIZABLE(FinnieRabinowiczPhys);

class Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys : public IPhysFunctor {
public:
	void go(const shared_ptr<Material>&, const shared_ptr<Material>&, const shared_ptr<Interaction>&) override;
	void postLoad(Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys&);
	FUNCTOR2D(FrictMat, FrictMat);
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys,IPhysFunctor,"Creates :yref:`FinnieRabinowiczPhys`. Elastic constants come from the materials; :yref:`FrictMat.frictionAngle` is not used, and must not change while the scene runs; materials of a derived class, whose further attributes would do nothing, are refused. All pair parameters are :yref:`MatchMaker` objects by material id and may be given as plain numbers.",
		((shared_ptr<MatchMaker>,bridgeVolume,,Attr::triggerPostLoad,"Volume [m^3] of each liquid bridge, formed when two bodies touch; not given or 0 = dry."))
		DEMBARK_CONTACT_NUMBERS(DEMBARK_GIVEN_NUMBER)
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
	);
	// clang-format on

private:
	void check(const FrictMat&);

	std::vector<Real> frictionAngles;  // of each material by id when it was first seen since friction was set; NaN: not yet
	std::array<shared_ptr<MatchMaker>, 2> friction;  // as it was set then
	std::mutex                            guard;
};
REGISTER_SERIALIZABLE(Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys);

class Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz : public LawFunctor {
public:
	bool go(shared_ptr<IGeom>&, shared_ptr<IPhys>&, Interaction*) override;
	void postLoad(Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz&);
	Real getDissipatedEnergy() const;
	long bridgeCount() const;
	long contactCount() const;
	/// What packs take of the law: its kinds for the time step of `step`, and into `step` its switches.
	std::vector<::dembark::PackedCoefficients<double>> forPacks(::dembark::PairStep& step);
	FUNCTOR2D(ScGeom, FinnieRabinowiczPhys);

	const shared_ptr<LiquidExchange> exchange = boost::make_shared<LiquidExchange>();
	// clang-format off
	YADE_CLASS_BASE_DOC_ATTRS_CTOR_PY(Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz,LawFunctor,"Normal force of Hertz or Hooke with damping from a coefficient of restitution, tangential force of Finnie and Rabinowicz, rolling resistance if wanted, and a liquid bridge with capillary and, if wanted, viscous force. A body whose shape is not a :yref:`Sphere` is a wall of infinite radius and mass; a sphere that is not dynamic has infinite mass; two bodies of which neither is dynamic have no force. A bridge keeps its interaction until it ruptures, at any gap.",
		((string,normalLaw,"hertz",Attr::triggerPostLoad,"'hertz' or 'hooke'"))
		((Real,characteristicVelocity,NaN,Attr::triggerPostLoad,"Impact speed [m/s] at which the overlap of 'hooke' equals that of 'hertz'. Required for 'hooke'."))
		DEMBARK_CONTACT_CHOICES(DEMBARK_CHOICE)
		((string,cohesion,"none",Attr::triggerPostLoad,"Attraction: 'none', 'bridge' (given, too, by a capillaryModel), or of dry surfaces 'constant', 'dmt' or 'jkr'"))
		((string,capillaryModel,"none",Attr::triggerPostLoad,"'none', or the force law of a bridge: 'exact', 'willett', 'willett_full', 'rabinovich', 'bagheri', 'constant'"))
		((bool,carriedLiquid,false,Attr::triggerPostLoad,"Bridges take their liquid from the bodies and give it back; needs the engine :yref:`CapillaryLiquid` after the :yref:`InteractionLoop`"))
		((bool,tangentialDamping,true,Attr::triggerPostLoad,"Viscous tangential force while a contact sticks"))
		((bool,limitForce,false,Attr::triggerPostLoad,"No attraction by normal damping"))
		((OpenMPAccumulator<Real>,endedDissipation,,Attr::hidden,"Energy [J] that contacts which have ended had lost"))
		, /*ctor*/
		, /*py*/
		DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES
		.def("dissipatedEnergy",&Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::getDissipatedEnergy,"Energy [J] lost by slip and tangential damping in all contacts since the start.")
		.def("bridgeCount",&Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::bridgeCount,"Number of liquid bridges.")
		.def("contactCount",&Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz::contactCount,"Number of pairs of bodies that touch.")
	);
	// clang-format on

private:
	friend class SphereContactLoop;

	void prepare(FinnieRabinowiczPhys&, const Body&, const Body&);
	void checkScene();
	/// A step of the contact seen in `view`: its forces, into `scene->forces`, and its state. What it gives says whether there is one.
	::dembark::ContactForce act(FinnieRabinowiczPhys&, const Interaction&, const dembark_yade::ContactView& view);
	void reportBridge(FinnieRabinowiczPhys&, const Interaction&, const ::dembark::ContactBodies&, double overlap, double volumeBefore);

	::dembark::ContactOptions options;
	std::atomic<double>       revision{-1.0};
	std::atomic<bool>         warned{false};
	std::atomic<long>         checked{-1};  // last step of checkScene()
	dembark_yade::LawKinds    kinds;        // of this revision
};
REGISTER_SERIALIZABLE(Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz);

}  // namespace yade

// Rows of the table of parameters are attributes.
DEMBARK_SAVED_FORMAT(FinnieRabinowiczPhys, ::dembark::contact_parameter_count)
DEMBARK_SAVED_FORMAT(Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys, ::dembark::contact_parameter_count)
DEMBARK_SAVED_FORMAT(Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz, ::dembark::contact_choice_count)
