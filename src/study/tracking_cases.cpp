#include "tracking_cases.h"

#include <array>
#include <cmath>
#include <map>

#include <Eigen/Geometry>

#include "slender_sim/geometry/mesh_topology.h"
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

void finish(TrackedCase& c, const TestFunctions& functions, double area_density, const MembraneModuli& membrane, double bending, double damping)
{
  c.constraints = std::make_shared<WeakConstraints>(functions, hatMassMatrix(c.guide), hatMassMatrix(c.tracked.mesh));
  c.constraints->requireIndependent({});
  c.model = std::make_shared<ClothModel>(buildCloth(c.name, c.tracked.mesh, area_density, membrane));
  c.model->bending = BendingModel::hinge;
  c.model->bending_modulus = bending;
  c.model->stiffness_damping = damping;
  c.model->averages = std::make_shared<Eigen::SparseMatrix<double, Eigen::RowMajor>>(c.constraints->matrix());
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
    quarters.push_back({"quarter" + std::to_string(q), verticesWhere(c.guide, [q](const Eigen::Vector3d& x) {
                          return ((q & 1) ? x.x() > 0.8 : x.x() < 0.7) && ((q & 2) ? x.y() > 0.55 : x.y() < 0.45);
                        }), {}});
  finish(c, paintedRegions(quarters, c.tracked), 0.15, orthotropicMembrane(500, 500, 0.3, 190), 5e-5, 1e-3);
  c.motion = [rest = c.guide.vertices](double t) {
    Eigen::Matrix3Xd x = rest;
    const double flight = 1.5 * t;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      x.col(i) += Eigen::Vector3d(flight, 0.1 * std::sin(2 * t), 0.5 * flight - 0.4 * t * t + 0.15 * std::sin(2 * rest(0, i) + 3 * rest(1, i) - 6 * t) -
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

/// A bag that crouches, jumps and turns over backwards.
TrackedCase jumpingBag()
{
  TrackedCase c;
  c.name = "bag";
  c.section = "6.5.3";
  c.guide = bagMesh();
  c.tracked = subdivide(c.guide, 2);
  finish(c, subdivisionBasis(c.tracked), 0.2, isotropicMembrane(2e5, 0.3, 1e-3), 2e5 * 1e-9 / (12 * 0.91), 1e-3);
  c.motion = [rest = c.guide.vertices](double t) {
    Eigen::Matrix3Xd x = rest;
    const double crouch = 0.3 * (eased(t, 0, 0.3) - eased(t, 0.3, 0.45)), height = 1.2 * eased(t, 0.35, 0.7) - 1.2 * eased(t, 0.7, 1.05);
    const double turn = 2 * kPi * eased(t, 0.4, 1.0), squeeze = 0.2 * std::sin(9 * t);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
    {
      const Eigen::Vector3d p((1 + squeeze * rest(2, i)) * rest(0, i), (1 - squeeze * rest(2, i)) * rest(1, i), (1 - crouch) * rest(2, i) - 0.3);
      x.col(i) = Eigen::AngleAxisd(-turn, Eigen::Vector3d::UnitX()) * p + Eigen::Vector3d(0, 0, 0.3 + height);
    }
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
  c.guide = figureMesh();
  c.tracked = subdivide(c.guide, 0);
  c.motion = [rest = c.guide.vertices](double t) {
    Eigen::Matrix3Xd x = rest;
    const double start = eased(t, 0, 0.3);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
    {
      // limbs swing in turns: each part by an angle that grows with its distance from the trunk, so that they bend
      const double beyond = std::max(0.0, std::abs(rest(2, i)) - 0.1);
      const double side = rest(0, i) / (0.05 + std::abs(rest(0, i))), limb = rest(2, i) > 0 ? -1.0 : 1.0;
      const double angle = 1.2 * start * side * limb * std::sin(2 * kPi * 0.9 * t) * beyond;
      x.col(i) = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()) * rest.col(i) + start * Eigen::Vector3d(0, -1.2 * t, 0.03 * std::sin(4 * kPi * 0.9 * t));
    }
    return x;
  };
  std::vector<Eigen::Matrix3Xd> frames;
  for (int k = 0; k < 20; ++k)
    frames.push_back(c.motion(0.06 * k));
  ClusteringOptions options;
  options.regions = 280;
  const TestFunctions regions = regionBasis(c.guide, clusterFaces(c.guide.triangles, frames, options).region);
  finish(c, regions, 0.2, isotropicMembrane(2e5, 0.3, 1e-3), 2e5 * 1e-9 / (12 * 0.91), 1e-3);
  c.model->aerodynamics.drag = 1.2;
  c.wind = Eigen::Vector3d(0, 5, 0);
  c.published_tracked = 43.2;
  c.published_free = 39.0;
  return c;
}

}  // namespace

TrackedCase breathingSurface()
{
  TrackedCase c;
  c.name = "breathing surface";
  c.section = "6.4";
  c.guide = gridMesh(1.0, 1.0, 4, 4, GridPattern::alternating);
  c.tracked = subdivide(c.guide, 3);
  finish(c, subdivisionBasis(c.tracked), 0.2, isotropicMembrane(3e4, 0.3, 1e-3), 3e4 * 1e-9 / (12 * 0.91), 1e-3);
  c.motion = [rest = c.guide.vertices](double t) {
    Eigen::Matrix3Xd x = rest;
    const double size = 1.0 + 0.25 * (1 - std::cos(12 * t));
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      x.col(i) = Eigen::Vector3d(0.5 + size * (rest(0, i) - 0.5), 0.5 + size * (rest(1, i) - 0.5),
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

TriangleMesh bagMesh()
{
  constexpr int kAround = 16, kRings = 5;
  constexpr double kRadius = 0.25, kHeight = 0.7;
  TriangleMesh bag;
  bag.vertices.resize(3, kAround * kRings + kAround / 2);
  std::vector<Eigen::Vector3i> faces;
  for (int ring = 0; ring < kRings; ++ring)
    for (int k = 0; k < kAround; ++k)
    {
      const double angle = 2 * kPi * k / kAround;
      bag.vertices.col(ring * kAround + k) = Eigen::Vector3d(kRadius * std::cos(angle), kRadius * std::sin(angle), kHeight * (1 - ring / (kRings - 1.0)));
      const int here = ring * kAround + k, beside = ring * kAround + (k + 1) % kAround;
      if (ring > 0)
      {
        faces.emplace_back(here, beside, here - kAround);
        faces.emplace_back(beside, beside - kAround, here - kAround);
      }
    }
  const int last = (kRings - 1) * kAround, bottom = kRings * kAround, half = kAround / 2;
  for (int k = 0; k < half; ++k)
  {
    const double angle = 2 * kPi * (2 * k + 0.5) / kAround;
    bag.vertices.col(bottom + k) = Eigen::Vector3d(0.5 * kRadius * std::cos(angle), 0.5 * kRadius * std::sin(angle), 0);
    const int a = last + 2 * k, b = last + 2 * k + 1, c = last + (2 * k + 2) % kAround, here = bottom + k, beside = bottom + (k + 1) % half;
    faces.emplace_back(here, b, a);
    faces.emplace_back(here, c, b);
    faces.emplace_back(here, beside, c);
    if (k > 1)
      faces.emplace_back(bottom, here, here - 1);
  }
  bag.triangles.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f)
    bag.triangles.col(static_cast<Eigen::Index>(f)) = faces[f];
  return bag;
}

/// Squares on the surface of a cross of cubes, smoothed and turned by 45 degrees: as many vertices as squares, and two.
TriangleMesh figureMesh()
{
  constexpr int kWide = 8, kThick = 6, kSmoothings = 6;
  constexpr int kArms[4] = {22, 22, 26, 27};   // +x, -x, +z, -z
  constexpr double kCell = 0.02;
  const auto inside = [&](int x, int y, int z) {
    const bool across = z >= 0 && z < kWide && x >= -kArms[1] && x < kWide + kArms[0], along = x >= 0 && x < kWide && z >= -kArms[3] && z < kWide + kArms[2];
    return y >= 0 && y < kThick && (across || along);
  };
  TriangleMesh mesh;
  std::map<std::array<int, 3>, int> index;
  std::vector<Eigen::Vector3i> faces;
  const auto vertex = [&](const std::array<int, 3>& at) { return index.emplace(at, static_cast<int>(index.size())).first->second; };
  for (int x = -kArms[1]; x < kWide + kArms[0]; ++x)
    for (int y = 0; y < kThick; ++y)
      for (int z = -kArms[3]; z < kWide + kArms[2]; ++z)
        for (int axis = 0; axis < 3 && inside(x, y, z); ++axis)
          for (const int side : {0, 1})
          {
            std::array<int, 3> next{x, y, z};
            next[axis] += side ? 1 : -1;
            if (inside(next[0], next[1], next[2]))
              continue;
            int corner[4];
            for (int k = 0; k < 4; ++k)
            {
              const bool u = k == 1 || k == 2, v = k >= 2;
              std::array<int, 3> at{x, y, z};
              at[axis] += side;
              at[(axis + 1) % 3] += side ? u : v;
              at[(axis + 2) % 3] += side ? v : u;
              corner[k] = vertex(at);
            }
            const int turn = (x + y + z) & 1;   // diagonals alternate
            faces.emplace_back(corner[turn], corner[turn + 1], corner[turn + 2]);
            faces.emplace_back(corner[turn], corner[turn + 2], corner[(turn + 3) % 4]);
          }
  mesh.vertices.resize(3, static_cast<Eigen::Index>(index.size()));
  for (const auto& [at, i] : index)
    mesh.vertices.col(i) = kCell * Eigen::Vector3d(at[0] - 0.5 * kWide, at[1] - 0.5 * kThick, at[2] - 0.5 * kWide);
  mesh.triangles.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f)
    mesh.triangles.col(static_cast<Eigen::Index>(f)) = faces[f];
  const MeshTopology topology = meshTopology(mesh);
  for (int pass = 0; pass < kSmoothings; ++pass)
  {
    Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
    Eigen::VectorXd count = Eigen::VectorXd::Zero(mesh.vertices.cols());
    for (Eigen::Index e = 0; e < topology.edges.cols(); ++e)
      for (const int end : {0, 1})
      {
        sum.col(topology.edges(end, e)) += mesh.vertices.col(topology.edges(1 - end, e));
        count[topology.edges(end, e)] += 1;
      }
    for (Eigen::Index i = 0; i < sum.cols(); ++i)
      mesh.vertices.col(i) = 0.5 * (mesh.vertices.col(i) + sum.col(i) / count[i]);
  }
  mesh.vertices = Eigen::AngleAxisd(0.25 * kPi, Eigen::Vector3d::UnitY()).toRotationMatrix() * mesh.vertices;
  return mesh;
}

std::vector<TrackedCase> thesisCases() { return {flyingSheet(), turnedBox(), jumpingBag(), walkingFigure()}; }

}  // namespace slender::study
