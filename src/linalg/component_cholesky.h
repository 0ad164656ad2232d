#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "disjoint_sets.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// Cholesky factorisation of a sparse symmetric matrix by its components. Components are sets of unknowns such that no
/// entry couples two sets. Each component has its own factor. If its pattern equals that of a component of the previous
/// matrix, it takes over the analysis. So only what couples anew is analysed when contacts come and go, and no result
/// changes. Several threads factor and solve several components.
class ComponentCholesky
{
public:
  /// `simplicial`: see SparseCholesky.
  explicit ComponentCholesky(bool simplicial) : simplicial_(simplicial) {}

  /// Takes the lower triangle by columns and the number of multipliers, in the form of SparseCholesky::setPattern().
  void setPattern(const std::vector<int>& starts, const std::vector<int>& rows, int multipliers = 0);
  /// Returns whether the matrix is positive definite, see SparseCholesky::factor() for multipliers. `values` has one
  /// value per entry of the pattern. Components whose first unknown is `idle`, of which there is one entry per unknown,
  /// are left out, also by solve(). `threads`: see parallelFor().
  bool factor(const std::vector<double>& values, const std::vector<char>& idle, int threads);
  /// x := A^-1 x after a factor() that returned true.
  void solve(double* x, int threads);

private:
  struct Component
  {
    std::vector<int> unknowns, entries;   ///< places in the matrix; unknowns are in ascending order
    std::vector<int> starts, rows;        ///< the pattern, in the numbers of the component
    std::vector<double> x;                ///< work space of solve()
    int multipliers = 0;
    std::uint64_t hash = 0;   ///< of the pattern
    bool idle = false, definite = false;
    std::optional<SparseCholesky> cholesky;
  };
  void findComponents(const std::vector<int>& starts, const std::vector<int>& rows);
  void analyse(Component& component);

  const bool simplicial_;
  std::vector<Component> components_;
  std::unordered_multimap<std::uint64_t, Component> known_;   ///< components of the previous pattern, by their hashes
  DisjointSets sets_;
  std::vector<int> component_of_, number_;   ///< of each unknown: its component, and its number there
};

}   // namespace slender
