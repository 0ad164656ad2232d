#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/dynamics/chain_holds.h"
#include "slender_sim/energy/rod_kernel.h"

namespace slender {

/// Where a chain of nodes and edges is: the base configuration, a trial that is reached from it, and what of them is
/// prescribed, in the layout of the hot loops. The unknowns are four per node: its position, and the turn of the edge
/// after it. Frames are transported from the base to the trial (thesis 4.6.2, Newton update). ChainSystem adds the
/// equations.
class ChainConfiguration
{
public:
  ChainConfiguration(const ChainConfiguration&) = delete;
  ChainConfiguration& operator=(const ChainConfiguration&) = delete;

  int nodes() const { return a_.nodes; }
  const RodArrays& arrays() const { return a_; }

  /// Trial position of a node.
  void setPosition(int node, const Eigen::Vector3d& x) { put(a_.x, node, x); }
  Eigen::Vector3d position(int node) const { return get(a_.x, node); }
  Eigen::Vector3d basePosition(int node) const { return {x_base_[0][node], x_base_[1][node], x_base_[2][node]}; }
  double leastRestLength() const { return min_rest_length_; }

  bool isFree(int node) const { return holds_.isFree(node); }
  bool mayTurn(int edge) const { return holds_.mayTurn(edge); }   ///< its angle is not prescribed
  /// By how much an edge has turned about its tangent since forgetTurns(), at the trial [rad]. Without keepTurns() it
  /// is the turn since the base.
  double turn(int edge) const { return (turned_.empty() ? 0.0 : turned_[edge]) + a_.turn[edge]; }
  /// Whether an unknown is prescribed, or does not exist: the last node of an open chain has no edge.
  bool held(int unknown) const
  {
    const int node = unknown / 4;
    return unknown % 4 < 3 ? !isFree(node) : node >= a_.edges || !mayTurn(node);
  }

protected:
  static constexpr int kHalo = RodArrays::kHalo;

  ChainConfiguration() = default;
  ~ChainConfiguration() = default;

  static void put(double* const (&p)[3], int i, const Eigen::Vector3d& v)
  {
    for (int k = 0; k < 3; ++k)
      p[k][i] = v[k];
  }
  static Eigen::Vector3d get(const double* const (&p)[3], int i) { return {p[0][i], p[1][i], p[2][i]}; }

  /// Says what the chain is, and takes no memory. It comes first; a chain may change its number of nodes afterwards.
  void setSize(int nodes, bool closed, Curvature curvature);
  /// Takes memory for the arrays of `capacity` nodes, with zeros in it.
  void allocateArrays(int capacity);
  bool allocated() const { return capacity_ > 0; }
  int capacity() const { return capacity_; }
  Curvature curvature() const { return curvature_; }
  /// Of a closed chain: the halo of an array of nodes or edges repeats them.
  void wrapHalo(double* p, int count) const;

  /// Trial := base + alpha direction, four numbers per node. With alpha = 0 the direction may be anything.
  void moveTrial(double alpha, const double* direction);
  /// Base := trial.
  void takeBase();
  /// Copies of the base for a later return to it.
  void keepBase();
  void returnToBase();

  /// Whether the turns of the edges are added up from the last forgetTurns() on; that is for terms that act on them.
  void keepTurns(bool keep)
  {
    for (auto* turns : {&turned_, &saved_turned_})
      turns->resize(keep ? a_.edges : 0);
  }
  void forgetTurns() { std::fill(turned_.begin(), turned_.end(), 0.0); }
  const double* turned() const { return turned_.data(); }

  RodArrays a_;
  AlignedVector<double> x_base_[3];
  double min_rest_length_ = 0;
  ChainHolds holds_;

private:
  Curvature curvature_ = Curvature::tangent;
  int capacity_ = 0;
  std::vector<AlignedVector<double>> storage_;
  AlignedVector<double> saved_[10];
  std::vector<double> turned_, saved_turned_;   ///< per edge; empty: nobody wants them
};

}   // namespace slender
