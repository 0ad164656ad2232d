#include "tracking_cases.h"

#include <cmath>

#include <Eigen/Geometry>

#include "biped.h"
#include "study/framework/scene_cases.h"
#include "slender_sim/tracking/clustering.h"

namespace slender::study {

namespace {

constexpr double kPi = 3.14159265358979323846;

/// Eased from 0 to 1 between two times, with its speed zero at both.
double eased(double time, double from, double to)
{
  const double s = std::clamp((time - from) / (to - from), 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

TriangleMesh boxMesh(double side)
{
  TriangleMesh box;
  box.vertices.resize(3, 8);
  for (int k = 0; k < 8; ++k)
    box.vertices.col(k) = side * Eigen::Vector3d(k & 1, (k >> 1) & 1, (k >> 2) & 1);
  const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  box.triangles.resize(3, 12);
  for (int q = 0; q < 6; ++q)
  {
    box.triangles.col(2 * q) << quads[q][0], quads[q][1], quads[q][2];
    box.triangles.col(2 * q + 1) << quads[q][0], quads[q][2], quads[q][3];
  }
  return box;
}

void finish(TrackedCase& c, const TestFunctions& functions, double area_density, const MembraneModuli& membrane,
            double bending, double damping)
{
  c.constraints = std::make_shared<WeakConstraints>(functions, hatMassMatrix(c.guide), hatMassMatrix(c.tracked.mesh));
  c.constraints->requireIndependent({});
  c.model = std::make_shared<ClothModel>(buildCloth(c.name, c.tracked.mesh, area_density, membrane));
  c.model->bending = BendingModel::hinge;
  c.model->bending_modulus = bending;
  c.model->stiffness_damping = damping;
  c.model->averages = {{std::make_shared<Eigen::SparseMatrix<double, Eigen::RowMajor>>(c.constraints->matrix()), {}}};
}

/// A flying cloth, led by four painted regions, the quarters of the sheet.
TrackedCase flyingSheet()
{
  TrackedCase c;
  c.name = "sheet";
  c.section = "6.5.1";
  c.guide = gridMesh(1.5, 1.0, 6, 4, GridPattern::alternating);
  c.tracked = subdivide(c.guide, 3);
  std::vector<PaintedRegion> quarters;
  for (int q = 0; q < 4; ++q)
    quarters.push_back({"quarter" + std::to_string(q),
                        verticesWhere(c.guide,
                                      [q](const Eigen::Vector3d& x) {
                                        return ((q & 1) ? x.x() > 0.8 : x.x() < 0.7) &&
                                               ((q & 2) ? x.y() > 0.55 : x.y() < 0.45);
                                      }),
                        {}});
  finish(c, paintedRegions(quarters, c.tracked), 0.15, orthotropicMembrane(500, 500, 0.3, 190), 5e-5, 1e-3);
  c.motion = [rest = c.guide.vertices](double t) {
    Eigen::Matrix3Xd x = rest;
    const double flight = 1.5 * t;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      x.col(i) +=
          Eigen::Vector3d(flight, 0.1 * std::sin(2 * t),
                          0.5 * flight - 0.4 * t * t + 0.15 * std::sin(2 * rest(0, i) + 3 * rest(1, i) - 6 * t) -
                              0.15 * std::sin(2 * rest(0, i) + 3 * rest(1, i)));
    return x;
  };
  c.published_tracked = 17.7;
  c.published_free = 17.0;
  return c;
}

/// A box whose top is turned, raised and put back.
TrackedCase turnedBox()
{
  TrackedCase c;
  c.name = "box";
  c.section = "6.5.2";
  c.guide = boxMesh(0.5);
  c.tracked = subdivide(c.guide, 4);
  finish(c, subdivisionBasis(c.tracked), 0.3, isotropicMembrane(1e5, 0.3, 1e-3), 1e5 * 1e-9 / (12 * 0.91), 2e-3);
  c.motion = [rest = c.guide.vertices](double t) {
    Eigen::Matrix3Xd x = rest;
    const double angle = 1.2 * (eased(t, 0, 0.4) - 2 * eased(t, 0.5, 0.9) + eased(t, 1.0, 1.2));
    const Eigen::Vector3d middle(0.25, 0.25, 0.5);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      if (rest(2, i) > 0.25)
        x.col(i) = middle + Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * (rest.col(i) - middle) +
                   Eigen::Vector3d(0.1 * std::sin(5 * t), 0, 0.1 * (1 - std::cos(4 * t)));
    return x;
  };
  c.gravity.setZero();
  c.published_tracked = 15.8;
  c.published_free = 14.9;
  return c;
}

/// The bag of the scene backflip, whose guide meets itself.
TrackedCase flippedBag()
{
  TrackedCase c;
  c.name = "bag";
  c.section = "6.5.3";
  const SceneConfig scene = packageSceneConfig("backflip");
  const std::shared_ptr<const TrackingConfig> tracking = scene.cloths.front().tracking;
  c.guide = tracking->guide.mesh;
  c.tracked = subdivide(c.guide, 2);
  finish(c, subdivisionBasis(c.tracked), 0.2, isotropicMembrane(2e5, 0.3, 1e-3), 2e5 * 1e-9 / (12 * 0.91), 1e-3);
  c.motion = [tracking](double t) {
    Eigen::Matrix3Xd x;
    tracking->guide.evaluate(t, x);
    return x;
  };
  c.published_tracked = 16.1;
  c.published_free = 15.7;
  return c;
}

/// A walking figure in headwind.
TrackedCase walkingFigure()
{
  TrackedCase c;
  c.name = "figure";
  c.section = "6.5.4";
  const auto biped = std::make_shared<const Biped>();
  c.guide = biped->mesh();
  c.tracked = subdivide(c.guide, 0);
  c.motion = [biped](double t) { return biped->at(t); };
  std::vector<Eigen::Matrix3Xd> frames;
  for (int k = 0; k < 20; ++k)
    frames.push_back(c.motion(0.06 * k));
  ClusteringOptions options;
  options.regions = 280;
  const TestFunctions regions = regionBasis(c.guide, clusterFaces(c.guide.triangles, frames, options).region);
  finish(c, regions, 0.2, isotropicMembrane(2e5, 0.3, 1e-3), 2e5 * 1e-9 / (12 * 0.91), 1e-3);
  c.model->aerodynamics.drag = 1.2;
  c.wind = Eigen::Vector3d(-5, 0, 0);
  c.published_tracked = 43.2;
  c.published_free = 39.0;
  return c;
}

}   // namespace

TrackedCase breathingSurface(int cells, int subdivisions)
{
  TrackedCase c;
  c.name = "breathing surface";
  c.section = "6.4";
  c.guide = gridMesh(1.0, 1.0, cells, cells, GridPattern::alternating);
  c.tracked = subdivide(c.guide, subdivisions);
  finish(c, subdivisionBasis(c.tracked), 0.2, isotropicMembrane(3e4, 0.3, 1e-3), 3e4 * 1e-9 / (12 * 0.91), 1e-3);
  c.motion = [rest = c.guide.vertices](double t) {
    Eigen::Matrix3Xd x = rest;
    const double size = 1.0 + 0.25 * (1 - std::cos(12 * t));
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      x.col(i) =
          Eigen::Vector3d(0.5 + size * (rest(0, i) - 0.5), 0.5 + size * (rest(1, i) - 0.5),
                          0.1 * std::sin(12 * t) * std::cos(2 * kPi * rest(0, i)) * std::cos(2 * kPi * rest(1, i)));
    return x;
  };
  c.gravity.setZero();
  return c;
}

ClothState TrackedCase::start() const
{
  constexpr double kMoment = 1e-4;
  const Eigen::Matrix3Xd now = motion(0.0), next = motion(kMoment);
  ClothState state = makeClothState(*model, now * tracked.weights.transpose());
  state.v = (next - now) / kMoment * tracked.weights.transpose();
  return state;
}

std::vector<TrackedCase> thesisCases() { return {flyingSheet(), turnedBox(), flippedBag(), walkingFigure()}; }

}   // namespace slender::study
