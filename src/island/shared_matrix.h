#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "island/point_sweeps.h"
#include "linalg/component_cholesky.h"
#include "slender_sim/contact/contact_surface.h"

namespace slender {

/// Decides when to try again a method that may fail. After each failure in a row it skips more attempts: 1, 3, 7, 15.
class Backoff
{
public:
  bool due() { return --after_ < 0; }
  void tried(bool succeeded)
  {
    pause_ = succeeded ? 0 : std::min(15, 2 * pause_ + 1);
    after_ = pause_;
  }

private:
  int after_ = 0, pause_ = 0;
};

/// The sparse symmetric matrix of unknowns that contacts, bodies or averages couple, with its right-hand side and
/// solution.
///
/// For one pattern: begin(), then what couples unknowns by note(), notePairs(), noteRows() and noteBases(), then
/// finish(). What stays while contacts come and go is noted once: see keepNoted(). For one matrix: factor() with a
/// function that calls clear() and adds all entries.
///
/// There are two solvers: sparse Cholesky factorisation, and conjugate gradients that are preconditioned by sweeps over
/// points of three unknowns each. Put the right-hand side into solution() before you call factor(). Sweeps already
/// solve the equations in factor(), because only the solution shows whether the matrix is positive definite.
class SharedMatrix
{
public:
  enum class Solver
  {
    cholesky,
    sweeps
  };

  /// A row of unknowns with weights: what one component of a displacement depends on.
  struct Columns
  {
    int count = 0;
    static constexpr int kMost = 54;   // three for each component of three carried points, and as many of a solid
    std::array<int, kMost> index;
    std::array<double, kMost> value;
    void push(int i, double v)
    {
      index[count] = i;
      value[count++] = v;
    }
  };
  /// For each of four points the number of the first of its three unknowns; negative: it has none.
  using Bases = std::array<int, 4>;

  /// `simplicial`: see SparseCholesky.
  explicit SharedMatrix(bool simplicial) : cholesky_(simplicial) {}
  void setThreads(int threads) { threads_ = threads; }   ///< that factor and solve

  // ---- pattern
  /// The last `multipliers` of the unknowns are multipliers of constraints, see SparseCholesky. What a constraint
  /// couples, and the diagonal entries of multipliers, are to be noted like all else.
  void begin(int unknowns, int multipliers = 0);
  void note(int a, int b) { columns_[std::min(a, b)].push_back(std::max(a, b)); }
  void notePairs(const Columns& a, const Columns& b);
  /// Everything that these rows contain together.
  void noteRows(const Columns* rows, int count);
  void noteBases(const Bases& bases);
  /// What has been noted so far remains noted when beginAgain() begins the next pattern of the same unknowns.
  void keepNoted();
  void beginAgain();
  /// `masses`: see PointSweeps; only `sweeps` needs them.
  void finish(Solver solver = Solver::cholesky, const std::vector<double>& masses = {});
  int unknowns() const { return unknowns_; }
  Solver solver() const { return solver_; }
  /// Where an entry of the pattern lies among values().
  int index(int a, int b) const;
  /// Where the entry (a, b + 1) lies, if (a, b) lies at `at`; a > b + 1. In most columns it follows from the pattern.
  int inNextColumn(int at, int a, int b) const
  {
    const int guess = starts_[b + 1] + at - starts_[b] - 1;
    return guess >= starts_[b + 1] && guess < starts_[b + 2] && rows_[guess] == a ? guess : index(a, b + 1);
  }
  int diagonal(int a) const { return starts_[a]; }   ///< Where the entry (a, a) lies.

  // ---- values
  void clear() { std::fill(values_.begin(), values_.end(), 0.0); }
  double* values() { return values_.data(); }
  void add(int a, int b, double value) { values_[index(a, b)] += value; }
  /// The symmetric pair of entries (a, b) and (b, a) of rows of unknowns.
  void addPair(const Columns& a, const Columns& b, double value);
  /// The diagonal entry (a, a).
  void addSquare(const Columns& a, double value);
  /// J^T K J for at most three rows J, of which noteRows() knows, and their stiffness K.
  void addRows(const Columns* rows, int count, const Eigen::Matrix3d& stiffness);
  /// Contacts of points with these bases, with or without the part of the second derivative that may be negative.
  /// `rows`: at most kMostRows, of the same points.
  void addTerm(const ContactTerm& term, const ContactRow* rows, int count, const Bases& bases, bool whole);
  static constexpr int kMostRows = 2;   ///< the parameters of a place of contact
  /// The same for a term that turns segments and has no rows; `turns`: the unknowns of their turns, negative: none.
  void addTurningTerm(const ContactTerm& term, const Bases& bases, const std::array<int, 2>& turns);

  /// Leaves unknowns out of factor() and solve() until the next finish(), or takes them in again. Either all unknowns
  /// of a component of the matrix are idle, or none; multipliers need not be named. Sweeps cannot leave unknowns out.
  void setIdle(int first, int count, bool idle) { std::fill_n(idle_.begin() + first, count, idle); }

  /// Forgets that factorisations with whole second derivatives, or sweeps, have failed.
  void beginStage() { whole_ = swept_ = {}; }
  /// Factors what assemble(whole) makes: with the contacts' whole second derivatives where `contacts` says that there
  /// are any, that is due and leaves the matrix positive definite; else without those parts of them that may be
  /// negative. Returns whether the matrix is positive definite, see SparseCholesky::factor()
  /// for multipliers.
  template <class Assemble>
  bool factor(bool contacts, Assemble&& assemble)
  {
    if (contacts && whole_.due())
    {
      assemble(true);
      const bool definite = factorPresent();
      whole_.tried(definite);
      if (definite)
        return true;
    }
    assemble(false);
    return factorPresent();
  }
  /// The same with whole second derivatives only.
  template <class Assemble>
  bool factorExactly(Assemble&& assemble)
  {
    assemble(true);
    return factorDirectly();
  }
  /// Right-hand side, then solution: one per unknown.
  double* solution() { return solution_.data(); }
  const double* solution() const { return solution_.data(); }
  void solve();
  /// Factors the present values by Cholesky factorisation, which solve() then uses, whatever the solver is.
  bool factorDirectly();
  /// Of the last solve().
  int linearIterations() const { return iterations_; }

private:
  /// A matrix of some rows. It has one column for each unknown that the rows contain. The unknowns are in ascending
  /// order, and `weight` has their weights in the rows.
  struct MergedRows
  {
    int count = 0;
    std::array<int, Columns::kMost> unknown;
    std::array<Eigen::Vector3d, Columns::kMost> weight;
    Eigen::Vector3d& place(int wanted);
  };
  static void merge(const Columns* rows, int count, MergedRows& merged);
  void addMerged(const MergedRows& merged, const Eigen::Matrix3d& stiffness);

  void noteBlocks();
  void appendNoted(int column, std::vector<int>& rows);
  template <class Block>
  void addBlocks(const Bases& bases, Block&& block);
  bool factorPresent();
  bool sweep();

  /// When to factor with whole second derivatives. Newton's method needs them where curves run along each other, but
  /// the matrix may be indefinite with them.
  Backoff whole_;
  Backoff swept_;   ///< When to try sweeps. They fail if they need too many iterations.
  int unknowns_ = 0, multipliers_ = 0;
  std::vector<std::vector<int>> columns_;        ///< what has been noted since begin() or beginAgain()
  std::vector<std::vector<int>> blocks_below_;   ///< Blocks of 3 x 3 entries: first rows, by first columns.
  std::vector<int> kept_starts_, kept_rows_;     ///< what keepNoted() keeps
  std::vector<int> starts_, rows_;               ///< lower triangle by columns, as SparseCholesky has it
  std::vector<double> values_;
  std::vector<double> solution_;
  std::vector<char> idle_;   ///< per unknown
  Solver solver_ = Solver::cholesky;

  int threads_ = 1;
  ComponentCholesky cholesky_;
  bool cholesky_known_ = false;   ///< has the present pattern
  bool direct_ = true;            ///< the last factorisation is that of the whole matrix

  std::unique_ptr<PointSweeps> sweeps_;   ///< once they are needed
  int iterations_ = 0;
};

}   // namespace slender
