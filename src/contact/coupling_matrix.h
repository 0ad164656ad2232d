#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// The sparse symmetric matrix of unknowns that contacts or bodies couple, with its right-hand side and solution.
///
/// For one pattern: begin(), then what couples unknowns by note(), notePairs() and noteBases(), then finish(). For one
/// matrix: factor() with a function that calls clear() and adds all entries.
class CouplingMatrix
{
public:
  /// A row of unknowns with weights: what one component of a displacement depends on.
  struct Columns
  {
    int count = 0;
    static constexpr int kMost = 36;   // three for each component of four carried points
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
  explicit CouplingMatrix(bool simplicial) : matrix_(simplicial) {}

  // ---- pattern
  void begin(int unknowns);
  void note(int a, int b) { columns_[std::min(a, b)].push_back(std::max(a, b)); }
  void notePairs(const Columns& a, const Columns& b);
  void noteBases(const Bases& bases);
  void finish();
  int unknowns() const { return unknowns_; }
  /// Where an entry of the pattern lies among values().
  int index(int a, int b) const { return matrix_.index(std::max(a, b), std::min(a, b)); }

  // ---- values
  void clear() { std::fill_n(matrix_.values(), matrix_.rows().size(), 0.0); }
  double* values() { return matrix_.values(); }
  void add(int a, int b, double value) { matrix_.values()[index(a, b)] += value; }
  /// The symmetric pair of entries (a, b) and (b, a) of rows of unknowns.
  void addPair(const Columns& a, const Columns& b, double value);
  /// The diagonal entry (a, a).
  void addSquare(const Columns& a, double value);
  /// Contacts of points with these bases, with or without the part of the second derivative that may be negative.
  void addTerm(const ContactTerm& term, const Bases& bases, bool whole);
  void addRow(const ContactRow& row, const Bases& bases, bool whole);

  /// Forgets the failures of factorisations with whole second derivatives.
  void beginStage() { whole_ = {}; }
  /// Factors what assemble(whole) makes: with the contacts' whole second derivatives where `contacts` says that there
  /// are any, that is due and leaves the matrix positive definite; else without those parts of them that may be
  /// negative. Returns whether the matrix is positive definite.
  template <class Assemble>
  bool factor(bool contacts, Assemble&& assemble)
  {
    if (contacts && whole_.due())
    {
      assemble(true);
      const bool definite = matrix_.factor();
      whole_.tried(definite);
      if (definite)
        return true;
    }
    assemble(false);
    return matrix_.factor();
  }
  /// The same with whole second derivatives only.
  template <class Assemble>
  bool factorExactly(Assemble&& assemble)
  {
    assemble(true);
    return matrix_.factor();
  }
  /// Right-hand side, then solution: one per unknown.
  double* solution() { return solution_.data(); }
  const double* solution() const { return solution_.data(); }
  void solve()
  {
    if (unknowns_ > 0)
      matrix_.solve(solution_.data());
  }

private:
  template <class Block>
  void addBlocks(const Bases& bases, Block&& block);

  SparseCholesky matrix_;
  WholeStiffness whole_;
  int unknowns_ = 0;
  std::vector<std::vector<int>> columns_;
  std::vector<double> solution_;
};

}   // namespace slender
