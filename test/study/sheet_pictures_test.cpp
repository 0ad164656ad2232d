#include <cmath>
#include <sstream>

#include <gtest/gtest.h>

#include "study/cloth/sheet_cases.h"
#include "study/framework/surface_script.h"

using namespace slender;
using namespace slender::study;

namespace {

TriangleMesh triangleAt(double depth, double size)
{
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, size, 0, depth, depth, depth, 0, 0, size;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  return mesh;
}

}   // namespace

TEST(SurfaceScript, DrawsFarFacesFirst)
{
  SurfacePicture picture;
  picture.name = "two";
  picture.view = {0, 1, 0};
  for (const bool near_first : {true, false})
  {
    const SurfacePicture::Surface near_one{triangleAt(1.0, 1.0)}, far_one{triangleAt(5.0, 3.0)};
    picture.panels = {{"a \"label\"", near_first ? std::vector<SurfacePicture::Surface>{near_one, far_one}
                                                 : std::vector<SurfacePicture::Surface>{far_one, near_one}}};
    std::ostringstream out;
    writeSurfaceScript(out, picture, "two.png");
    const std::string text = out.str();
    EXPECT_NE(text.find("a \\\"label\\\""), std::string::npos);
    // The far one's corner is three times as far from the common one.
    std::istringstream facets(text.substr(text.find("EOD\n") + 4));
    double x[4], z, shade, y;
    for (double& at : x)
      facets >> at >> y >> z >> shade;
    const double first = std::abs(x[1] - x[0]);
    for (double& at : x)
      facets >> at >> y >> z >> shade;
    EXPECT_NEAR(first, 3.0 * std::abs(x[1] - x[0]), 1e-3);
  }
}

TEST(Wrinkles, FindTheWavelengthOfASine)
{
  SheetScene scene;
  scene.columns = 60;
  scene.rows = 40;
  scene.mesh = gridMesh(1.2, 0.8, scene.columns, scene.rows, GridPattern::alternating);
  const auto wave = [&](double length) {
    Eigen::Matrix3Xd x = scene.mesh.vertices;
    x.row(2) = 1e-3 * (x.row(0) * (2 * M_PI / length)).array().cos();
    return x;
  };
  for (const double length : {0.1, 0.2, 0.4})
  {
    const Spectrum spectrum = wrinkles(scene, {wave(length)});
    double sum = 0;
    for (const double share : spectrum.share)
      sum += share;
    EXPECT_NEAR(sum, 1.0, 1e-12);
    EXPECT_NEAR(spectrum.mean() / length, 1.0, 0.2);   // half an octave is 1.41
  }
  const Spectrum a = wrinkles(scene, {wave(0.1)}), b = wrinkles(scene, {wave(0.4)});
  EXPECT_EQ(distance(a, a), 0.0);
  EXPECT_GT(distance(a, b), 0.9);
  EXPECT_LE(distance(a, b), 1.0 + 1e-12);
}
