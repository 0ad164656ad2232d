#include <stdexcept>

#include <gtest/gtest.h>

#include "slender_sim/geometry/mesh_defects.h"
#include "slender_sim/study/study.h"
#include "study/tracking/biped.h"
#include "study/tracking/region_cases.h"
#include "study/tracking/guided_cloth.h"

using namespace slender;
using namespace slender::study;

namespace {

double metricOf(const char* name, const std::string& key)
{
  const Study* study = findStudy(name);
  if (!study)
    throw std::out_of_range(name);
  StudyContext context(study->name, true, false);
  study->run(context);
  for (const auto& m : context.metrics())
    if (m.first == key)
      return m.second;
  throw std::out_of_range(key);
}

}   // namespace

TEST(TrackingStudies, AveragesDoNotTug)
{
  EXPECT_GE(metricOf("rubber_band", "tugging_ratio"), 3.0);
  EXPECT_GE(metricOf("breathing_surface", "tugging_ratio"), 3.0);
}

TEST(TrackingStudies, SeamsAreAtJoints) { EXPECT_GE(metricOf("clustering", "seams_at_joints_gain"), 1.3); }

TEST(TrackingStudies, BipedIsClosedAndWalks)
{
  const Biped biped;
  const TriangleMesh& mesh = biped.mesh();
  EXPECT_NO_THROW(requireSoundMesh(mesh, "biped"));
  EXPECT_EQ(mesh.vertices.cols() - mesh.triangles.cols() / 2, 2);   // closed: V - F / 2 = 2 for a sphere
  EXPECT_LT((biped.at(0.0) - mesh.vertices).cwiseAbs().maxCoeff(), 1e-12);
  double volume = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k)
      corners.col(k) = mesh.vertices.col(mesh.triangles(k, f));
    volume += corners.determinant() / 6.0;
  }
  EXPECT_GT(volume, 0.03);   // faces outwards
  const double t = 2.0;
  const Eigen::Matrix3Xd a = biped.at(t), b = biped.at(t + Biped::kPeriod);
  EXPECT_NEAR((b - a).row(0).mean(), 0.98 * Biped::kPeriod, 1e-9);
  EXPECT_LT((b - a).bottomRows<2>().cwiseAbs().maxCoeff(), 1e-9);
}

TEST(TrackingStudies, HuesTellRegionsApart)
{
  const TriangleMesh mesh = gridMesh(1, 1, 6, 6, GridPattern::alternating);
  std::vector<int> region;
  for (int f = 0; f < mesh.triangles.cols(); ++f)
    region.push_back((f / 4) % 3 + 3 * (f / 24));   // patches of two cells by two
  const Eigen::VectorXi hues = huesOf(mesh.triangles, region);
  for (int f = 0; f < mesh.triangles.cols(); ++f)
    for (int g = 0; g < mesh.triangles.cols(); ++g)
      for (const int v : mesh.triangles.col(f))
        if ((mesh.triangles.col(g).array() == v).any())
          EXPECT_EQ(hues[f] == hues[g], region[f] == region[g]);
}

TEST(TrackingStudies, FineScaleLeavesOutWhatTheGuideHas)
{
  GuidedCloth c;
  c.guide = guideSheet(0.4, 2, 0.0);
  c.fine = subdivide(c.guide, 2);
  c.functions = subdivisionBasis(c.fine);
  c.model = buildCloth("sheet", c.fine.mesh, 0.5, isotropicMembrane(1e5, 0.3, 1e-3));
  const FineScale fine(c);
  const Eigen::Matrix3Xd coarse = Eigen::Matrix3Xd::Random(3, c.guide.vertices.cols()) * c.fine.weights.transpose();
  EXPECT_LT(fine.of(coarse).cwiseAbs().maxCoeff(), 1e-12);
  Eigen::Matrix3Xd bump = coarse;
  bump(2, bump.cols() - 1) += 1.0;
  EXPECT_GT(fine.kineticEnergy(bump),
            0.1 * 0.5 * 0.5 * hatMassMatrix(c.fine.mesh).coeff(bump.cols() - 1, bump.cols() - 1));
}
