#include <algorithm>
#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "contact/sheet_candidates.h"
#include "slender_sim/contact/distance.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "test/support/contact.h"

namespace slender::test {
namespace {

using Piece = std::array<int, 3>;   // 1 for edges, and two numbers

std::vector<Piece> namesOf(const std::vector<SheetCandidates::Pair>& pairs)
{
  std::vector<Piece> names;
  for (const SheetCandidates::Pair& p : pairs)
    names.push_back({p.edges, p.first, p.second});
  std::sort(names.begin(), names.end());
  return names;
}

/// All pairs within the gap at x, by looking at each.
std::vector<Piece> nearPairs(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x)
{
  std::vector<Piece> names;
  const int edges = static_cast<int>(pieces.edges.size()), points = static_cast<int>(pieces.points.size());
  for (int i = 0; i < edges; ++i)
    for (int j = i + 1; j < edges; ++j)
    {
      const SheetPieces::Edge &e = pieces.edges[i], &f = pieces.edges[j];
      if (e.a != f.a && e.a != f.b && e.b != f.a && e.b != f.b &&
          segmentDistance(x.col(e.a), x.col(e.b), x.col(f.a), x.col(f.b)) < e.radius + f.radius + kContactGap)
        names.push_back({1, i, j});
    }
  for (int i = 0; i < points; ++i)
    for (int t = 0; t < pieces.triangles; ++t)
    {
      const auto& c = surface.triangles[t].corner;
      const int p = pieces.points[i].point;
      if (p != c[0] && p != c[1] && p != c[2] &&
          pointTriangleDistance(x.col(p), x.col(c[0]), x.col(c[1]), x.col(c[2])) <
              pieces.points[i].radius + surface.triangles[t].half_thickness + kContactGap)
        names.push_back({0, i, t});
    }
  std::sort(names.begin(), names.end());
  return names;
}

/// One object looks for the candidates of many motions in turn. In each it finds the same pairs as a new object, and
/// all pairs that are near. In some motions a few points leave their skins, in some all points do, and in some none.
TEST(SheetCandidates, ForgetNothingWhileTheListOfNeighboursIsKept)
{
  Random random(5);
  ContactSurface surface;
  Eigen::Matrix3Xd x;
  const TriangleMesh grid = gridMesh(0.6, 0.6, 6, 6, GridPattern::alternating);
  for (const double height : {0.0, 0.06})
    addSheet(surface, x, grid.vertices.colwise() + Eigen::Vector3d(0, 0, height), grid.triangles, 0.02);
  SheetPieces pieces;
  pieces.build(surface);
  const std::vector<double> none;
  const std::vector<Pose> no_solids;
  SheetCandidates kept;
  std::size_t near = 0;
  for (int k = 0; k < 100; ++k)
  {
    const double size = std::array{0.001, 0.003, 0.01, 0.05}[k % 4];
    const Eigen::Vector3d drift = 0.3 * random.direction();
    Eigen::Matrix3Xd x_end = x.colwise() + drift;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      if (k % 3 == 0 || i % 40 == k % 40)
        x_end.col(i) += size * random.direction();
    const SurfaceMotion motion{x, x_end, no_solids, no_solids};
    const SheetCandidates::Slack slack{kContactGap, 0.4 * kContactGap, none, none};
    kept.build(surface, pieces, {}, motion, slack);
    SheetCandidates anew;
    anew.build(surface, pieces, {}, motion, slack);
    const std::vector<Piece> names = namesOf(kept.pairs());
    EXPECT_EQ(names, namesOf(anew.pairs())) << k;
    for (const double share : {0.0, 0.5, 1.0})
    {
      const std::vector<Piece> wanted = nearPairs(surface, pieces, x + share * (x_end - x));
      near += wanted.size();
      EXPECT_TRUE(std::includes(names.begin(), names.end(), wanted.begin(), wanted.end())) << k << ", " << share;
    }
    x = x_end;
  }
  EXPECT_GT(near, 1000u);   // Without near pairs the check would prove nothing.
}

}   // namespace
}   // namespace slender::test
