#include "slender_sim/tracking/clustering.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <random>
#include <set>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>

namespace slender {

namespace {

/// Below `count`; no std:: distribution: these differ between libraries.
int randomBelow(std::mt19937& engine, int count) { return static_cast<int>(engine() * 0x1p-32 * count); }

std::vector<int> chosen(std::mt19937& engine, int count, int of)
{
  std::vector<int> all(of);
  std::iota(all.begin(), all.end(), 0);
  for (int k = 0; k < count; ++k)
    std::swap(all[k], all[k + randomBelow(engine, of - k)]);
  all.resize(count);
  return all;
}

/// Faces beside each face, -1: none.
Eigen::Matrix3Xi neighbours(const Eigen::Matrix3Xi& triangles)
{
  Eigen::Matrix3Xi beside = Eigen::Matrix3Xi::Constant(3, triangles.cols(), -1);
  std::map<std::pair<int, int>, std::pair<int, int>> open;
  for (int f = 0; f < triangles.cols(); ++f)
    for (int k = 0; k < 3; ++k)
    {
      const int a = triangles(k, f), b = triangles((k + 1) % 3, f);
      const auto [at, fresh] = open.try_emplace({std::min(a, b), std::max(a, b)}, std::pair{f, k});
      if (fresh)
        continue;
      beside(k, f) = at->second.first;
      beside(at->second.second, at->second.first) = f;
    }
  return beside;
}

class Partition
{
public:
  Partition(const Eigen::Matrix3Xi& triangles, const std::vector<Eigen::Matrix3Xd>& frames,
            const std::vector<int>& sampled, double mu)
    : faces_(static_cast<int>(triangles.cols())),
      frames_(static_cast<int>(sampled.size())),
      beside_(neighbours(triangles)),
      facts_(faces_ * frames_),
      flatness_(1.0 - mu)
  {
    for (int t = 0; t < frames_; ++t)
    {
      const Eigen::Matrix3Xd& x = frames[sampled[t]];
      double total = 0.0;
      for (int f = 0; f < faces_; ++f)
      {
        const Eigen::Vector3d a = x.col(triangles(0, f)), b = x.col(triangles(1, f)), c = x.col(triangles(2, f));
        const Eigen::Vector3d n = 0.5 * (b - a).cross(c - a);
        Fact& fact = facts_[f * frames_ + t];
        fact.area = n.norm();
        fact.normal = fact.area > 0 ? Eigen::Vector3d(n / fact.area) : Eigen::Vector3d::Zero();
        fact.centroid = (a + b + c) / 3.0;
        total += fact.area;
      }
      compactness_.push_back(total > 0 ? mu / total : 0.0);
    }
  }

  /// Numbers of the connected parts of the mesh.
  std::vector<int> parts() const
  {
    std::vector<int> part(faces_, -1);
    int count = 0;
    for (int start = 0; start < faces_; ++start)
    {
      if (part[start] >= 0)
        continue;
      std::vector<int> open{start};
      part[start] = count;
      while (!open.empty())
      {
        const int f = open.back();
        open.pop_back();
        for (const int g : beside_.col(f))
          if (g >= 0 && part[g] < 0)
          {
            part[g] = count;
            open.push_back(g);
          }
      }
      ++count;
    }
    return part;
  }

  void startFrom(const std::vector<int>& seeds)
  {
    seeds_ = seeds;
    proxies_.resize(seeds.size() * frames_);
    for (std::size_t k = 0; k < seeds.size(); ++k)
      for (int t = 0; t < frames_; ++t)
        proxies_[k * frames_ + t] = facts_[seeds[k] * frames_ + t];
  }

  /// Grows regions around the seeds, the face that fits best first, so that regions stay connected.
  void grow()
  {
    struct Candidate
    {
      double distortion;
      int face, region;
      bool operator>(const Candidate& o) const
      {
        return std::tie(distortion, face, region) > std::tie(o.distortion, o.face, o.region);
      }
    };
    std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue;
    region.assign(faces_, -1);
    total = 0.0;
    const auto assign = [&](int face, int to, double distortion) {
      region[face] = to;
      total += distortion;
      for (const int g : beside_.col(face))
        if (g >= 0 && region[g] < 0)
          queue.push({this->distortion(g, to), g, to});
    };
    for (std::size_t k = 0; k < seeds_.size(); ++k)   // all seeds first: no region may take another's
      region[seeds_[k]] = static_cast<int>(k);
    for (std::size_t k = 0; k < seeds_.size(); ++k)
      assign(seeds_[k], static_cast<int>(k), distortion(seeds_[k], static_cast<int>(k)));
    while (!queue.empty())
    {
      const Candidate next = queue.top();
      queue.pop();
      if (region[next.face] < 0)
        assign(next.face, next.region, next.distortion);
    }
  }

  /// Proxies are the means of their regions; the seed is the face that fits best.
  void updateProxies()
  {
    for (Fact& proxy : proxies_)
      proxy = {0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    for (int f = 0; f < faces_; ++f)
      for (int t = 0; t < frames_; ++t)
      {
        const Fact& fact = facts_[f * frames_ + t];
        Fact& proxy = proxies_[region[f] * frames_ + t];
        proxy.area += fact.area;
        proxy.centroid += fact.area * fact.centroid;
        proxy.normal += fact.area * fact.normal;
      }
    for (std::size_t p = 0; p < proxies_.size(); ++p)
    {
      Fact& proxy = proxies_[p];
      if (proxy.area > 0)
        proxy.centroid /= proxy.area;
      else   // collapsed in this frame: where its seed is
        proxy.centroid = facts_[seeds_[p / frames_] * frames_ + p % frames_].centroid;
      proxy.normal.normalize();
    }
    std::vector<double> best(seeds_.size(), std::numeric_limits<double>::infinity());
    for (int f = 0; f < faces_; ++f)
    {
      const double d = distortion(f, region[f]);
      if (d < best[region[f]])
      {
        best[region[f]] = d;
        seeds_[region[f]] = f;
      }
    }
  }

  std::vector<int> region;
  double total = 0.0;

private:
  struct Fact
  {
    double area = 0.0;
    Eigen::Vector3d centroid, normal;
  };

  double distortion(int face, int to) const
  {
    double worst = 0.0;
    for (int t = 0; t < frames_; ++t)
    {
      const Fact &f = facts_[face * frames_ + t], &p = proxies_[to * frames_ + t];
      worst = std::max(worst, f.area * (compactness_[t] * (f.centroid - p.centroid).squaredNorm() +
                                        flatness_ * (f.normal - p.normal).squaredNorm()));
    }
    return worst;
  }

  int faces_, frames_;
  Eigen::Matrix3Xi beside_;
  std::vector<Fact> facts_, proxies_;
  std::vector<double> compactness_;   ///< mu over the whole area of each frame
  double flatness_;
  std::vector<int> seeds_;
};

void check(const Eigen::Matrix3Xi& triangles, const std::vector<Eigen::Matrix3Xd>& frames, const ClusteringOptions& o)
{
  const auto require = [](bool good, const std::string& what) {
    if (!good)
      throw std::invalid_argument("clustering: " + what);
  };
  require(!frames.empty(), "at least one frame is needed");
  require(o.regions >= 1 && o.regions <= triangles.cols(), "regions must be from 1 to the number of faces, " +
                                                               std::to_string(triangles.cols()) + ", got " +
                                                               std::to_string(o.regions));
  require(o.compactness >= 0 && o.compactness <= 1, "compactness must be in [0, 1]");
  require(o.sampled_frames >= 1 && o.max_iterations >= 1, "sampled_frames and max_iterations must be at least 1");
  for (std::size_t t = 0; t < frames.size(); ++t)
  {
    require(frames[t].cols() == frames[0].cols() && triangles.maxCoeff() < frames[t].cols(),
            "frame " + std::to_string(t) + " has " + std::to_string(frames[t].cols()) + " vertices, " +
                std::to_string(frames[0].cols()) + " expected");
    require(frames[t].allFinite(), "frame " + std::to_string(t) + " is not finite");
  }
}

/// At random, but at least one in each connected part.
std::vector<int> firstSeeds(const std::vector<int>& part, int regions, std::mt19937& engine)
{
  const int parts = 1 + *std::max_element(part.begin(), part.end());
  if (parts > regions)
    throw std::invalid_argument("clustering: the mesh has " + std::to_string(parts) +
                                " connected parts, more than the " + std::to_string(regions) +
                                " regions: ask for at least one region per part");
  const std::vector<int> order = chosen(engine, static_cast<int>(part.size()), static_cast<int>(part.size()));
  std::vector<int> seeds;
  std::vector<char> seen(parts, 0), taken(part.size(), 0);
  for (const int f : order)
    if (!seen[part[f]])
    {
      seen[part[f]] = taken[f] = 1;
      seeds.push_back(f);
    }
  for (const int f : order)
    if (!taken[f] && static_cast<int>(seeds.size()) < regions)
      seeds.push_back(f);
  return seeds;
}

}   // namespace

Clustering clusterFaces(const Eigen::Matrix3Xi& triangles, const std::vector<Eigen::Matrix3Xd>& frames,
                        const ClusteringOptions& options)
{
  check(triangles, frames, options);
  std::mt19937 engine(options.seed);
  const int count = static_cast<int>(frames.size());
  Clustering result;
  result.frames = chosen(engine, std::min(options.sampled_frames, count), count);
  std::sort(result.frames.begin(), result.frames.end());
  Partition partition(triangles, frames, result.frames, options.compactness);
  partition.startFrom(firstSeeds(partition.parts(), options.regions, engine));
  result.distortion = std::numeric_limits<double>::infinity();
  std::set<std::vector<int>> seen;
  while (result.iterations < options.max_iterations)
  {
    const std::vector<int> before = partition.region;
    partition.grow();
    ++result.iterations;
    if (partition.total < result.distortion)
    {
      result.distortion = partition.total;
      result.region = partition.region;
    }
    result.settled = partition.region == before;
    if (!seen.insert(partition.region).second)
      break;
    partition.updateProxies();
  }
  return result;
}

}   // namespace slender
