#pragma once

#include <vector>

#include "slender_sim/linalg/point_kernel.h"

namespace slender {

/// Numeric part of a sparse Cholesky factorisation by supernodes, left-looking [Ng & Peyton, SIAM J. Sci. Comput. 14
/// (1993), 1034] as in CHOLMOD, whose own takes memory in each call (workspace, teams of threads). This one has
/// all of it from setPattern() on and stays in its caller's thread.
///
/// The signs of the pivots are known beforehand: the matrix is L D L^T, where D is diagonal and has entries 1 and -1.
class SupernodalNumeric
{
public:
  /// `starts`, `rows`: lower triangle of the matrix by columns. `factor`: where the supernodes of L lie; its arrays
  /// must stay, its values are not read. `negative`: columns whose entry in D is -1, ascending.
  void setPattern(const SupernodalFactor& factor, const std::vector<int>& starts, const std::vector<int>& rows,
                  const std::vector<int>& negative = {});
  /// Factors the matrix with these values (one per entry of the pattern) into x, the values of L.
  /// False when a pivot has another sign (or is not finite).
  bool factor(const double* values, double* x);
  /// Returns the size of the pivot of a column in the last factorisation.
  double pivot(int column, const double* x) const;

private:
  /// Consecutive columns of a supernode whose pivots have the same sign.
  struct Run
  {
    int begin, end;
    double sign;
  };
  void findRuns(const std::vector<int>& negative);
  static bool factorRun(const Run& run, int width, int height, double* block);
  int columns(int s) const { return f_.first[s + 1] - f_.first[s]; }
  int rows(int s) const { return f_.row_starts[s + 1] - f_.row_starts[s]; }
  void subtract(int descendant, int s, double* x);
  bool finish(int s, double* x) const;
  void queue(int s, int row);

  SupernodalFactor f_{};
  std::vector<int> starts_, targets_;   ///< entries of each column of the matrix; where each goes in x
  std::vector<int> supernode_of_, place_,
      relative_;   ///< per row: its supernode, its place in the present one; places of the rows of an update
  /// per supernode: list of those that update it next; of each the first row that does
  std::vector<int> head_, next_, row_;
  std::vector<Run> runs_;
  std::vector<int> first_run_;   ///< per supernode, and one more
  std::vector<double> update_;
};

}   // namespace slender
