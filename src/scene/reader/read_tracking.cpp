#include "read_tracking.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "slender_sim/geometry/mesh_defects.h"
#include "slender_sim/tracking/clustering.h"

/// Cloths that track a guide.
namespace slender {

namespace {

constexpr double max_fine_vertices = 1e6;
constexpr double default_blend = 0.2;   // [s]

/// The mesh that tracks, and how it comes from the guide's.
struct TrackedMesh
{
  enum Kind
  {
    same,
    subdivided,
    separate
  } kind = subdivided;
  Subdivision subdivision;        ///< of the guide; separate: its mesh only
  std::optional<MeshFile> file;   ///< separate
  bool good = false;
};

TrackedMesh readTrackedMesh(const YamlCursor& at, const ReadContext& context, const GuideSource& guide)
{
  TrackedMesh tracked;
  int levels = 0;
  const TriangleMesh& coarse = guide.config.mesh;
  const std::size_t before = at.problems().size();
  if (!at.present() || at.isScalar())
  {
    tracked.kind = TrackedMesh::same;
    if (at.present())
      at.choice<bool>({{"same", true}});
  }
  else if (at.isMap() && at.find("file").present())
  {
    tracked.kind = TrackedMesh::separate;
    tracked.file = readMeshFile(at, context);
    if (tracked.file)
      tracked.subdivision.mesh = tracked.file->mesh;
  }
  else
  {
    YamlMap map(at);
    const YamlCursor subdivided = map.require("subdivide", levels, Range::closed(1, 10, "levels"),
                                              "How often each face of the guide is divided into four.");
    const double faces = std::pow(4.0, levels) * static_cast<double>(coarse.triangles.cols());
    if (faces > 2 * max_fine_vertices)
      subdivided.problem("makes more than " + std::to_string(static_cast<int>(max_fine_vertices)) + " vertices");
    else if (levels > 0)
      context.claim(subdivided, 0.5 * faces);
  }
  const bool own = tracked.kind == TrackedMesh::separate;
  if (at.problems().size() != before || (!own && coarse.vertices.cols() == 0))
    return tracked;   // reported
  if (!own)
    tracked.subdivision = subdivide(coarse, levels);
  tracked.good = at.attempt([&] {
    requireSoundMesh(tracked.subdivision.mesh, tracked.file ? tracked.file->path
                                               : guide.file ? guide.file->path
                                                            : "undeformed");
  });
  return tracked;
}

/// Frames of the guide's motion for clustering: all that it has, or instants spread over the motion of its bodies.
std::vector<Eigen::Matrix3Xd> framesOf(const GuideConfig& guide, int sampled)
{
  if (const auto* frames = std::get_if<FrameGuide>(&guide.motion))
    return frames->points.frames();
  std::vector<Eigen::Matrix3Xd> shapes(1, guide.mesh.vertices);
  const auto* carried = std::get_if<CarriedGuide>(&guide.motion);
  if (carried && !carried->poses.empty())
  {
    double first = 1e300, last = -1e300;
    for (const PoseTrajectory& body : carried->poses)
    {
      first = std::min(first, body.firstTime());
      last = std::max(last, body.lastTime());
    }
    shapes.resize(static_cast<std::size_t>(std::max(2, 5 * sampled)));
    for (std::size_t k = 0; k < shapes.size(); ++k)
    {
      guide.evaluate(first + (last - first) * static_cast<double>(k) / static_cast<double>(shapes.size() - 1),
                     shapes[k]);
    }
  }
  return shapes;
}

TestFunctions readClusters(const YamlCursor& at, const GuideConfig& guide)
{
  ClusteringOptions options;
  YamlMap map(at);
  map.require("count", options.regions, Range::closed(1, 1'000'000, "regions"), "Number of regions.");
  map.get("compactness", options.compactness, Range::closed(0, 1),
          "1: compact regions, 0: flat regions. Without the key: 0.5.");
  int seed = 1;
  map.get("seed", seed, Range::closed(0, 2'000'000'000),
          "Seed of the random start of the clustering. Without the key: 1.");
  options.seed = static_cast<unsigned>(seed);
  map.get("frames", options.sampled_frames, Range::closed(1, 10'000),
          "Number of frames of the guide's motion that the regions suit. Without the key: 20.");
  const auto* carried = std::get_if<CarriedGuide>(&guide.motion);
  const bool live = std::holds_alternative<TopicGuide>(guide.motion) || (carried && carried->poses.empty());
  const bool simulated = std::holds_alternative<ClothGuide>(guide.motion);
  if (live || simulated)
  {
    at.warning(
        std::string("the guide's motion is not known before it runs, as it is that of ") +
        (live ? "messages" : "a cloth") +
        ": regions are clustered by its first shape alone; give regions, or cluster a recorded motion of the guide");
  }
  return regionBasis(guide.mesh,
                     clusterFaces(guide.mesh.triangles, framesOf(guide, options.sampled_frames), options).region);
}

std::vector<PaintedRegion> readRegions(const YamlCursor& at, const ReadContext& context, const GuideSource& guide,
                                       const TrackedMesh& tracked)
{
  std::vector<PaintedRegion> regions;
  if (at.isScalar())
  {
    for (const VertexGroup& group : readGroupsOf(at, context, guide.file))
      regions.push_back({group.name, group.vertices, {}});
    if (tracked.kind != TrackedMesh::separate)
      return regions;
    for (const VertexGroup& group : readGroupsOf(at, context, tracked.file))
      for (PaintedRegion& region : regions)
        region.tracked = region.name == group.name ? group.vertices : region.tracked;
    return regions;
  }
  for (const auto& [name, entry] : at.members("A region of your name."))
  {
    PaintedRegion region{name, {}, {}};
    YamlMap map(entry);
    region.guide = readIndexList(map.require("guide", "Vertices of the guide in the region; \"3..7\" is a range."),
                                 static_cast<int>(guide.config.mesh.vertices.cols()));
    const char* const meaning =
        "Vertices of the tracked mesh in the region. Needed if that mesh comes from a file; otherwise the guide's "
        "function is prolonged to it.";
    const YamlCursor own =
        tracked.kind == TrackedMesh::separate ? map.require("tracked", meaning) : map.get("tracked", meaning);
    if (own.present())
      region.tracked = readIndexList(own, static_cast<int>(tracked.subdivision.mesh.vertices.cols()));
    regions.push_back(std::move(region));
  }
  return regions;
}

/// `named`: an entry of a list of sets, which gets its name and when it takes over, or null. Throws
/// std::invalid_argument for functions that do not fit the meshes.
TestFunctions readFunctions(const YamlCursor& at, const ReadContext& context, const GuideSource& guide,
                            const TrackedMesh& tracked, FunctionSet* named)
{
  YamlMap map(at);
  const YamlCursor basis =
      map.get("basis", "One average per vertex of the guide, by the hat functions of its subdivision.");
  const YamlCursor vertices =
      map.get("vertices", "Vertices of the guide that count for `basis: subdivision`. Without the key: all.");
  const YamlCursor regions =
      map.get("regions",
              "One average per region: those of the groups in the guide's OBJ file, or a map from names to vertices.");
  const YamlCursor clusters =
      map.get("clusters", "One average per region, found by clustering the guide's faces; for `mesh: same`.");
  if (named)
  {
    assign(named->name,
           map.require("name",
                       "Name of a set of test functions; for entries of a list of sets, of which one acts at a time.")
               .name());
    map.get("from", named->from, Range::above(0, 1e7, "s"),
            "Simulated time at which the set takes over; for entries of a list of sets. Without the key only "
            "the service `~set_functions` calls for it; the first set acts from the start.");
    map.get("blend", named->blend, Range::closed(0, 1e7, "s"),
            "Time within which the averages go over to the guide's when the set takes over; 0: in one step. For "
            "entries of a list of sets. Without the key: 0.2 s.");
  }
  map.finish();
  if (basis.present() + regions.present() + clusters.present() > 1)
  {
    at.problem(
        "must be one of {basis: subdivision}, {regions: obj}, {regions: {NAME: {guide: [...], tracked: [...]}}}, "
        "{clusters: {count: N}}");
    return {};
  }
  if (vertices.present() && (regions.present() || clusters.present()))
    vertices.problem("is for basis: subdivision");
  if (clusters.present())
  {
    if (tracked.kind != TrackedMesh::same)
    {
      clusters.problem("are regions of faces that guide and tracked mesh share; take mesh: same");
      return {};
    }
    return readClusters(clusters, guide.config);
  }
  if (regions.present())
  {
    const std::vector<PaintedRegion> painted = readRegions(regions, context, guide, tracked);
    if (painted.empty())
      return {};
    return tracked.kind == TrackedMesh::separate
               ? paintedRegions(painted, static_cast<int>(guide.config.mesh.vertices.cols()),
                                static_cast<int>(tracked.subdivision.mesh.vertices.cols()))
               : paintedRegions(painted, tracked.subdivision);
  }
  if (basis.present() && !basis.choice<bool>({{"subdivision", true}}))
    return {};
  if (tracked.kind == TrackedMesh::separate)
  {
    at.problem(
        "must be given as regions: {NAME: {guide: [...], tracked: [...]}} (or obj) when the tracked mesh is a file of "
        "its own");
    return {};
  }
  return subdivisionBasis(tracked.subdivision,
                          vertices.present()
                              ? readIndexList(vertices, static_cast<int>(guide.config.mesh.vertices.cols()))
                              : std::vector<int>{});
}

/// Largest traction [Pa] for a test function, or for all (no name).
struct Traction
{
  std::string name;
  YamlCursor at;
  double value;
};

std::vector<Traction> readTractions(const YamlCursor& at)
{
  const Range range = Range::above(0, 1e12, "Pa");
  std::vector<Traction> tractions;
  if (at.present() && !at.isMap())
    tractions.push_back({"", at, at.number(range).value_or(1.0)});
  else if (at.present())
    for (const auto& [name, entry] : at.members("Largest force per area of the test function of this name."))
      tractions.push_back({name, entry, entry.number(range).value_or(1.0)});
  return tractions;
}

/// Bounds of forces [N] of all test functions; empty without. `used`: of which of the tractions, per one of them.
Eigen::VectorXd boundsOf(const std::vector<Traction>& tractions, const WeakConstraints& constraints,
                         std::vector<char>& used)
{
  Eigen::VectorXd bounds;
  if (tractions.empty())
    return bounds;
  bounds.setConstant(constraints.count(), std::numeric_limits<double>::infinity());
  for (std::size_t t = 0; t < tractions.size(); ++t)
  {
    const Traction& traction = tractions[t];
    for (int i = 0; i < constraints.count(); ++i)
    {
      if (traction.name.empty() || traction.name == constraints.name(i))
      {
        bounds[i] = traction.value * constraints.measures()[i];
        used[t] = 1;
      }
    }
  }
  return bounds;
}

/// Those of one entry; without constraints when something was reported.
FunctionSet readFunctionSet(const YamlCursor& at, bool named, const std::vector<Traction>& tractions,
                            std::vector<char>& used, const ReadContext& context, const GuideSource& guide,
                            const TrackedMesh& tracked, const ClothConfig& cloth)
{
  FunctionSet set;
  set.blend = named ? default_blend : 0.0;
  at.attempt([&] {
    set.functions = readFunctions(at, context, guide, tracked, named ? &set : nullptr);
    if (set.functions.count() == 0)
      return;   // reported
    // of the mesh as it lies on its guide, whatever its lengths at rest are
    auto constraints = std::make_shared<WeakConstraints>(set.functions, hatMassMatrix(guide.config.mesh),
                                                         hatMassMatrix(tracked.subdivision.mesh));
    std::vector<char> held;
    for (const GraspConfig& grasp : cloth.grasps)
    {
      held.resize(static_cast<std::size_t>(cloth.mesh.vertices.cols()), 0);
      for (const int vertex : grasp.vertices)
        held[vertex] = 1;
    }
    constraints->requireIndependent(held);
    set.bounds = boundsOf(tractions, *constraints, used);
    set.constraints = std::move(constraints);
  });
  return set;
}

std::shared_ptr<const TrackingConfig> readTracking(const YamlCursor& at, const std::vector<Traction>& tractions,
                                                   const ReadContext& context, const GuideSource& guide,
                                                   const TrackedMesh& tracked, const ClothConfig& cloth)
{
  auto tracking = std::make_shared<TrackingConfig>();
  tracking->guide = guide.config;
  const Eigen::Matrix3Xd& coarse = guide.config.mesh.vertices;
  tracking->size = (coarse.rowwise().maxCoeff() - coarse.rowwise().minCoeff()).norm();
  std::vector<char> used(tractions.size(), 0);
  if (!at.isList())
    tracking->sets.push_back(readFunctionSet(at, false, tractions, used, context, guide, tracked, cloth));
  for (const YamlCursor& entry : at.isList() ? at.items(1, 100) : std::vector<YamlCursor>())
  {
    entry.sharesKeysOf("tracked.N.test_functions");
    const FunctionSet set = readFunctionSet(entry, true, tractions, used, context, guide, tracked, cloth);
    for (const FunctionSet& other : tracking->sets)
    {
      if (!set.name.empty() && other.name == set.name)
        entry.find("name").problem("is also the name of another set; names must differ");
      if (set.from && other.from == set.from)
        entry.find("from").problem("is also when set " + other.name + " takes over; times must differ");
    }
    tracking->sets.push_back(set);
  }
  const bool good = std::all_of(tracking->sets.begin(), tracking->sets.end(),
                                [](const FunctionSet& set) { return set.constraints != nullptr; });
  for (std::size_t t = 0; good && t < tractions.size(); ++t)
    if (!used[t])
      tractions[t].at.problem("is for a test function that is not there");
  return tracking;
}

ClothConfig readTrackedCloth(const YamlCursor& at, const ReadContext& context, const std::vector<ClothConfig>& cloths,
                             const std::string& default_name)
{
  ClothConfig cloth;
  cloth.name = default_name;
  cloth.place = at.place();
  YamlMap map(at);
  map.getName(cloth.name,
              "Name of the cloth, which topics, tables and other keys use. Without the key: tracked if there is one, "
              "otherwise tracked0, tracked1, ...");
  const YamlCursor at_functions =
      map.get("test_functions",
              "Averages of the cloth that are prescribed: a map, or a list of maps with names that take over from each "
              "other. Without the key: `{basis: subdivision}`.");
  at_functions.takes("a list of maps");
  const std::vector<Traction> tractions =
      readTractions(map.get("max_traction",
                            "Largest force per area with which averages are enforced: a number, or numbers by the "
                            "names of test functions. Without the key averages are met at whatever force it takes."));
  const GuideSource guide = readGuide(map.require("guide", "The guide, a coarse mesh: give `mesh`, `grid` or `cloth`."),
                                      context, cloths, cloth.name);
  const TrackedMesh tracked = readTrackedMesh(map.get("mesh",
                                                      "Mesh that tracks the guide: `same` as the guide's, `{subdivide: "
                                                      "N}`, or a mesh file of its own. Without the key: same."),
                                              context, guide);
  if (tracked.good)
    cloth.mesh = tracked.subdivision.mesh;
  if (tracked.kind != TrackedMesh::separate)
  {
    cloth.grid = guide.grid;
    cloth.warp = guide.grid ? Eigen::Vector3d(guide.grid->sides[0].normalized()) : cloth.warp;
  }
  if (tracked.good && tracked.kind != TrackedMesh::separate)
  {
    Eigen::Matrix3Xd points, velocities;
    guide.config.evaluate(0.0, points, &velocities);
    cloth.start = points * tracked.subdivision.weights.transpose();
    cloth.start_velocity = velocities * tracked.subdivision.weights.transpose();
  }
  readClothTraits(map, context, cloth);
  if (tracked.good && guide.config.mesh.vertices.cols() > 0)
    cloth.tracking = readTracking(at_functions, tractions, context, guide, tracked, cloth);
  return cloth;
}

}   // namespace

void readTrackedCloths(const YamlCursor& at, const ReadContext& context, std::vector<ClothConfig>& cloths)
{
  std::map<std::string, std::string> names;   // to what has it
  for (const ClothConfig& cloth : cloths)
    names.emplace(cloth.name, "a cloth");
  const auto readOne = [&](const YamlCursor& entry, const ReadContext&, const std::string& default_name) {
    return readTrackedCloth(entry, context, cloths, default_name);
  };
  auto tracked = readNamed(at, 1000, "tracked", context, readOne, std::move(names));
  std::move(tracked.begin(), tracked.end(), std::back_inserter(cloths));
}

}   // namespace slender
