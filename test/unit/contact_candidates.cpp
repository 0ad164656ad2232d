#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "contact/candidates.h"
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

/// Numbers of the segments of different curves that are within the gap of each other, by looking at each pair.
std::vector<std::array<int, 2>> nearSegments(const ContactSurface& surface, const Eigen::Matrix3Xd& x)
{
  std::vector<std::array<int, 2>> names;
  const int segments = static_cast<int>(surface.segments.size());
  for (int i = 0; i < segments; ++i)
    for (int j = i + 1; j < segments; ++j)
    {
      const ContactSegment &a = surface.segments[i], &b = surface.segments[j];
      if (a.object != b.object &&
          segmentDistance(x.col(a.a), x.col(a.b), x.col(b.a), x.col(b.b)) < a.radius + b.radius + kContactGap)
        names.push_back({i, j});
    }
  return names;
}

/// Numbers of solid, segment and piece, likewise.
std::vector<Piece> nearPieces(const ContactSurface& surface, const std::vector<SolidPieces>& solids,
                              const Eigen::Matrix3Xd& x, const std::vector<Pose>& poses)
{
  std::vector<Piece> names;
  for (int k = 0; k < static_cast<int>(solids.size()); ++k)
    for (int i = 0; i < static_cast<int>(surface.segments.size()); ++i)
    {
      const ContactSegment& s = surface.segments[i];
      const Pose to_solid = poses[k].inverse();
      const Eigen::Vector3d from = to_solid * Eigen::Vector3d(x.col(s.a)), to = to_solid * Eigen::Vector3d(x.col(s.b));
      for (int piece = 0; piece < static_cast<int>(solids[k].pieces.size()); ++piece)
        if (segmentPieceDistance(solids[k].pieces[piece], from, to).distance < s.radius + kContactGap)
          names.push_back({k, i, piece});
    }
  return names;
}

/// Sixty short curves at random places.
ContactSurface heapOfCurves(Random& random, Eigen::Matrix3Xd& x)
{
  ContactSurface surface;
  for (int k = 0; k < 60; ++k)
  {
    Eigen::Matrix3Xd nodes(3, 4);
    nodes.col(0) = random.vector(0.4);
    for (int i = 1; i < 4; ++i)
      nodes.col(i) = nodes.col(i - 1) + 0.05 * random.direction();
    addCurve(surface, x, nodes, 0.01);
  }
  return surface;
}

/// In each motion a few curves go elsewhere, among others, a ball and a mesh. Candidates that follow hold all pairs
/// that are near, in the order in which build() lists them.
TEST(Candidates, HoldAllNearPairsWhenAFewPointsLeaveTheirBoxes)
{
  Random random(7);
  Eigen::Matrix3Xd x;
  ContactSurface surface = heapOfCurves(random, x);
  const TriangleMesh mesh = gridMesh(0.3, 0.3, 2, 2, GridPattern::alternating);
  surface.solids.push_back({Sphere{0.1}, -1.0, {}});
  surface.solids.push_back({std::make_shared<TriangleMesh>(mesh), -1.0, {}});
  std::vector<SolidPieces> solids(2);
  solids[0].pieces = {Sphere{0.1}};
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t)
  {
    const Eigen::Vector3i c = mesh.triangles.col(t);
    solids[1].pieces.push_back(Triangle{mesh.vertices.col(c[0]), mesh.vertices.col(c[1]), mesh.vertices.col(c[2])});
  }
  solids[1].tree.emplace_back(mesh);
  std::vector<Pose> poses(2);
  poses[0].position = {0.2, 0.1, 0.0};
  for (std::size_t k = 0; k < solids.size(); ++k)
    solids[k].reach = boundingRadius(surface.solids[k].shape);
  const std::vector<double> margins(x.cols(), kContactGap);
  const Candidates::Range range{kContactGap, kContactGap, margins, 10.0 * kContactGap, 0.02, 2};
  Candidates candidates;
  std::size_t followed = 0, near = 0, near_solids = 0;
  for (int k = 0; k < 200; ++k)
  {
    Eigen::Matrix3Xd x_end = x;
    for (int curve = k % 13; curve < 60; curve += 13)
      x_end.middleCols(4 * curve, 4).colwise() += random.vector(0.4) - x.col(4 * curve);
    const SurfaceMotion motion{x, x_end, poses, poses};
    const bool follows = candidates.follow(surface, solids, motion, range);
    followed += follows;
    if (!follows)
      candidates.build(surface, {}, solids, motion, range);
    std::vector<std::array<int, 2>> pairs;
    std::vector<Piece> on_solids;
    for (const GridPairs::Pair& p : candidates.pairs())
      pairs.push_back({p.first, p.second});
    for (const Candidates::OnSolid& on : candidates.onSolids())
      on_solids.push_back({on.solid, on.segment, on.piece});
    EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
    EXPECT_TRUE(std::is_sorted(on_solids.begin(), on_solids.end(), [](const Piece& a, const Piece& b) {
      return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1];
    }));
    std::sort(on_solids.begin(), on_solids.end());
    for (const double share : {0.0, 0.3, 1.0})
    {
      const Eigen::Matrix3Xd at = x + share * (x_end - x);
      const auto segments = nearSegments(surface, at);
      const auto pieces = nearPieces(surface, solids, at, poses);
      EXPECT_TRUE(std::includes(pairs.begin(), pairs.end(), segments.begin(), segments.end())) << k << ", " << share;
      EXPECT_TRUE(std::includes(on_solids.begin(), on_solids.end(), pieces.begin(), pieces.end())) << k;
      near += segments.size();
      near_solids += pieces.size();
    }
    x = x_end;
  }
  EXPECT_GT(followed, 100u);   // All others meet too many pairs on their way, and build() finds them.
  EXPECT_GT(near, 1000u);
  EXPECT_GT(near_solids, 1000u);
}

}   // namespace
}   // namespace slender::test
