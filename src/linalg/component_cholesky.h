#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// Cholesky factorisation of a sparse symmetric matrix by its components: sets of unknowns such that no entry couples
/// two sets. Each has its own factor. If its pattern equals that of a component of the previous matrix, it takes over
/// the analysis, which changes no result, so that only what couples anew is analysed when contacts come and go. Several
/// threads factor and solve several components.
class ComponentCholesky
{
public:
  /// `simplicial`: see SparseCholesky.
  explicit ComponentCholesky(bool simplicial) : simplicial_(simplicial) {}

  /// Lower triangle by columns, as SparseCholesky::setPattern() takes it.
  void setPattern(const std::vector<int>& starts, const std::vector<int>& rows);
  /// `values`: one per entry of the pattern. Returns whether the matrix is positive definite. `threads`: see
  /// parallelFor().
  bool factor(const std::vector<double>& values, int threads);
  /// x := A^-1 x after a factor() that returned true.
  void solve(double* x, int threads);

private:
  struct Component
  {
    std::vector<int> unknowns, entries;   ///< their places in the matrix; unknowns in ascending order
    std::vector<int> starts, rows;        ///< pattern in its own numbers
    std::vector<double> x;                ///< work space of solve()
    std::uint64_t hash = 0;               ///< of the pattern
    bool definite = false;
    std::optional<SparseCholesky> cholesky;
  };
  void findComponents(const std::vector<int>& starts, const std::vector<int>& rows);
  void analyse(Component& component);

  const bool simplicial_;
  std::vector<Component> components_;
  std::unordered_multimap<std::uint64_t, Component> known_;   ///< those of the previous pattern, by their hashes
  std::vector<int> component_of_, number_;   ///< of unknowns: their components, and their numbers there
};

}   // namespace slender
