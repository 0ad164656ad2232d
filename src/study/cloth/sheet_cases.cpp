#include "sheet_cases.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include <Eigen/Geometry>
#include "world/impulse_cloths.h"

namespace slender::study {

using Eigen::Vector3d;

SheetRun runSheet(StudyContext& context, const SheetScene& scene, BendingModel bending, double shake)
{
  ClothModel model = scene.model;
  model.bending = bending;
  Eigen::Matrix3Xd start = scene.start;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> shift(-shake, shake);
  for (Eigen::Index i = 0; i < start.size() && shake > 0; ++i)
    start.data()[i] += shift(random);
  const auto cloth = std::make_shared<ClothModel>(std::move(model));

  ClothOptions options;
  options.one_newton_step = true;
  WorldModel model_of_world;
  model_of_world.cloths.push_back({cloth, options, scene.contact, {}, {}});
  model_of_world.cloths[0].contact->method = ContactMethod::impulses;
  model_of_world.obstacles = scene.solids;
  model_of_world.time.step = scene.step;
  WorldState state;
  state.cloths.push_back(makeClothState(*cloth, start));
  state.obstacles.resize(scene.solids.size());
  state.obstacle_velocities.resize(scene.solids.size());
  WorldInputs inputs;
  inputs.obstacles.resize(scene.solids.size());
  inputs.cloths.resize(1);
  ClothInputs& input = inputs.cloths[0];
  input.gravity = scene.gravity;
  input.wind = scene.wind;
  pinVertices(state.cloths[0], scene.pins);
  input.pins.resize(3, static_cast<Eigen::Index>(state.cloths[0].pins.size()));
  for (std::size_t k = 0; k < state.cloths[0].pins.size(); ++k)
    input.pins.col(static_cast<Eigen::Index>(k)) = scene.start.col(state.cloths[0].pins[k]);

  World world(model_of_world, state);
  ClothStepper alone(cloth, options);
  SheetRun run;
  const int steps = static_cast<int>(std::lround(scene.duration / scene.step));
  const int every = std::max(1, static_cast<int>(std::lround(scene.keep_every / scene.step)));
  const std::string label = scene.name + ", " + toString(bending);
  int timed = 0;
  for (int k = 1; k <= steps; ++k)
  {
    context.progress(k, steps, label);
    if (k % 20 == 0)
    {
      ClothState copy = state.cloths[0];
      const double start_time = threadSeconds();
      alone.step(copy, input, scene.step);
      run.cloth_seconds += threadSeconds() - start_time;
      ++timed;
    }
    const double start_time = threadSeconds();
    const StepReport report = world.step(state, inputs);
    run.seconds_per_step += threadSeconds() - start_time;
    if (!report.ok)
      throw std::runtime_error(label + ", step " + std::to_string(k) + " refused: " + report.message);
    if (k * scene.step < scene.keep_from)
      continue;
    run.corner.emplace_back(state.cloths[0].x.col(state.cloths[0].x.cols() - 1));
    if ((steps - k) % every == 0)
      run.frames.push_back(state.cloths[0].x);
  }
  run.seconds_per_step /= steps;
  run.cloth_seconds /= timed;
  run.speed = std::sqrt(state.cloths[0].v.squaredNorm() / static_cast<double>(start.cols()));
  run.intersections = ImpulseCloths(world.model(), {0}).intersections(state);
  return run;
}

double Spectrum::mean() const
{
  double sum = 0;
  for (std::size_t k = 0; k < share.size(); ++k)
    sum += share[k] * std::log(wavelength[k]);
  return std::exp(sum);
}

Spectrum wrinkles(const SheetScene& scene, const std::vector<Eigen::Matrix3Xd>& frames)
{
  const int nu = scene.columns - 1, nv = scene.rows - 1;   // inner vertices
  const Vector3d last = scene.mesh.vertices.rightCols<1>();
  const double du = last.x() / scene.columns, dv = last.y() / scene.rows;
  const auto cosines = [](int n) {   // orthonormal type II
    Eigen::MatrixXd c(n, n);
    for (int k = 0; k < n; ++k)
      for (int i = 0; i < n; ++i)
        c(k, i) = std::sqrt((k ? 2.0 : 1.0) / n) * std::cos(M_PI * k * (i + 0.5) / n);
    return c;
  };
  const Eigen::MatrixXd cu = cosines(nu), cv = cosines(nv);
  const double shortest = 2.0 * std::max(du, dv);
  const int bands = 1 + static_cast<int>(std::floor(2.0 * std::log2(2.0 * std::max(nu * du, nv * dv) / shortest)));
  Spectrum spectrum;
  spectrum.share.assign(bands, 0.0);
  for (int b = 0; b < bands; ++b)
    spectrum.wavelength.push_back(shortest * std::exp2(0.5 * b + 0.25));
  double sum = 0;
  for (const Eigen::Matrix3Xd& x : frames)
  {
    Eigen::MatrixXd curvature(nu, nv);
    for (int i = 1; i <= nu; ++i)
      for (int j = 1; j <= nv; ++j)
      {
        const auto at = [&](int p, int q) -> Vector3d { return x.col((j + q) * (scene.columns + 1) + i + p); };
        const Vector3d normal = (at(1, 0) - at(-1, 0)).cross(Vector3d(at(0, 1) - at(0, -1))).normalized();
        curvature(i - 1, j - 1) = normal.dot((at(1, 0) - 2 * at(0, 0) + at(-1, 0)) / (du * du) +
                                             (at(0, 1) - 2 * at(0, 0) + at(0, -1)) / (dv * dv));
      }
    const Eigen::MatrixXd power = (cu * curvature * cv.transpose()).cwiseAbs2();
    for (int k = 0; k < nu; ++k)
      for (int l = 0; l < nv; ++l)
      {
        if (k == 0 && l == 0)
          continue;
        const double wavelength = 2.0 / std::hypot(k / (nu * du), l / (nv * dv));
        const int band = static_cast<int>(std::floor(2.0 * std::log2(wavelength / shortest) + 1e-9));
        spectrum.share[std::clamp(band, 0, bands - 1)] += power(k, l);
        sum += power(k, l);
      }
  }
  for (double& share : spectrum.share)
    share /= sum;
  return spectrum;
}

double distance(const Spectrum& a, const Spectrum& b)
{
  double sum = 0;
  for (std::size_t k = 0; k < a.share.size(); ++k)
    sum += 0.5 * std::abs(a.share[k] - b.share[k]);
  return sum;
}

ShapeDifference difference(const SheetScene& scene, const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b)
{
  const Eigen::VectorXd apart = (a - b).colwise().norm();
  const double size = scene.mesh.vertices.rightCols<1>().maxCoeff();
  return {std::sqrt(apart.squaredNorm() / static_cast<double>(apart.size())) / size, apart.maxCoeff() / size};
}

}   // namespace slender::study
