#pragma once

#include <memory>
#include <vector>

#include "island/part.h"
#include "slender_sim/dynamics/chain_system.h"

namespace slender {

/// A chain of nodes as a part of an island. Its own matrix is a band. What rods and threads do in different ways is
/// left to the classes that derive from this one.
class ChainPart : public Part
{
public:
  explicit ChainPart(ChainSystem& system) : system_(system) {}

  int unknowns() const override { return unknowns_; }

  void moveAlong(double alpha) override { system_.moveAlong(alpha); }
  void accept() override { system_.accept(); }
  void saveBase() override { system_.saveBase(); }
  void restoreBase() override { system_.restoreBase(); }
  void retreat(double share) override;

  void evaluate(bool with_hessian, const HessianShift& shift) override;
  void closeGradient() override { system_.closeGradient(); }
  void solve() override { system_.solve(); }
  void solveAgain() override { system_.solveAgain(); }
  AverageConstraints* averages() override { return averages_.get(); }
  void meetAverages() override;

  void notePattern(SharedMatrix& matrix) override;
  void findEntries(const SharedMatrix& matrix) override;
  void addHessian(SharedMatrix& matrix, const HessianShift& shift) override;
  void takeGradient(double* right) const override;
  void takeDirection(const double* solution) override;

  void gatherTurns(Eigen::VectorXd& turns) const override;
  int base(int point) const override;
  void addColumns(int point, int component, double weight, Columns& row) const override;
  void addForce(int point, const Eigen::Vector3d& force) override;
  void addTorque(int point, double torque) override;
  Eigen::Vector3d move(int point) const override;
  double moveTurn(int point) const override;

  double stepLimit() const override { return system_.stepLimit(); }
  double incrementSize(double) const override { return system_.incrementSize(); }
  double slope() const override { return system_.slope(); }
  double residual() const override { return system_.residual(); }
  double forceScale() const override;
  double noiseLevel() const override { return system_.noiseLevel(); }

protected:
  /// The node of the chain that is a surface point; less than 0: the point is no unknown of the chain.
  virtual int nodeOf(int point) const = 0;
  /// Numbers the unknowns whose entry in dof_ is 0, one after the other.
  void numberFree();

  ChainSystem& system_;
  std::unique_ptr<AverageConstraints> averages_;   ///< null: no averages are prescribed
  /// Per unknown of the chain, four per node: its number within the part, kPrescribed, or less where something else
  /// carries it.
  std::vector<int> dof_;
  bool touched_ = false;   ///< by anything since the stage began

private:
  template <class F>
  void forPanels(F&& f) const;
  void addToPanels(const int (&point)[4], const double (&weight)[4], const Eigen::Matrix3d& stiffness,
                   const Eigen::Vector3d& column = Eigen::Vector3d::Zero());

  int unknowns_ = 0;
  /// For every place of the panels: the index of its entry among the values of the island's matrix. -1: the place has
  /// no entry.
  std::vector<int> entries_;
};

}   // namespace slender
