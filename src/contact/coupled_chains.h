#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "coupling_matrix.h"
#include "slender_sim/dynamics/chain_system.h"

namespace slender {

/// Chains that contact couples, and the sparse matrix that they share. Chains that nothing couples keep their band
/// matrices. So do those that touch only what moves as prescribed, since such contacts couple no more than neighbouring
/// nodes. Other unknowns, those of bodies for example, come behind those of the chains.
///
/// For one pattern: beginPattern(), then what else couples unknowns goes to `matrix`, then endPattern(). For one
/// matrix: factor() with a function that calls assemble() and adds to `matrix` what else there is.
class CoupledChains
{
public:
  /// Number of an unknown that is prescribed. Lower numbers belong to the owner: unknowns that something else carries.
  static constexpr int kPrescribed = -1;

  /// One chain: how its unknowns, four per node, enter the matrix.
  struct Chain
  {
    ChainSystem* system = nullptr;
    bool coupled = false;           ///< has its unknowns in the matrix
    int offset = 0, unknowns = 0;   ///< first number in the matrix, and how many there are
    std::vector<int> dof;           ///< per unknown of the system: its number within the chain, kPrescribed or less
    /// Where the entries of the panels go: index of a value of the matrix, -1: nowhere, or not simply.
    std::vector<int> slots;
    std::vector<const ContactTerm*> own_terms;   ///< present contacts that couple neighbouring nodes alone
    std::vector<const ContactRow*> own_rows;     ///< likewise
    RodEvaluation evaluation;                    ///< the last one
  };
  /// A contact point: a node of a chain; node -1: it is no unknown of its system.
  struct Point
  {
    Chain* chain = nullptr;
    int node = -1;
  };
  /// Four points and a solid.
  using Key = std::array<int, 5>;

  /// `simplicial`: see SparseCholesky.
  explicit CoupledChains(bool simplicial) : matrix(simplicial) {}

  CouplingMatrix matrix;
  std::vector<Chain*> chains;
  std::vector<Point> points;
  /// Per solid of the contacts: it has unknowns of its own.
  std::vector<char> solid_moves;
  /// For the stability of an equilibrium: all contacts couple, and only the exact matrix is factored.
  bool exact = false;

  // ---- contacts of the last evaluation
  /// Sorts contacts by chains and makes room for those that couple unknowns; without any room the pattern is no longer
  /// valid. The lists must live until the next call.
  void take(const std::vector<ContactTerm>& terms, const std::vector<ContactTerm>* more,
            const std::vector<ContactRow>& rows);
  /// The same for the first contacts of a step: the pattern gets room for them alone, so that it follows from the state
  /// and not from the steps before.
  void takeFirst(const std::vector<ContactTerm>& terms, const std::vector<ContactTerm>* more,
                 const std::vector<ContactRow>& rows);
  /// Calls f for the contacts in the matrix: all but those of chains that keep their band matrices.
  template <class F>
  void forTerms(F&& f) const
  {
    for (const std::vector<ContactTerm>* terms : terms_)
      for (std::size_t k = 0; terms && k < terms->size(); ++k)
        if (const ContactTerm& term = (*terms)[k]; !isOwn(term) || points[term.point[0]].chain->coupled)
          f(term);
  }
  template <class F>
  void forRows(F&& f) const
  {
    for (std::size_t k = 0; rows_ && k < rows_->size(); ++k)
      if (const ContactRow& row = (*rows_)[k]; points[row.point[0]].chain->coupled)
        f(row);
  }
  /// Evaluates a chain. Those with band matrices are factored, with their contacts.
  void evaluate(Chain& chain, bool with_hessian, const HessianShift& shift);
  /// Adds up what evaluate() found of all chains.
  void addEvaluations(RodEvaluation& sum) const;
  /// Of the chains in the matrix, when their gradients are complete.
  void closeGradients();
  /// Largest displacement of one of these contacts by the chains' directions [m].
  double largestMove(const std::vector<ContactTerm>& terms) const;
  void addForce(const ContactTerm& term);   ///< to the gradients of the chains

  // ---- the matrix
  bool patternValid() const { return valid_; }
  void invalidatePattern() { valid_ = false; }
  /// Room for contacts that the pattern has: keys, sorted.
  const std::vector<Key>& room() const { return keys_; }
  /// Numbers the unknowns of chains with `coupled` set, and so many others behind them, and notes the chains' entries.
  void beginPattern(int others);
  void endPattern();
  int others() const { return others_; }   ///< number of the first unknown behind those of the chains
  /// Of four points; kPrescribed: prescribed, less: the owner maps its unknowns.
  CouplingMatrix::Bases basesOf(const int (&point)[4]) const;
  /// Clears the values and adds those of the chains.
  void assemble(const HessianShift& shift);
  /// CouplingMatrix::factor() with the contacts that there are.
  template <class Assemble>
  bool factor(Assemble&& assemble)
  {
    return exact ? matrix.factorExactly(assemble) : matrix.factor(terms_[0] && !terms_[0]->empty(), assemble);
  }
  void takeGradients();   ///< right-hand side := minus the gradients of the coupled chains
  /// Direction of a coupled chain := the solution; zero where the owner maps unknowns.
  void spread(Chain& chain) const;

private:
  bool isOwn(const ContactTerm& term) const { return !exact && term.solid >= 0 && !solid_moves[term.solid]; }
  void makeRoom(const ContactTerm& term);
  template <class F>
  static void forPanels(const Chain& chain, F&& f);

  bool valid_ = false;
  int others_ = 0;
  std::vector<Key> keys_, keys_before_;
  std::array<const std::vector<ContactTerm>*, 2> terms_{};
  const std::vector<ContactRow>* rows_ = nullptr;
};

}   // namespace slender
