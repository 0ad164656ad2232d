#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/Core>

namespace slender {

/// The unknowns of a chain that are prescribed: positions of nodes and turns of edges. It keeps the gradient's entries
/// of these unknowns as reactions.
class ChainHolds
{
public:
  /// Frees all unknowns of a chain with this number of nodes.
  void release(int nodes)
  {
    for (auto* slots : {&node_slot_, &turn_slot_})
    {
      slots->resize(nodes);
      std::fill(slots->begin(), slots->end(), 0);
    }
    nodes_.clear();
    turns_.clear();
    reactions_.clear();
    turn_reactions_.clear();
  }
  /// Holds the position of a node. To hold it twice changes nothing.
  void hold(int node)
  {
    if (!isFree(node))
      return;
    nodes_.push_back(node);
    reactions_.emplace_back(Eigen::Vector3d::Zero());
    node_slot_[node] = static_cast<int>(nodes_.size());
  }
  /// Holds the turn of an edge. To hold it twice changes nothing.
  void holdTurn(int edge)
  {
    if (!mayTurn(edge))
      return;
    turns_.push_back(edge);
    turn_reactions_.push_back(0.0);
    turn_slot_[edge] = static_cast<int>(turns_.size());
  }

  bool isFree(int node) const { return !node_slot_[node]; }
  bool mayTurn(int edge) const { return !turn_slot_[edge]; }
  const std::vector<int>& nodes() const { return nodes_; }   ///< held nodes
  const std::vector<int>& turns() const { return turns_; }   ///< edges whose turns are held

  /// Moves the entries of held unknowns at the nodes from..to-1 from the gradient (four per node) to the reactions.
  void takeReactions(int from, int to, double* gradient)
  {
    for (std::size_t k = 0; k < nodes_.size(); ++k)
      if (const int node = nodes_[k]; node >= from && node < to)
        for (int c = 0; c < 3; ++c)
        {
          reactions_[k][c] = gradient[4 * node + c];
          gradient[4 * node + c] = 0.0;
        }
    for (std::size_t k = 0; k < turns_.size(); ++k)
      if (const int edge = turns_[k]; edge >= from && edge < to)
      {
        turn_reactions_[k] = gradient[4 * edge + 3];
        gradient[4 * edge + 3] = 0.0;
      }
  }
  /// The reactions that were taken last: of a held node [N], and of an edge whose turn is held [N m].
  const Eigen::Vector3d& reaction(int node) const { return reactions_[node_slot_[node] - 1]; }
  double turnReaction(int edge) const { return turn_reactions_[turn_slot_[edge] - 1]; }

private:
  std::vector<int> node_slot_, turn_slot_;   ///< slot in the lists below plus one, 0 = free
  std::vector<int> nodes_, turns_;
  std::vector<Eigen::Vector3d> reactions_;   ///< of nodes_
  std::vector<double> turn_reactions_;       ///< of turns_
};

}   // namespace slender
