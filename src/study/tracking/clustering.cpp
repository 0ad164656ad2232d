// Regions of a walking character (thesis figure 6.7): animation-aware clustering beside clustering of its rest shape.
#include <chrono>
#include <cmath>
#include <map>

#include "biped.h"
#include "region_cases.h"
#include "slender_sim/tracking/clustering.h"

namespace slender::study {

namespace {

/// How regions lie to the joints, where faces of different bodies meet.
struct Fit
{
  double joint_seams = 0;   ///< share of the joints' length that is a seam between regions
  double seams = 0;         ///< share of the length of all edges that is: what joints would have by chance
  double impure = 0;        ///< share of the area that moves with another body than most of its region
};

Fit fitOf(const TriangleMesh& mesh, const std::vector<int>& body, const std::vector<int>& region)
{
  std::map<std::pair<int, int>, int> first;
  double joints = 0, joint_seams = 0, all = 0, seams = 0;
  for (int f = 0; f < mesh.triangles.cols(); ++f)
    for (int k = 0; k < 3; ++k)
    {
      const int a = mesh.triangles(k, f), b = mesh.triangles((k + 1) % 3, f);
      const auto [at, fresh] = first.try_emplace({std::min(a, b), std::max(a, b)}, f);
      if (fresh)
        continue;
      const double length = (mesh.vertices.col(a) - mesh.vertices.col(b)).norm();
      const bool joint = body[f] != body[at->second], seam = region[f] != region[at->second];
      all += length;
      joints += joint ? length : 0.0;
      seams += seam ? length : 0.0;
      joint_seams += joint && seam ? length : 0.0;
    }
  std::map<int, std::map<int, double>> areas;
  const Eigen::VectorXd area = faceAreas(mesh);
  for (int f = 0; f < mesh.triangles.cols(); ++f)
    areas[region[f]][body[f]] += area[f];
  double impure = 0;
  for (const auto& [r, of_bodies] : areas)
  {
    double sum = 0, most = 0;
    for (const auto& [b, share] : of_bodies)
    {
      sum += share;
      most = std::max(most, share);
    }
    impure += sum - most;
  }
  return {joint_seams / joints, seams / all, impure / area.sum()};
}

constexpr int kThesisRegions = 200;

/// Means over the seeds.
struct MeanClustering
{
  Fit fit;
  double seconds = 0, iterations = 0, settled = 0;
};

const char* nameOf(bool aware) { return aware ? "animation-aware" : "static"; }

/// The regions at rest and on a frame of the walk.
void drawRegions(SurfacePicture& picture, const TriangleMesh& mesh, const Eigen::Matrix3Xd& frame,
                 const Clustering& clusters, bool aware)
{
  const Eigen::VectorXi hues = huesOf(mesh.triangles, clusters.region);
  const char* what = nameOf(aware);
  picture.panels.push_back({std::string(what) + ", at rest", {{mesh, true, hues}}});
  const Eigen::Matrix3Xd here = frame.colwise() - Eigen::Vector3d(frame.row(0).mean(), 0, 0);
  picture.panels.push_back({std::string(what) + ", walking", {{{here, mesh.triangles}, true, hues}}});
}

/// Clusters one seed, adds its share to the means and returns its regions.
Clustering addSeed(MeanClustering& mean, const Biped& biped, const std::vector<Eigen::Matrix3Xd>& frames, int count,
                   int seed, int seeds)
{
  const TriangleMesh& mesh = biped.mesh();
  ClusteringOptions options;
  options.regions = count;
  options.compactness = 0.5;
  options.max_iterations = 32;
  options.seed = static_cast<unsigned>(seed);
  const auto start = std::chrono::steady_clock::now();
  Clustering clusters = clusterFaces(mesh.triangles, frames, options);
  mean.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / seeds;
  mean.iterations += static_cast<double>(clusters.iterations) / seeds;
  mean.settled += static_cast<double>(clusters.settled) / seeds;
  const Fit fit = fitOf(mesh, biped.bodyOfFace(), clusters.region);
  mean.fit.joint_seams += fit.joint_seams / seeds;
  mean.fit.seams += fit.seams / seeds;
  mean.fit.impure += fit.impure / seeds;
  return clusters;
}

void report(StudyContext& context, Plot& plot, const MeanClustering& mean, const TriangleMesh& mesh, int count,
            bool aware)
{
  context.row()
      .set("clustering", nameOf(aware))
      .set("vertices", static_cast<double>(mesh.vertices.cols()))
      .set("regions", count)
      .set("seams_at_joints", mean.fit.joint_seams)
      .set("seams_anywhere", mean.fit.seams)
      .set("impure_area", mean.fit.impure)
      .set("iterations", mean.iterations)
      .set("settled", mean.settled)
      .set("seconds", mean.seconds);
  plot.at(nameOf(aware)).x.push_back(count);
  plot.at(nameOf(aware)).y.push_back(mean.fit.joint_seams);
}

}   // namespace

void runClustering(StudyContext& context)
{
  const Biped biped;
  const TriangleMesh& mesh = biped.mesh();
  std::vector<Eigen::Matrix3Xd> walk;
  for (int k = 0; k < 60; ++k)
    walk.push_back(biped.at(Biped::kPeriod * (1.0 + k / 60.0)));
  const std::vector<Eigen::Matrix3Xd> rest = {mesh.vertices};
  SurfacePicture& picture = context.picture("clustering", "200 regions of a walking character (thesis figure 6.7)");
  picture.view = {-0.8, 0.6, -0.1};
  picture.columns = 4;
  Plot& plot =
      context.plot("clustering_seams", "Seams of regions at the joints", "regions", "share of the joints' length");
  plot.log_y = false;

  const int seeds = context.quick() ? 2 : 10;
  const std::vector<int> counts =
      context.quick() ? std::vector<int>{kThesisRegions} : std::vector<int>{50, 100, kThesisRegions, 280};
  int done = 0;
  MeanClustering thesis[2];   // of the thesis's count of regions: static, animation-aware
  for (const int count : counts)
    for (const bool aware : {false, true})
    {
      MeanClustering mean;
      for (int seed = 1; seed <= seeds; ++seed)
      {
        context.progress(done++, 2 * seeds * static_cast<int>(counts.size()), nameOf(aware));
        const Clustering clusters = addSeed(mean, biped, aware ? walk : rest, count, seed, seeds);
        if (count == kThesisRegions && seed == 1)
          drawRegions(picture, mesh, walk[12], clusters, aware);
      }
      report(context, plot, mean, mesh, count, aware);
      if (count == kThesisRegions)
        thesis[aware] = mean;
    }
  context.metric("seams_at_joints_gain", thesis[1].fit.joint_seams / thesis[0].fit.joint_seams);
  context.metric("seconds", thesis[1].seconds);
  context.metric("iterations", thesis[1].iterations);
  context.note(
      "seams_at_joints: share of the length of edges between faces of different bodies that lie between two regions; "
      "seams_anywhere: "
      "of all edges; impure_area: of faces that move with another body than most of their region; means over seeds. "
      "The thesis: 3038 vertices, "
      "200 regions, 32 iterations, less than five minutes.");
}

const StudyRegistration kClusteringRegistration{
    "clustering", "regions of a walking character: animation-aware clustering beside static (thesis figure 6.7)",
    runClustering};

}   // namespace slender::study
