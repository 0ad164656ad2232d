#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// What a tube is drawn around.
struct FramedLine
{
  bool closed = false;
  Eigen::Matrix3Xd x;                ///< per node [m]
  Eigen::Matrix3Xd d1;               ///< per edge, unit
  Eigen::Matrix2Xd semi_axes;        ///< per edge, along d1 and d2 [m]
  std::vector<double> values = {};   ///< per node, what its sections' `value` is taken from; empty: 0
};

/// Centre of a cross-section, and its semi-axes as vectors (u along d1) [m].
struct TubeSection
{
  Eigen::Vector3d x, u, w;
  double value = 0.0;
};

/// Sections through the nodes and, on cubic Hermite curves with three-point tangents, up to three between two; of lines
/// of more edges than `most`, through every second, third ... node. Semi-axes are averaged at the nodes and linear
/// between them. The last section of a closed line is the first one again.
std::vector<TubeSection> tubeSections(const FramedLine& line, int most);

/// Two triangles per side and section, facing outwards, section by section, then the caps of an open tube. Vertices:
/// `sides` per section (the first side's middle lies on u), of a closed one without the last, then the caps' middles.
/// Needs two sections, closed three, and three sides.
TriangleMesh tubeMesh(const std::vector<TubeSection>& sections, int sides, bool closed);

/// Unit normal of an ellipse at the corner before side `corner` of `sides`.
Eigen::Vector3d tubeNormal(const TubeSection& section, int corner, int sides);

}   // namespace slender
