#pragma once

#include <vector>

#include <Eigen/Core>

namespace slender {

struct ClusteringOptions
{
  int regions = 16;
  double compactness = 0.5;   ///< mu in [0, 1]: 1 compact regions, 0 flat ones
  int sampled_frames = 20;    ///< at most so many, chosen at random: the supremum over time is taken over these
  int max_iterations = 100;
  /// of the first proxies and of the choice of frames; the same seed gives the same regions everywhere
  unsigned seed = 1;
};

struct Clustering
{
  std::vector<int> region;   ///< of each face, 0 ... regions - 1; regions are connected
  int iterations = 0;
  bool settled = false;      ///< the last iteration changed nothing (Lloyd's may also go round in circles)
  double distortion = 0.0;   ///< sum of E(face, its proxy)
  std::vector<int> frames;   ///< sampled, ascending
};

/// Partitions the faces of an animated mesh into regions that are compact and flat in all frames (thesis 6.4.1, after
/// Cohen-Steiner, Alliez, Desbrun: Variational Shape Approximation, SIGGRAPH 2004, 3.3), by
///   E(T_j, P_k) = max over frames of A_j (mu / A |x_j - x_k|^2 + (1 - mu) |n_j - n_k|^2)
/// with centroids x, unit normals n, areas A_j of the faces and A of the mesh. Of the iterations the one with the least
/// distortion is returned. One frame: a partition of a mesh at rest. Throws std::invalid_argument: no frames, frames of
/// different sizes or not finite, options out of range, fewer faces or more connected parts than regions.
Clustering clusterFaces(const Eigen::Matrix3Xi& triangles, const std::vector<Eigen::Matrix3Xd>& frames,
                        const ClusteringOptions& options);

}   // namespace slender
