#pragma once

namespace slender {

/// A thread that falls from a nozzle onto a floor.
struct ThreadFall
{
  double density = 1000.0;   ///< [kg/m^3] > 0
  double viscosity = 1.0;    ///< dynamic [Pa s] > 0
  double gravity = 9.81;     ///< along the fall [m/s^2] >= 0
  double diameter = 0.005;   ///< of the nozzle [m] > 0
  double flow = 1e-6;        ///< [m^3/s] > 0
  double height = 0.1;       ///< from the nozzle to the floor [m] > 0
};

/// What forms where the thread lands, to within about a factor of two. The coil's radius is not overestimated: over all
/// stable coils of the reference solutions the estimate is 0.35 to 1 times the true radius.
struct Landing
{
  double speed = 0.0;         ///< of the fluid [m/s]
  double radius = 0.0;        ///< of the thread's section [m]
  double coil_radius = 0.0;   ///< [m]
  double frequency = 0.0;     ///< of coiling [rad/s]
  /// Several steady coils exist at this height, see estimateLanding().
  bool several_coils = false;

  /// A coil this tight is no thread any more: the section is as wide as the turn.
  bool slender() const { return coil_radius > kLeastCoil * radius; }
  static constexpr double kLeastCoil = 1.5;
};

/// The speed follows from the steady balance of weight, inertia and viscous tension along the thread (3 mu A U')' + rho
/// g A = rho A U U', with no tension at the floor. The coil's radius follows from the scaling laws of viscous,
/// gravitational and inertial coiling [Ribe 2004], with factors fitted to the reference solutions of coiling; the
/// tightest law counts most.
///
/// Several steady coils exist where gravitational coiling is the fastest of the three laws and has a frequency above
/// 1.5 sqrt(g / H). This is the inertio-gravitational regime of Ribe, Huppert, Hallworth, Habibi and Bonn (J. Fluid
/// Mech. 555, 2006). The thread above the coil swings there like a pendulum, and each coil turns about as fast as one
/// of the pendulum's modes, whose frequencies go with sqrt(g / H). For a strongly stretched thread the two conditions
/// are the range of heights of that paper, Pi^(-1/6) < H (g / nu^2)^(1/3) < Pi^(-5/48) with
/// Pi = (nu^5 / (g Q^3))^(1/5), up to factors of order one. The factors are those of the reference solutions of
/// coiling, which have several coils at heights from 8.1 to 18.5, and between 15.9 and 21.5 no stable one. The rule
/// gives 7.9 to 21.3.
Landing estimateLanding(const ThreadFall& fall);

/// Returns the speed out of the nozzle [m/s] below which a fluid of this surface tension [N/m] > 0 drips instead of
/// flowing as a jet. Height and flow of `fall` do not matter.
///
/// The criterion is that of Clanet and Lasheras (J. Fluid Mech. 383, 1999) for fluids without viscosity. The Weber
/// number rho U^2 D / gamma is
///   4 (Bo_o / Bo) (1 + K Bo_o Bo - sqrt((1 + K Bo_o Bo)^2 - 1))^2,   Bo = sqrt(rho g D^2 / (2 gamma)),
/// with the Bond numbers Bo of the inner and Bo_o of the outer diameter, and K = 0.37, which they give for water in
/// air. Three choices are not theirs. A nozzle has one diameter here, so Bo_o = Bo. K = 0.37 serves all fluids. The
/// result is zero for mu > sqrt(rho gamma D / 2), which is an Ohnesorge number of 1 with the nozzle's radius: viscosity
/// then slows the recoil of what hangs from the nozzle. More viscous fluids can drip as well, below limits that are not
/// known here.
double leastJettingSpeed(const ThreadFall& fall, double surface_tension);

/// Edges and steps that resolve what forms.
struct EdgeChoice
{
  double feed = 0.0;           ///< length of the edges at the nozzle [m]
  double longest = 0.0;        ///< at the floor [m]
  double highest = 0.0;        ///< the longest edge anywhere [m]
  double shortest = 0.0;       ///< [m]
  double longest_step = 0.0;   ///< [s]; infinite when no coil forms
};

/// Twenty edges per turn of the estimated coil, no fewer than 25 over the fall, and 0.06 rad of a turn in a step. Where
/// no slender coil forms, edges are half a nozzle's diameter long, and steps are not limited.
///
/// Where several coils exist, edges are half as long, and steps a fifth as long. There the branches of stable coils end
/// at folds, near which small errors in the height or in the damping decide whether the thread leaves its coil.
/// Implicit Euler damps a mode of the pendulum by half the step angle per radian. The reference coils approach their
/// steady motion by only 0.02 to 0.03 per radian, so the usual steps damp the pendulum as much as the fluid does.
EdgeChoice chooseEdges(const ThreadFall& fall, const Landing& landing);

/// Edges of this length make so many per turn of the coil.
double edgesPerTurn(const Landing& landing, double edge_length);

}   // namespace slender
