#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Cholesky>

#include "study/cloth/cloth_cases.h"
#include "slender_sim/geometry/mesh_subdivision.h"
#include "slender_sim/study/study.h"
#include "slender_sim/tracking/weak_constraints.h"

/// Cloths that follow a guide, in one way or another.
namespace slender::study {

enum class Follow
{
  nothing,    ///< free, from the same start
  averages,   ///< weak constraints
  points      ///< the vertices that the meshes share are held where the guide's are (subdivided meshes only)
};

struct GuidedCloth
{
  std::string name;
  Subdivision fine;     ///< of the guide's undeformed mesh
  TriangleMesh guide;   ///< undeformed
  TestFunctions functions;
  ClothModel model;                             ///< of fine.mesh
  std::function<Eigen::Matrix3Xd(double)> at;   ///< vertices of the guide [m] at a time [s]
  Eigen::Vector3d gravity{0, 0, 0}, wind{0, 0, 0};
  double step = 0.01;   ///< [s]
  bool one_newton_step = true;
  double linear_tolerance = ClothOptions().linear_tolerance;

  /// Without grasps: what the fine mesh's averages shall be.
  WeakConstraints constraints() const;
  /// The guide's velocity at a time, by central differences.
  Eigen::Matrix3Xd velocity(double t) const;
};

/// One way of following the guide, step by step.
class GuidedStepper
{
public:
  GuidedStepper(const GuidedCloth& c, Follow how);

  /// Goes to the next instant, at which the guide is at `guide` (default: where the case's is). On failure nothing
  /// changes.
  StepReport step();
  StepReport step(const Eigen::Matrix3Xd& guide);

  double time() const { return time_; }
  ClothSetup& cloth() { return cloth_; }
  ClothStepper& stepper() { return stepper_; }
  const WeakConstraints& constraints() const { return *constraints_; }
  /// Greatest distance of an average from the guide's, now [m].
  double error() const { return constraints_->error(constraints_->averages(guide_), cloth_.state.x); }
  double seconds() const { return seconds_; }   ///< CPU time of all steps

private:
  const GuidedCloth& case_;
  Follow how_;
  std::shared_ptr<const WeakConstraints> constraints_;
  ClothSetup cloth_;
  ClothStepper stepper_;
  Eigen::Matrix3Xd guide_;
  double time_ = 0, seconds_ = 0;
};

/// What a field on the fine mesh has below the scale of the guide: itself less its L2 projection onto the guide's hat
/// functions.
class FineScale
{
public:
  explicit FineScale(const GuidedCloth& c);
  Eigen::Matrix3Xd of(const Eigen::Matrix3Xd& field) const;
  /// Of velocities [m/s]: 1/2 integral of area density times square [J].
  double kineticEnergy(const Eigen::Matrix3Xd& velocities) const;

private:
  Eigen::SparseMatrix<double, Eigen::RowMajor> weights_;
  MassMatrix mass_;
  Eigen::LDLT<Eigen::MatrixXd> coarse_;
  double density_;   ///< [kg/m^2]
};

/// A square sheet in the plane z = `height` with its middle over the origin, as a guide of cells x cells.
TriangleMesh guideSheet(double side, int cells, double height);

}   // namespace slender::study
