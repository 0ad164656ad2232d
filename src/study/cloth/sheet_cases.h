#pragma once

#include <string>
#include <vector>

#include "cloth_cases.h"
#include "slender_sim/world/world.h"
#include "slender_sim/study/study.h"

/// Square or rectangular sheets run with one bending model or another, all else equal, and what sets their shapes
/// apart.
namespace slender::study {

struct SheetScene
{
  std::string name;
  TriangleMesh mesh;           ///< gridMesh() of a right-angled pattern, not moved
  int columns = 0, rows = 0;   ///< its cells
  Eigen::Matrix3Xd start;      ///< 3 x n [m]
  ClothModel model;            ///< of this mesh; its bending model is replaced
  ContactProperties contact;
  std::vector<Obstacle> solids;   ///< at the identity pose
  std::vector<int> pins;
  Eigen::Vector3d gravity{0, 0, -9.81}, wind{0, 0, 0};
  double step = 5e-3, duration = 2.0, keep_from = 0.0, keep_every = 0.1;   ///< [s]
};

struct SheetRun
{
  std::vector<Eigen::Matrix3Xd> frames;   ///< kept states, the last one at the end
  std::vector<Eigen::Vector3d> corner;    ///< the vertex farthest from the first one, after each step from keep_from on
  double seconds_per_step = 0;            ///< CPU time, collisions included
  double cloth_seconds = 0;               ///< CPU time per step of the cloth's own, without collisions
  double speed = 0;                       ///< RMS at the end [m/s]
  std::size_t intersections = 0;          ///< at the end
};

/// `shake`: the start is shifted by random numbers up to this size [m]. Throws std::runtime_error when a step is
/// refused.
SheetRun runSheet(StudyContext& context, const SheetScene& scene, BendingModel bending, double shake);

/// Shares of the variance of mean curvature by wavelength on the sheet, in bands of half an octave from the shortest
/// resolved one on.
struct Spectrum
{
  std::vector<double> wavelength, share;   ///< [m] (geometric mean of the band), [-] (sum 1)
  double mean() const;                     ///< geometric mean wavelength [m]
};
/// Of the mean over all frames. From the discrete cosine transform of mean curvature at the grid's inner vertices.
Spectrum wrinkles(const SheetScene& scene, const std::vector<Eigen::Matrix3Xd>& frames);
/// Half the sum of absolute differences of shares: 0 the same, 1 nothing in common.
double distance(const Spectrum& a, const Spectrum& b);

struct ShapeDifference
{
  double rms, most;   ///< of the vertices' distances, over the sheet's longer side
};
ShapeDifference difference(const SheetScene& scene, const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b);

}   // namespace slender::study
