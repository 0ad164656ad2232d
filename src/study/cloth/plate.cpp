// Plates against plate theory: what a bending modulus D means for each bending model on each mesh.
#include <cmath>
#include <cstdio>

#include "cantilever_strip.h"
#include "plate_linear.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/energy/membrane_term.h"
#include "slender_sim/study/reference.h"
#include "slender_sim/study/study.h"

namespace slender::study {

namespace {

bool isConforming(BendingModel model) { return model == BendingModel::isometric_conforming; }

/// Hinges are an isotropic plate (Poisson's ratio -1/3) on equilateral triangles only; vertex-based bending on all
/// meshes.
bool isIsotropic(GridPattern pattern, BendingModel model)
{
  return isConforming(model) || pattern == GridPattern::equilateral;
}

const char* const kAnisotropic = "anisotropic on this mesh: no D in all directions";

std::string keyOf(const char* what, GridPattern pattern, BendingModel model)
{
  const char* name = model == BendingModel::hinge ? "hinge" : isConforming(model) ? "conforming" : "nonconforming";
  return std::string(what) + "_" + toString(pattern) + "_" + name;
}

/// The plane z = 0 rolled up along a direction in it.
Eigen::Matrix3Xd rolled(const Eigen::Matrix3Xd& flat, double radius, double degrees)
{
  const double a = degrees * M_PI / 180;
  const Eigen::Vector3d along(std::cos(a), std::sin(a), 0), across(-along.y(), along.x(), 0);
  Eigen::Matrix3Xd x(3, flat.cols());
  for (Eigen::Index i = 0; i < flat.cols(); ++i)
  {
    const double angle = along.dot(flat.col(i)) / radius;
    x.col(i) = across * across.dot(flat.col(i)) +
               radius * (std::sin(angle) * along + (1 - std::cos(angle)) * Eigen::Vector3d::UnitZ());
  }
  return x;
}

/// Area that has bending energy: cells of the inner edges or vertices.
double coveredArea(const TriangleMesh& mesh, const MeshTopology& t, BendingModel model)
{
  double area = 0;
  const Eigen::VectorXd faces = faceAreas(mesh), cells = voronoiAreas(mesh);
  if (isConforming(model))
    for (Eigen::Index i = 0; i < cells.size(); ++i)
      area += t.on_boundary[i] ? 0.0 : cells[i];
  else
    for (const int e : t.hinge_edges)
      area += (faces[t.edge_faces(0, e)] + faces[t.edge_faces(1, e)]) / 3;
  return area;
}

void cylindersAndSpheres(StudyContext& context)
{
  constexpr double kRadius = 1.3;
  Plot& plot = context.plot("plate_anisotropy", "Bending modulus of a rolled sheet by direction",
                            "curved direction against the warp [degrees]", "modulus over D");
  plot.log_x = plot.log_y = false;
  for (const GridPattern pattern : kPatterns)
  {
    const TriangleMesh mesh = gridMesh(1.0, 0.9, 40, 0, pattern);
    const MeshTopology t = meshTopology(mesh);
    for (const BendingModel model : kBendingModels)
    {
      double least = 1e300, most = 0;
      for (int degrees = 0; degrees < 180; degrees += 15)
      {
        const double energy = plateEnergy(mesh, t, model, rolled(mesh.vertices, kRadius, degrees));
        const double modulus = energy * 2 * kRadius * kRadius / coveredArea(mesh, t, model);
        least = std::min(least, modulus);
        most = std::max(most, modulus);
        if (model != BendingModel::hinge)
        {
          Series& series = plot.at(std::string(toString(pattern)) + ", " + toString(model));
          series.x.push_back(degrees);
          series.y.push_back(modulus);
        }
        if (degrees % 90 == 0)
          context.row()
              .set("case", "cylinder")
              .set("mesh", toString(pattern))
              .set("model", toString(model))
              .set("degrees", degrees)
              .check(modulus, 1.0, 0.02, "E = D area/(2 R^2)");
      }
      context.metric(keyOf("anisotropy", pattern, model), most / least);
    }
  }
  for (const int level : {3, 4})
  {
    const TriangleMesh sphere = icosphere(2.0, level);
    const MeshTopology t = meshTopology(sphere);
    for (const BendingModel model : kBendingModels)
    {
      const double expected = isConforming(model) ? 1.0 : 1.0 / 3;
      context.row()
          .set("case", "sphere")
          .set("mesh", "icosphere " + std::to_string(level))
          .set("model", toString(model))
          .check(plateEnergy(sphere, t, model, sphere.vertices) / (8 * M_PI), expected, 0.02 * expected,
                 "E = 8 pi D (1 + nu)/2, nu = 1 conforming, -1/3 hinges");
    }
  }
}

struct StrainedTriangle
{
  const char* name;
  double energy;
  double x[9], force[9];
};

/// stvk_triangle.csv: rest (0,0) (1,0.1) (0.2,0.8), E = 1e5 Pa, nu = 0.3, h = 1 mm
constexpr StrainedTriangle kStrained[] = {
    {"uniaxial 10 %",
     0.23625,
     {0, 0, 0, 1.1, 0.1, 0, 0.22, 0.8, 0},
     {4.4423076923077, 1.38461538461539, 0, -5.07692307692308, 0.346153846153846, 0, 0.634615384615385,
      -1.73076923076923, 0}},
    {"biaxial 5 %",
     0.146337053571429,
     {0, 0, 0, 1.05, 0.105, 0, 0.21, 0.84, 0},
     {2.690625, 3.075, 0, -3.075, 0.76875, 0, 0.384375, -3.84375, 0}},
    {"shear 0.2",
     0.308571428571429,
     {0, 0, 0, 1.02, 0.1, 0, 0.36, 0.8, 0},
     {4.02197802197802, 3.57142857142857, 0, -0.0659340659340615, -2.85714285714286, 0, -3.95604395604396,
      -0.714285714285713, 0}},
    {"compression 20 %",
     0.694285714285715,
     {0, 0, 0, 0.8, 0.1, 0, 0.16, 0.8, 0},
     {-5.53846153846154, -2.37362637362637, 0, 6.32967032967033, -0.593406593406594, 0, -0.791208791208792,
      2.96703296703297, 0}},
    {"in space",
     0.163184539285715,
     {0.1, -0.2, 0.3, 0.783069864284562, 0.200401394071156, 1.0441500414111, -0.110416480121667, 0.521206051582986,
      0.530422950361476},
     {2.58827038264261, -0.116610418195487, 1.93049883007704, -1.84743423951635, -1.39842540257213, -2.18434528585298,
      -0.74083614312626, 1.51503582076762, 0.253846455775937}}};

void strainedTriangles(StudyContext& context)
{
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 1, 0.2, 0, 0.1, 0.8, 0, 0, 0;
  mesh.triangles.resize(3, 1);
  mesh.triangles << 0, 1, 2;
  MembraneTerm membrane(mesh, isotropicMembrane(1e5, 0.3, 1e-3));
  for (const StrainedTriangle& c : kStrained)
  {
    PointVector x, gradient(12, 0.0);
    toPoints(Eigen::Map<const Eigen::Matrix3d>(c.x), x);
    const double energy = membrane.addGradient(x.data(), gradient.data()).energy;
    double error = 0, size = 0;
    for (int k = 0; k < 9; ++k)
    {
      error = std::max(error, std::abs(gradient[4 * (k / 3) + k % 3] + c.force[k]));
      size = std::max(size, std::abs(c.force[k]));
    }
    context.row()
        .set("case", "StVK triangle, energy")
        .set("mesh", c.name)
        .check(energy, c.energy, 1e-10 * c.energy, "stvk_triangle.csv");
    context.row()
        .set("case", "StVK triangle, forces")
        .set("mesh", c.name)
        .check(error / size, 0.0, 1e-10, "stvk_triangle.csv");
  }
}

void uniformLoad(StudyContext& context)
{
  Plot& plot = context.plot("plate_load", "Square plate under uniform load: deflection's error against run time",
                            "CPU time [s]", "relative error");
  // 15 rows to 13 columns are equilateral
  const std::vector<int> sizes = context.quick() ? std::vector<int>{26, 52} : std::vector<int>{26, 52, 104};
  for (const bool clamped : {true, false})
    for (const GridPattern pattern : kPatterns)
      for (const BendingModel model : kBendingModels)
      {
        const double expected = clamped ? 0.001265319088 : 0.004062352661;
        const std::string how = clamped ? "clamped" : "simply supported";
        double coarse = 0, fine = 0;
        for (const int n : sizes)
        {
          context.progress(n, sizes.back(), how + " " + toString(pattern) + " " + toString(model));
          const double start = threadSeconds();
          coarse = fine;
          fine = squarePlateDeflection(pattern, model, n, clamped);
          const double seconds = threadSeconds() - start;
          context.row()
              .set("case", how)
              .set("mesh", toString(pattern))
              .set("model", toString(model))
              .set("cells", n)
              .set("value", fine)
              .set("relative_error", fine / expected - 1)
              .set("cpu_seconds", seconds);
          Series& series = plot.at(how + ", " + toString(pattern) + ", " + toString(model));
          series.x.push_back(seconds);
          series.y.push_back(std::abs(fine / expected - 1));
        }
        const double extrapolated = 2 * fine - coarse;
        Row& row = context.row();
        row.set("case", how + ", extrapolated")
            .set("mesh", toString(pattern))
            .set("model", toString(model))
            .set("cells", sizes.back());
        if (!isIsotropic(pattern, model))
        {
          row.set("value", extrapolated).set("relative_error", extrapolated / expected - 1).set("reason", kAnisotropic);
          continue;
        }
        row.check(extrapolated, expected, 0.02 * expected, "Kirchhoff plate, centre D w/(q a^4)")
            .set("relative_error", extrapolated / expected - 1);
        if (std::abs(fine / expected - 1) > 0.01)   // nearer, other errors than the edge's are seen
        {
          const double ratio = (fine - expected) / (coarse - expected);
          context.row()
              .set("case", how + ", error over the coarser one's")
              .set("mesh", toString(pattern))
              .set("model", toString(model))
              .set("cells", sizes.back())
              .set("value", ratio)
              .check(std::max(ratio, 0.5), 0.5, 0.1, "halves, or better");
        }
      }
}

void cantilevers(StudyContext& context)
{
  constexpr double kStiffness = 1e5, kWidth = 0.5;
  const std::vector<int> sizes = context.quick() ? std::vector<int>{20} : std::vector<int>{20, 40};
  const std::vector<double> gammas = context.quick() ? std::vector<double>{10} : std::vector<double>{1, 10, 100};
  Plot& plot = context.plot("plate_cantilever", "Heavy cantilever strip: error of H/W against run time, Gamma = 10",
                            "CPU time [s]", "relative error");
  for (const GridPattern pattern : kPatterns)
    for (const BendingModel model : kBendingModels)
      for (const double gamma : gammas)
      {
        const CantileverTip exact = heavyCantilever(gamma, gamma / kStiffness);
        // nu = -1/3: between cylindrical bending and that of a strip half as wide as long, whose sides give way
        const CantileverTip narrow = heavyCantilever(kNarrowStrip * gamma, gamma / kStiffness);
        const double wide_ratio = exact.drop / exact.extent, narrow_ratio = narrow.drop / narrow.extent;
        const double expected = 0.5 * (wide_ratio + narrow_ratio), range = 0.5 * (narrow_ratio - wide_ratio);
        for (const int n : sizes)
        {
          context.progress(n, sizes.back(), std::string("cantilever ") + toString(pattern) + " " + toString(model));
          double seconds = 0;
          const double ratio = cantileverStrip(pattern, model, gamma, kStiffness, kWidth, n, seconds);
          Row& row = context.row();
          row.set("case", "cantilever strip")
              .set("mesh", toString(pattern))
              .set("model", toString(model))
              .set("cells", n)
              .set("Gamma", gamma);
          row.set("relative_error", ratio / wide_ratio - 1).set("cpu_seconds", seconds);
          if (isConforming(model))
            row.set("value", ratio).set("reason", "nu = 1: free sides give way, the more the smaller the load");
          else if (!isIsotropic(pattern, model))
            row.set("value", ratio).set("reason", kAnisotropic);
          else
            row.check(ratio, expected, range + expected * (0.02 + 0.25 * gamma / (n * n)),
                      "cantilever_master.csv from Gamma to 1.0485 Gamma (cantilever_strip_poisson.csv); bound 2 % + "
                      "0.25 Gamma/n^2");
          if (gamma == 10)
          {
            Series& series = plot.at(std::string(toString(pattern)) + ", " + toString(model));
            series.x.push_back(seconds);
            series.y.push_back(std::abs(ratio / wide_ratio - 1));
          }
        }
      }
}

void lateralBuckling(StudyContext& context)
{
  // nearly equilateral at both widths
  const std::vector<int> sizes = context.quick() ? std::vector<int>{28, 56} : std::vector<int>{28, 56, 112};
  for (const double width : {0.25, 0.5})
    for (const GridPattern pattern : kPatterns)
      for (const BendingModel model : kBendingModels)
      {
        if (isConforming(model))
        {
          context.row()
              .set("case", "lateral buckling")
              .set("mesh", toString(pattern))
              .set("model", toString(model))
              .set("width", width)
              .set("reason", "no threshold: nu = 1, a free edge takes no moment and a strip no torque");
          continue;
        }
        for (const int n : sizes)
        {
          context.progress(n, sizes.back(),
                           std::string("lateral buckling ") + toString(pattern) + " " + toString(model));
          const double start = threadSeconds(), load = lateralBucklingLoad(pattern, model, width, n);
          const double expected = width == 0.25 ? 22.80473631 : 26.28742802;
          Row& row = context.row();
          row.set("case", "lateral buckling")
              .set("mesh", toString(pattern))
              .set("model", toString(model))
              .set("cells", n)
              .set("width", width);
          row.set("cpu_seconds", threadSeconds() - start).set("relative_error", load / expected - 1);
          if (isIsotropic(pattern, model))
            row.check(load, expected, expected * (0.02 + 2.0 / n),
                      "lateral_plate_two_poisson.csv: nu -1/3 and 0.3; bound 2 % + 2/n");
          else
            row.set("value", load).set("reason", kAnisotropic);
        }
      }
}

}   // namespace

void runPlate(StudyContext& context)
{
  useOneBlasThread();
  cylindersAndSpheres(context);
  strainedTriangles(context);
  uniformLoad(context);
  lateralBuckling(context);
  cantilevers(context);
}

const StudyRegistration kPlateRegistration{
    "plate", "plates of every bending model on every mesh against plate theory: what D means", runPlate};

}   // namespace slender::study
