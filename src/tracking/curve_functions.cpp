#include "slender_sim/tracking/curve_functions.h"

#include <algorithm>
#include <cmath>

namespace slender {

namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

Eigen::Index nodesOf(const Eigen::VectorXd& shares, bool closed) { return shares.size() - (closed ? 1 : 0); }

}   // namespace

MassMatrix polylineWeights(const Eigen::VectorXd& guide, const Eigen::VectorXd& nodes, bool closed)
{
  const Eigen::Index guide_nodes = nodesOf(guide, closed), count = nodesOf(nodes, closed);
  Triplets entries;
  Eigen::Index k = 0;
  for (Eigen::Index i = 0; i < count; ++i)
  {
    while (k + 2 < guide.size() && guide[k + 1] <= nodes[i])
      ++k;
    const double length = guide[k + 1] - guide[k];
    const double after = length > 0 ? std::clamp((nodes[i] - guide[k]) / length, 0.0, 1.0) : 1.0;
    if (after < 1.0)
      entries.emplace_back(i, k, 1.0 - after);
    if (after > 0.0)
      entries.emplace_back(i, (k + 1) % guide_nodes, after);
  }
  MassMatrix weights(count, guide_nodes);
  weights.setFromTriplets(entries.begin(), entries.end());
  return weights;
}

TestFunctions curveHats(const MassMatrix& weights)
{
  TestFunctions functions;
  for (Eigen::Index k = 0; k < weights.cols(); ++k)
    functions.names.push_back("node " + std::to_string(k));
  functions.tracked = weights.transpose();
  return functions;
}

TestFunctions curveSegments(int count, const Eigen::VectorXd& nodes, bool closed)
{
  TestFunctions functions;
  for (int r = 0; r < count; ++r)
    functions.names.push_back("segment " + std::to_string(r));
  Triplets entries;
  for (Eigen::Index i = 0; i < nodesOf(nodes, closed); ++i)
  {
    const double at = nodes[i] * count;
    const int border = static_cast<int>(std::lround(at));
    // rounded sums of edge lengths
    const bool between = std::abs(at - border) < 1e-9 * count && (closed || (border > 0 && border < count));
    if (between && count > 1)
    {
      entries.emplace_back((border + count - 1) % count, i, 0.5);
      entries.emplace_back(border % count, i, 0.5);
    }
    else
      entries.emplace_back(std::clamp(static_cast<int>(at), 0, count - 1), i, 1.0);
  }
  functions.tracked.resize(count, nodesOf(nodes, closed));
  functions.tracked.setFromTriplets(entries.begin(), entries.end());
  return functions;
}

WeakConstraints curveConstraints(TestFunctions functions, const MassMatrix& weights, const Eigen::Matrix3Xd& rest,
                                 bool closed)
{
  const MassMatrix mass = hatMassMatrix(rest, closed);
  functions.guide = functions.tracked;
  return WeakConstraints(functions, mass * weights, mass);
}

}   // namespace slender
