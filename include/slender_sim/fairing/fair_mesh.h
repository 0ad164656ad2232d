#pragma once

#include <functional>
#include <string>
#include <vector>

#include "slender_sim/fairing/hole_filling.h"
#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// What is to be done to a mesh: closing holes comes first.
struct FairingOptions
{
  struct Ball
  {
    Eigen::Vector3d middle{0, 0, 0};
    double radius = 0.0;   ///< [m] > 0
  };
  bool fill_holes = false;
  long largest_hole = kLongestHole;   ///< boundaries of more edges stay open
  double edge_length = 0.0;           ///< of patches [m]; 0: that around each hole
  long steps = 0;                     ///< of the Willmore flow
  /// length [m]: a step halves bumps of wavelength 2 pi times it, longer ones less. 0: the mean edge length, otherwise
  /// from a thousandth of that to a thousand times it
  double smoothing = 0.0;
  std::vector<Ball> region;   ///< only vertices in one of them flow; empty: all
};

struct FairingSummary
{
  bool ok = true;
  std::string message;   ///< empty when ok; otherwise the reason and what to change
  int holes = 0, open_holes = 0, patch_vertices = 0;
  int steps = 0, cuts = 0;   ///< of the flow, and how often one was halved
  /// the flow ended before its last step: nothing is left that the energy would notice
  bool stationary = false;
  double energy_before = 0.0, energy = 0.0;   ///< 1/2 int H^2 of what flows, before and after [-]
};

/// Called with what is being done ("hole", "step"), how many are done, and of how many.
using FairingProgress = std::function<void(const char* what, std::size_t done, std::size_t total)>;

/// Closes a mesh's holes and smooths it (fillHole, WillmoreFlow). Where it fails the summary says why and the mesh is
/// untouched. Throws std::invalid_argument for options that are not valid and "NAME: ..." for a mesh with defects
/// (requireSoundMesh).
FairingSummary fairMesh(TriangleMesh& mesh, const std::string& name, const FairingOptions& options,
                        const FairingProgress& progress = {});

}   // namespace slender
