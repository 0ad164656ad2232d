#include "slender_sim/study/study.h"

namespace slender::study {

// One per file; a new study is its file, one line here and one below.
void runCantilever(StudyContext&);
void runElastica(StudyContext&);
void runRodsAtRest(StudyContext&);
void runSwing(StudyContext&);
void runBeamFrequencies(StudyContext&);
void runTorsion(StudyContext&);
void runRodScaling(StudyContext&);
void runImplicitVsExplicit(StudyContext&);
void runRodStability(StudyContext&);
void runBendTwist(StudyContext&);
void runLateralBuckling(StudyContext&);
void runStaticsStability(StudyContext&);
void runPerversion(StudyContext&);
void runTwistAsymmetry(StudyContext&);
void runTorsionalPendulum(StudyContext&);
void runWilberforce(StudyContext&);
void runRodContactSafety(StudyContext&);
void runHelicalBuckling(StudyContext&);
void runHelicalScene(StudyContext&);
void runMichell(StudyContext&);
void runKnot(StudyContext&);
void runStickSlip(StudyContext&);
void runPlectoneme(StudyContext&);
void runChain(StudyContext&);
void runTree(StudyContext&);
void runHair(StudyContext&);
void runGreenhill(StudyContext&);
void runPeerCases(StudyContext&);
void runProjection(StudyContext&);
void runRodTables(StudyContext&);
void runTrouton(StudyContext&);
void runThreadTwist(StudyContext&);
void runRetraction(StudyContext&);
void runMerging(StudyContext&);
void runFiberExtrusion(StudyContext&);
void runDraggedCatenary(StudyContext&);
void runCoiling(StudyContext&);
void runThreadAccuracy(StudyContext&);
void runThreadStability(StudyContext&);
void runThreadDefaults(StudyContext&);
void runSewingMachine(StudyContext&);
void runThreadTables(StudyContext&);
void runSagging(StudyContext&);
void runThreadImplicitVsExplicit(StudyContext&);
void runClothCollisionSafety(StudyContext&);
void runWillmoreSphere(StudyContext&);
void runWillmoreHole(StudyContext&);
void runWillmoreSmoothing(StudyContext&);
void runPlate(StudyContext&);
void runPlatePoisson(StudyContext&);
void runCurvedShells(StudyContext&);
void runIbmVsHinge(StudyContext&);
void runImplicitStep(StudyContext&);
void runClothStability(StudyContext&);
void runClothAccuracy(StudyContext&);
void runStickSlipStrip(StudyContext&);
void runFlag(StudyContext&);
void runDrape(StudyContext&);
void runFabricDrape(StudyContext&);
void runStiffnessRange(StudyContext&);
void runRubberBand(StudyContext&);
void runBreathingSurface(StudyContext&);
void runTrackingMethods(StudyContext&);
void runPartitions(StudyContext&);
void runClustering(StudyContext&);
void runCharacter(StudyContext&);
void runBackflip(StudyContext&);
void runClothOnBranch(StudyContext&);
void runTrackingStability(StudyContext&);
void runTrackingOverhead(StudyContext&);
void runTrackingExactness(StudyContext&);
void runLean(StudyContext&);
void runCostModel(StudyContext&);
void runRepeatability(StudyContext&);

const std::vector<Study>& studies()
{
  static const std::vector<Study> all = {
      {"cantilever", "heavy rod clamped horizontally: aspect ratio H/W against Gamma, static and settled",
       runCantilever},
      {"elastica", "buckled and end-loaded planar rods against elliptic integrals", runElastica},
      {"rods_at_rest", "settled tips of four 1 m rods against the exact elastica", runRodsAtRest},
      {"swing", "a rod released from rest: tip error at 1 s against CPU time, all integrators and steps", runSwing},
      {"beam_frequencies", "natural frequencies of the clamped-free rod, and each integrator's numerical damping",
       runBeamFrequencies},
      {"torsion", "torque of a twisted rod and period of a torsional pendulum", runTorsion},
      {"rod_scaling", "time per Newton iteration and node from 50 to 100,000 nodes", runRodScaling},
      {"rod_implicit_vs_explicit", "hair strand: stable steps and cost of implicit against explicit integration",
       runImplicitVsExplicit},
      {"rod_stability", "extreme stiffness, thickness, steps, twist and grasps: done, cut or refused with reason",
       runRodStability},
      {"bend_twist", "heavy naturally curved rod: planar or three-dimensional on both sides of the boundary",
       runBendTwist},
      {"lateral_buckling", "heavy cantilevers of elliptical section that topple sideways: critical load",
       runLateralBuckling},
      {"statics_stability",
       "statics from exactly symmetric states around thresholds: never an unstable equilibrium called stable",
       runStaticsStability},
      {"perversion", "a curled ribbon drawn flat and released: two helices of opposite handedness", runPerversion},
      {"twist_asymmetry", "a V and a semicircle turned at one end: where the twist goes", runTwistAsymmetry},
      {"torsional_pendulum", "a disc that turns on a wire: period, all integrators and steps", runTorsionalPendulum},
      {"wilberforce", "a body on a helical spring: frequencies, beat, exchange of energy", runWilberforce},
      {"rod_contact_safety",
       "1,000 random knots, heaps and whips: an independent check finds no penetration after any step",
       runRodContactSafety},
      {"helical_buckling",
       "localised helix of a twisted rod: peak, moment and envelope against discrete and smooth solutions",
       runHelicalBuckling},
      {"helical_scene",
       "the shipped scene of the localised helix and three more, as simulate runs them, against the smooth solutions",
       runHelicalScene},
      {"michell", "twist at which a ring leaves its plane, by the energy's Hessian and by the growth of a push",
       runMichell},
      {"greenhill", "torque that buckles a clamped straight rod under tension or compression", runGreenhill},
      {"stick_slip",
       "compression at which the foot of a strip pressed on a floor slips, against the coefficient of friction",
       runStickSlip},
      {"knot", "open overhand knots: end force against the size of the loop", runKnot},
      {"plectoneme", "a twisted rod with slack winds about itself: twist moment and tension against the ideal ply",
       runPlectoneme},
      {"chain", "hooked links hold while the chain is drawn taut, and part when one is cut or bends open", runChain},
      {"tree", "a tree of 2,158 vertices in wind: what its root carries, time per step", runTree},
      {"hair", "54,000 vertices of hair on a head that turns: time per step, worst gap", runHair},
      {"peer_cases", "published cases of other codes: a bent cantilever in space, cantilevers under distributed load",
       runPeerCases},
      {"projection",
       "inextensible rope: length error and iterations of fast projection; against stiff stretching, error against run "
       "time",
       runProjection},
      {"rod_tables", "time per step of the thesis's rod examples, part by part, beside its table 4.1", runRodTables},
      {"trouton", "straight viscous threads stretched by plates and by their weight", runTrouton},
      {"thread_twist", "torque of straight viscous threads twisted at a steady rate", runThreadTwist},
      {"retraction", "a free viscous thread drawn together by surface tension", runRetraction},
      {"merging", "two parallel viscous threads in touch flow together at the rate of the model; a pile of honey",
       runMerging},
      {"fiber_extrusion", "a viscous thread drawn steadily from a nozzle by a roll", runFiberExtrusion},
      {"dragged_catenary", "a viscous thread that falls onto a fast belt, with and without surface tension",
       runDraggedCatenary},
      {"coiling", "a viscous thread that coils: frequency and radius against height, up and down", runCoiling},
      {"sewing_machine", "patterns of a viscous thread on a moving belt, its speed rising and falling",
       runSewingMachine},
      {"thread_tables", "time per frame of the thesis's thread examples and of hair, beside its table 5.1",
       runThreadTables},
      {"sagging", "viscous threads that sag between plates: paths in time, catenary or U", runSagging},
      {"thread_implicit_vs_explicit",
       "a coiling thread: largest steps and cost of implicit against explicit integration",
       runThreadImplicitVsExplicit},
      {"thread_accuracy", "error against run time of a viscous thread that sags between two plates", runThreadAccuracy},
      {"thread_stability",
       "viscous threads in all ranges of viscosity, surface tension, step and motion; an hour of pouring",
       runThreadStability},
      {"cloth_collision_safety",
       "continuous tests of a million pairs, none missed; scenes in which cloth never passes through anything",
       runClothCollisionSafety},
      {"thread_defaults",
       "poured fluids from water to pitch, and coils, whose scenes give no edges: resolved, warned of or refused",
       runThreadDefaults},
      {"willmore_sphere", "an icosahedron and rough spheres that Willmore flow makes round: int H^2 against 16 pi",
       runWillmoreSphere},
      {"willmore_hole", "caps of spheres and pieces of a torus cut out and closed again by Willmore flow",
       runWillmoreHole},
      {"willmore_smoothing", "rough meshes of 24,192 and 44,928 triangles: times of 16 steps and of the factorisation",
       runWillmoreSmoothing},
      {"plate", "plates of every bending model on every mesh against plate theory: what D means", runPlate},
      {"plate_poisson",
       "clamped, supported and laterally loaded plates with Poisson's ratios of bending from -0.3 to 0.5",
       runPlatePoisson},
      {"curved_shells",
       "shells that are curved at rest: they keep their shape without load, and vibrate as the method of Ritz says",
       runCurvedShells},
      {"ibm_vs_hinge",
       "isometric bending beside hinges, as thesis table 2.1: gradient, Hessian, explicit and implicit steps",
       runIbmVsHinge},
      {"implicit_step", "a sheet pinned at two corners: a step and its parts beside one factorisation of its matrix",
       runImplicitStep},
      {"cloth_stability",
       "extreme stiffness, steps, random and crushed starts, needles, a yanked corner: done, recovered or refused with "
       "reason",
       runClothStability},
      {"cloth_accuracy",
       "error against run time of the cloth's integrators and solvers, on a flag and a swinging cloth",
       runClothAccuracy},
      {"stick_slip_strip",
       "compression at which the foot of a cloth strip pressed on a floor slips, against the coefficient of friction",
       runStickSlipStrip},
      {"flag", "a flag in wind, as thesis figure 2.1: isometric bending beside hinges, statistics and wrinkles",
       runFlag},
      {"fabric_drape",
       "drape coefficient (Cusick) and droop of strips of silk, cotton, wool and denim against published values",
       runFabricDrape},
      {"drape",
       "a sheet draped over a sphere, as thesis figure 2.2: isometric bending beside hinges, shapes and wrinkles",
       runDrape},
      {"stiffness_range",
       "draped sheets of bending over membrane stiffness 1e-5, 1e-3, 1e-2, as thesis figure 2.3: isometric bending "
       "beside hinges",
       runStiffnessRange},
      {"rubber_band",
       "an elastic curve that follows an accelerated guide (thesis figure 6.3): averaged against pointwise constraints",
       runRubberBand},
      {"breathing_surface",
       "a guide that rapidly expands and contracts (thesis figure 6.4): averaged against pointwise constraints",
       runBreathingSurface},
      {"tracking_methods",
       "error against run time of ways to keep averages: Lagrange multipliers, penalty, manifold projection",
       runTrackingMethods},
      {"partitions", "16 to 1024 regions, of one size and of two, set the scale of folds (thesis figures 6.5, 6.6)",
       runPartitions},
      {"clustering", "regions of a walking character: animation-aware clustering beside static (thesis figure 6.7)",
       runClustering},
      {"character",
       "a character of 3,050 vertices that walks as its guide does (thesis figures 6.2, 6.10): as it is, in a "
       "headwind, crinkled",
       runCharacter},
      {"cloth_on_branch",
       "a preview of 35 vertices, its scene in full resolution, and the same tracked (thesis figure 6.1): where they "
       "end",
       runClothOnBranch},
      {"backflip", "five looks of a bag of 1,297 vertices that tracks one of 88 through a backflip (thesis figure 6.9)",
       runBackflip},
      {"tracking_stability",
       "guides that collapse, explode, jump or are not numbers, constraints that conflict: done or refused with reason",
       runTrackingStability},
      {"tracking_overhead",
       "steps of cloth with and without tracking, in the sizes of the thesis's table 6.1, beside it",
       runTrackingOverhead},
      {"tracking_exactness",
       "averages of tracked cloths against their guides' after every step, with wind, jumps, contact",
       runTrackingExactness},
      {"lean", "instructions per step and memory of every feature in scenes that do not name it (needs valgrind)",
       runLean},
      {"cost_model", "time per step and memory against size, all solvers with contact and without: measured and fitted",
       runCostModel},
      {"repeatability", "every scene of the package and random ones, each twice in fresh processes: equal bit by bit",
       runRepeatability},
  };
  return all;
}

const Study* findStudy(const std::string& name)
{
  for (const Study& s : studies())
    if (s.name == name)
      return &s;
  return nullptr;
}

}   // namespace slender::study
