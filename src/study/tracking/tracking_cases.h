#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "study/cloth/cloth_cases.h"
#include "slender_sim/tracking/weak_constraints.h"

/// Tracked cloths of the sizes of the thesis's examples (6.5), meshes and motions made here.
namespace slender::study {

struct TrackedCase
{
  std::string name, section;   ///< of the thesis
  TriangleMesh guide;
  Subdivision tracked;
  std::shared_ptr<const WeakConstraints> constraints;
  std::shared_ptr<ClothModel> model;                     ///< with the averages
  std::function<Eigen::Matrix3Xd(double time)> motion;   ///< of the guide's vertices [m], time in seconds
  Eigen::Vector3d gravity{0, 0, -9.81}, wind{0, 0, 0};
  double published_tracked = 0, published_free = 0;   ///< table 6.1 [s] per frame, with and without tracking

  /// On the guide at rest, moving with it.
  ClothState start() const;
};

/// The four rows of table 6.1: a sheet, a box, a bag, a figure with four limbs.
std::vector<TrackedCase> thesisCases();

/// A surface whose guide, cells x cells, expands and contracts rapidly (6.4).
TrackedCase breathingSurface(int cells = 4, int subdivisions = 3);

}   // namespace slender::study
