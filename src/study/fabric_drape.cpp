// Drape coefficient of fabrics by Cusick's method (ISO 9073-9: a disc of 30 cm on a support of 18 cm), and the droop of their strips.
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

#include "cloth_cases.h"
#include "slender_sim/contact/intersection.h"
#include "slender_sim/study/reference.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846, kGravity = 9.81;
constexpr double kDisc = 0.15, kSupport = 0.09;   // radii [m]

struct Fabric
{
  const char* name;
  double area_density;       ///< [kg/m^2]
  double bending;            ///< rigidity B, mean of warp and weft [N m]
  double shear;              ///< G [N/m]
  double least, most;        ///< published drape coefficients
  const char* source;
};

constexpr Fabric kFabrics[] = {
  {"silk", 0.065, 0.9e-6, 17, 0.20, 0.40, "x"},
  {"cotton", 0.13, 7e-6, 56, 0.60, 0.76, "x"},
  {"wool", 0.22, 8e-6, 50, 0.40, 0.70, "x"},
  {"denim", 0.40, 4e-5, 150, 0.70, 0.90, "x"},
};

/// A disc in rings of nearly equilateral triangles, `free_rings` of them outside the support, vertices shifted at random. The clamped
/// section is the middle of the cells within the last pinned ring.
struct Disc
{
  TriangleMesh mesh;
  std::vector<int> pinned;
};

Disc drapeDisc(int free_rings)
{
  const double h = (kDisc - kSupport) / (free_rings + 0.5), pinned = kSupport + 0.5 * h;
  const int inner = static_cast<int>(std::lround(pinned / h)), rings = inner + free_rings;
  Disc disc;
  disc.mesh = discMesh(rings, rings);   // ring k at radius k
  std::mt19937 random(7);
  std::uniform_real_distribution<double> shift(-0.15 * h, 0.15 * h);
  for (Eigen::Index i = 0; i < disc.mesh.vertices.cols(); ++i)
  {
    Eigen::Ref<Eigen::Vector3d> x = disc.mesh.vertices.col(i);
    const double ring = x.norm(), radius = ring < inner + 0.5 ? ring * pinned / inner : kDisc - (rings - ring) * h;
    if (ring > 0)
      x *= radius / ring;
    if (ring < inner + 0.5)
      disc.pinned.push_back(static_cast<int>(i));
    else if (ring < rings - 0.5)
      x.head<2>() += Eigen::Vector2d(shift(random), shift(random));
  }
  return disc;
}

/// Of the draped disc's shadow, seen from above: (shadow - support) / (disc - support).
double drapeCoefficient(const TriangleMesh& mesh, const Eigen::Matrix3Xd& x)
{
  constexpr int kPixels = 1200;
  constexpr double kPixel = 2.1 * kDisc / kPixels;
  std::vector<char> dark(kPixels * kPixels, 0);
  const auto middle = [](int k) { return (k + 0.5) * kPixel - 1.05 * kDisc; };
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    Eigen::Matrix<double, 2, 3> p;
    for (int k = 0; k < 3; ++k)
      p.col(k) = x.col(mesh.triangles(k, f)).head<2>();
    const auto pixel = [](double a) { return std::clamp(static_cast<int>((a + 1.05 * kDisc) / kPixel), 0, kPixels - 1); };
    const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
    for (int i = pixel(p.row(0).minCoeff()); i <= pixel(p.row(0).maxCoeff()); ++i)
      for (int j = pixel(p.row(1).minCoeff()); j <= pixel(p.row(1).maxCoeff()); ++j)
      {
        const Eigen::Vector2d at(middle(i), middle(j));
        bool left = true, right = true;
        for (int k = 0; k < 3; ++k)
        {
          const double side = cross(p.col((k + 1) % 3) - p.col(k), at - p.col(k));
          left = left && side >= 0;
          right = right && side <= 0;
        }
        dark[i * kPixels + j] |= left || right;
      }
  }
  double shadow = 0;
  for (int i = 0; i < kPixels; ++i)
    for (int j = 0; j < kPixels; ++j)
      shadow += dark[i * kPixels + j] || middle(i) * middle(i) + middle(j) * middle(j) < kSupport * kSupport;
  const double support = kPi * kSupport * kSupport;
  return (shadow * kPixel * kPixel - support) / (kPi * kDisc * kDisc - support);
}

/// Waves of the edge: maxima of its distance from the axis.
int folds(const Eigen::Matrix3Xd& x, const MeshTopology& topology)
{
  const std::vector<int>& edge = topology.boundaries.at(0);
  const int n = static_cast<int>(edge.size());
  Eigen::VectorXd radius(n);
  for (int k = 0; k < n; ++k)
    radius[k] = x.col(edge[k]).head<2>().norm();
  int best = 0;
  double most = 0;
  for (int wave = 1; wave < 20; ++wave)   // the strongest Fourier component
  {
    double c = 0, s = 0;
    for (int k = 0; k < n; ++k)
    {
      c += radius[k] * std::cos(2 * kPi * wave * k / n);
      s += radius[k] * std::sin(2 * kPi * wave * k / n);
    }
    if (std::hypot(c, s) > most)
    {
      most = std::hypot(c, s);
      best = wave;
    }
  }
  return best;
}

struct Draped
{
  double coefficient = 0, speed = 0, ms_per_step = 0;
  int folds = 0;
  Eigen::Matrix3Xd x;
};

Draped drapeFabric(StudyContext& context, const Fabric& fabric, const Disc& disc, Integrator integrator, const std::string& label)
{
  constexpr double kTensile = 1000;   // [N/m]; its own weight strains the disc by less than 3e-4
  ClothModel model = buildCloth(fabric.name, disc.mesh, fabric.area_density, orthotropicMembrane(kTensile, kTensile, 0.0, fabric.shear));
  model.bending_modulus = fabric.bending;
  model.bending = getenv("HINGE") ? BendingModel::hinge : BendingModel::isometric_nonconforming;
  model.mass_damping = 8.0;
  ClothSetup cloth(std::move(model));
  cloth.pin(disc.pinned);
  cloth.inputs.gravity = Vector3d(0, 0, -kGravity);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> shift(-1e-4, 1e-4);   // some wave or other has to win
  for (Eigen::Index i = 0; i < cloth.state.x.cols(); ++i)
    if (!std::binary_search(disc.pinned.begin(), disc.pinned.end(), static_cast<int>(i)))
      cloth.state.x(2, i) += shift(random);
  ClothOptions options;
  options.integrator = integrator;
  options.one_newton_step = true;
  ClothStepper stepper(cloth.model, options);
  const bool is_explicit = integrator == Integrator::symplectic_euler;
  const double edge = (kDisc - kSupport) / 8;
  (void)edge;
  double h = 5e-3;
  if (is_explicit)   // a third of the time in which a wave crosses the shortest edge
  {
    double shortest = 1;
    const MeshTopology& t = cloth.model->topology;
    for (int e = 0; e < t.edgeCount(); ++e)
      shortest = std::min(shortest, (disc.mesh.vertices.col(t.edges(0, e)) - disc.mesh.vertices.col(t.edges(1, e))).norm());
    h = 0.33 * shortest / std::sqrt(kTensile / fabric.area_density);
  }
  const double end = 3.0;
  const int steps = static_cast<int>(std::ceil(end / h));
  const double start = threadSeconds();
  for (int k = 0; k < steps; ++k)
  {
    if (k % 100 == 0)
      context.progress(k, steps, label);
    const StepReport report = stepper.step(cloth.state, cloth.inputs, h);
    if (!report.ok)
      throw std::runtime_error(label + " refused: " + report.message);
  }
  Draped draped;
  draped.ms_per_step = 1e3 * (threadSeconds() - start) / steps;
  draped.x = cloth.state.x;
  draped.speed = cloth.state.v.colwise().norm().maxCoeff();
  draped.coefficient = drapeCoefficient(disc.mesh, draped.x);
  draped.folds = folds(draped.x, cloth.model->topology);
  return draped;
}

}  // namespace

void runFabricDrape(StudyContext& context)
{
  useOneBlasThread();
  SurfacePicture& picture = context.picture("fabric_drape", "Discs of 30 cm on a support of 18 cm");
  picture.view = {0.0, 1.0, -0.7};
  const int sizes[] = {8, context.quick() ? 12 : 14};
  for (const Fabric& fabric : kFabrics)
  {
    struct Case { int rings; Integrator integrator; };
    for (const Case& c : {Case{sizes[0], Integrator::implicit_euler}, Case{sizes[1], Integrator::implicit_euler}, Case{sizes[0], Integrator::symplectic_euler}})
    {
      const Disc disc = drapeDisc(c.rings);
      const Draped d = drapeFabric(context, fabric, disc, c.integrator, std::string(fabric.name) + ", " + toString(c.integrator));
      context.row().set("case", "drape").set("fabric", fabric.name).set("integrator", toString(c.integrator)).set("vertices", static_cast<double>(disc.mesh.vertices.cols()))
        .set("bending_length_mm", 1e3 * std::cbrt(fabric.bending / (kGravity * fabric.area_density)))
        .set("coefficient", d.coefficient).set("folds", d.folds).set("speed_left_mm_s", 1e3 * d.speed).set("ms_per_step", d.ms_per_step);
      if (c.rings == sizes[1])
        picture.panels.push_back({fabric.name, {{{d.x, disc.mesh.triangles}}}});
    }
  }
}

}  // namespace slender::study
