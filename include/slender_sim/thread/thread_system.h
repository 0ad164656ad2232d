#pragma once

#include "slender_sim/dynamics/chain_system.h"
#include "slender_sim/energy/spin_inertia.h"
#include "slender_sim/energy/surface_energy.h"

namespace slender {

/// Equations of one step of a thread: a chain with viscous stiffnesses, surface tension, and inertia of the edges'
/// spin. Its number of nodes changes from step to step. Nodes, edges and joints are numbered as in RodArrays.
///
/// Set-up of a step: resize, setPosition and setFrame at its start, takeRestStrains, then the terms, stiffnesses,
/// inertia and what is held; last the trial configuration by setPosition.
class ThreadSystem : public ChainSystem
{
public:
  /// Clears stiffnesses, inertia, loads, terms and holds. Takes memory only when it has never been so large.
  void resize(int nodes);

  /// Frame of edge j to transport from: tangent and first director.
  void setFrame(int j, const Eigen::Vector3d& t, const Eigen::Vector3d& d1)
  {
    put(a_.base_t, j, t);
    put(a_.base_d1, j, d1);
  }
  void setTwist(int joint, double twist) { a_.base_twist[joint] = twist; }
  /// The positions set become the base, and lengths and strains there those of rest. Returns the evaluation, for its
  /// min_chi.
  RodEvaluation takeRestStrains();
  double restLength(int j) const { return 1.0 / a_.inverse_rest_length[j]; }

  /// Stretching modulus k_s [N] and fluid volume [m^3] of edge j.
  void setEdge(int j, double modulus, double volume);
  /// Bending and twisting of a joint, divided by its length [N m].
  void setJoint(int i, double bend, double twist);
  /// Comes before setEdge(). Without surface tension (gamma = 0 N/m) there is no such term.
  void setSurfaceTension(double gamma, SurfaceShape shape);
  /// Inertia of edge j's turn since the start of the step: 1/2 weight (turn - target)^2.
  void setSpin(int j, double weight, double target) { spin_inertia_.set(j, weight, target); }
  double spinWeight(int j) const { return spin_inertia_.weight(j); }
  /// Turn of the trial from the base.
  void setTurn(int j, double turn) { a_.turn[j] = turn; }
  void hold(int node) { holds_.hold(node); }
  void holdTurn(int edge) { holds_.holdTurn(edge); }

  /// Returns the joint that turns most sharply in the last trial, or -1 if no joint turns by more than a right angle.
  /// On return, `cosine` is the cosine of the turn. Only joints with a larger cosine than `cosine` had before the call
  /// are considered; -2 stands for all joints.
  int sharpestJoint(double& cosine) const;

  /// Residual over force scale beyond which a step is not solved, however small the increment: inertia of very short
  /// steps leaves nothing else to see.
  static constexpr double mostUnbalanced() { return 0.1; }

private:
  bool has_surface_ = false;
  SurfaceEnergy surface_;
  SpinInertia spin_inertia_;
};

}   // namespace slender
