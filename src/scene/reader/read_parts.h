#pragma once

#include <map>
#include <optional>
#include <string>

#include "slender_sim/scene/config.h"
#include "yaml_cursor.h"

/// The parts of a scene's reader, one file each. All report into the cursor's Problems and return what could be read.
namespace slender {

#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION   // scenes that are read in a millisecond
constexpr int max_edges = 1000;
constexpr double kMaxSceneNodes = 1000;
#else
constexpr int max_edges = 1'000'000;
constexpr double kMaxSceneNodes = 1e7;
#endif

inline const Range kCoordinate = Range::closed(-kMaxCoordinate, kMaxCoordinate, "m");
inline const Range kLength = Range::above(0, kMaxCoordinate, "m");

/// What the parts need to know of the scene around them.
struct ReadContext
{
  std::string directory;   ///< files are relative to it
  Eigen::Vector3d gravity{0, 0, -9.81};
  double step = 0.01;                            ///< time.step [s]
  mutable double nodes = 0;                      ///< number of nodes of rods and cloths so far
  mutable std::vector<std::string> guide_bags;   ///< paths of the bags that were read so far
  std::string resolve(const std::string& path) const { return path[0] == '/' ? path : directory + "/" + path; }
  /// Counts nodes that are about to be made; false, and reported, when the scene gets too many: a few words can ask for
  /// more than fits into memory.
  bool claim(const YamlCursor& at, double more) const;
};

/// Entries of a list; none if there is no list, which somebody else reports.
inline std::vector<YamlCursor> entriesOf(const YamlCursor& list)
{
  return list.isList() ? list.items() : std::vector<YamlCursor>{};
}
/// Reports a name that another object has. `names` says what has each of them.
void takeName(std::map<std::string, std::string>& names, const YamlCursor& entry, const std::string& name);
/// Reads the entries of a list by read(entry, context, default name). The default name is `word`, with a number if
/// there are several entries. Reports a list with too few or too many entries. Without a list there are no entries.
template <class Read>
auto readEach(const YamlCursor& list, std::size_t fewest, std::size_t most, const std::string& word,
              const ReadContext& context, const Read& read)
{
  std::vector<decltype(read(list, context, word))> objects;
  const std::vector<YamlCursor> entries = list.items(fewest, most);
  for (const YamlCursor& entry : entries)
    objects.push_back(read(entry, context, entries.size() == 1 ? word : word + std::to_string(objects.size())));
  return objects;
}
/// The same for objects that may not have the names of others of them, or those in `names`.
template <class Read>
auto readNamed(const YamlCursor& list, std::size_t most, const std::string& word, const ReadContext& context,
               const Read& read, std::map<std::string, std::string> names = {})
{
  const auto readOne = [&](const YamlCursor& entry, const ReadContext&, const std::string& default_name) {
    auto object = read(entry, context, default_name);
    takeName(names, entry, object.name);
    return object;
  };
  return readEach(list, 1, most, word, context, readOne);
}
/// A map with one key, which says of which kind a thing is, and whose value has the keys of this kind.
template <class Thing>
class KindMap
{
public:
  explicit KindMap(const YamlCursor& at) : kinds_(at) {}

  /// A kind, whose things read(map) makes.
  template <class Read>
  void add(const char* kind, const char* meaning, const Read& read)
  {
    names_.push_back(kind);
    const YamlCursor value = kinds_.get(kind, meaning);
    if (!value.present())
      return;
    given_.push_back(value);
    YamlMap map(value);
    thing_ = read(map);
  }
  /// The thing; nothing when something was reported. `things`: the word for several of them.
  std::optional<Thing> read(const char* things)
  {
    kinds_.finish();
    if (given_.size() != 1 && kinds_.sound())
    {
      kinds_.at().problem("names " + std::to_string(given_.size()) + " " + things +
                          "; must name one of: " + joinWords(names_));
    }
    return kinds_.sound() ? thing_ : std::nullopt;
  }
  /// The value of the kind that is given.
  const YamlCursor& value() const { return given_.front(); }

private:
  YamlMap kinds_;
  std::vector<std::string> names_;
  std::vector<YamlCursor> given_;
  std::optional<Thing> thing_;
};
/// Throws std::runtime_error "`what` has coordinates beyond ... m `where`" if points are farther away than any may be.
void requireCoordinates(const Eigen::Matrix3Xd& points, const std::string& what = "", const std::string& where = "");
/// Whole numbers of [0, count), sorted; an entry "3..7" stands for all between, negative ones count from the end.
/// `count` 0: not known, not checked. Empty when reported.
std::vector<int> readIndexList(const YamlCursor& at, int count);
std::optional<Curve> readCurve(const YamlCursor& at, const ReadContext& context);
/// Nodes held when edges first..last of the rod are (see GraspConfig); reports the joining edge of a closed rod.
std::pair<int, int> nodesOfEdges(const YamlCursor& at, int first, int last, const RodConfig& rod);
/// Returns true if the entry of a grasp gives its pose in the frame that it follows.
bool givesOffset(const YamlMap& grasp);
/// Reads `offset` of a grasp. Call it after `motion` and `attach` were read. Reports an offset that does not fit them.
void readOffset(YamlMap& map, GraspConfig& grasp);
LimitsConfig readLimits(const YamlCursor& at);
GraspLimits readGraspLimits(const YamlCursor& at);
GraspConfig readGrasp(const std::string& name, const YamlCursor& at, const ReadContext& context, const RodConfig& rod);
/// Reads the point loads of a rod.
std::vector<RodLoadConfig> readRodLoads(const YamlCursor& at, const RodConfig& rod);
CrossSection readCrossSection(const YamlCursor& at, int edges);
/// Warns that contact treats elliptical sections of a rod as circles. Call this after its cross-section and its contact
/// have been read.
void warnOfRoundContact(const YamlCursor& at_section, const RodConfig& rod);
Material readMaterial(const YamlCursor& at);
Damping readDamping(const YamlCursor& at);
/// What rods of a scene and those of a generator have in common: curvature, formulation, material, damping, contact.
void readTraits(YamlMap& map, RodConfig& rod);
/// Reads `track` of a rod, after all its other keys. Returns null if there is no such key, or if something was
/// reported.
std::shared_ptr<const TrackingConfig> readTrackedCurve(const YamlCursor& at, const ReadContext& context,
                                                       const RodConfig& rod);
RodConfig readRod(const YamlCursor& at, const ReadContext& context, const std::string& default_name);

/// What the generators of a scene make, each with the place that asked for it. Welds count rods from `first_rod`.
struct Generated
{
  std::vector<std::pair<RodConfig, YamlCursor>> rods;
  std::vector<std::pair<ObstacleConfig, YamlCursor>> obstacles;
  std::vector<std::pair<BodyConfig, YamlCursor>> bodies;
};
/// The list `generate`; `first_rod`: number of rods before them.
Generated readGenerators(const YamlCursor& at, const ReadContext& context, int first_rod);

/// A grasp of a rod or cloth that a list of the scene has, and its place there.
struct ListedGrasp
{
  const GraspConfig& config;
  YamlCursor at;
  bool of_cloth;
};

/// Reads `contact` of a grasp.
void readGraspContact(YamlMap& map, GraspConfig& grasp);
/// Reports names in `contact.ignore` of grasps that belong to no obstacle and no link. Call it after all objects were
/// read.
void checkIgnoredContacts(const SceneConfig& scene, const std::vector<ListedGrasp>& grasps);
Motion readMotion(const YamlCursor& at, const ReadContext& context, bool needs_orientation);
/// Nothing: free, which is also the default where it may be.
std::optional<GivenMotion> readSolidMotion(const YamlCursor& at, const ReadContext& context, bool may_be_free);
/// Reads the name of a frame of tf and removes a leading slash. Returns nothing if a problem was reported.
std::optional<std::string> readFrameName(const YamlCursor& at);
std::optional<Pose> readPose(const YamlCursor& at);
/// Sets the pose at the start to the first pose of a table. Reports at `at` if there is a pose already.
void startAtTable(const GivenMotion& motion, const YamlCursor& at, const std::string& what, std::optional<Pose>& pose);
/// `pose` may be replaced by the shape (a plane by point and normal).
std::optional<Shape> readShape(const YamlCursor& at, const ReadContext& context, std::optional<Pose>& pose);
/// What a rod, a thread or a cloth touches. `others`: the key for contact with objects of the same kind. Cloth has the
/// keys `thickness` and `method` as well.
std::optional<ContactProperties> readContactProperties(const YamlCursor& at, const char* others, bool of_cloth = false);
ThreadConfig readThread(const YamlCursor& at, const ReadContext& context, const std::string& default_name);
/// Chooses the edges and the break-up radius of threads whose entries `at` do not give them, and says what is not
/// resolved. All other objects of the scene, its gravity and its time have been read.
void completeThreads(SceneConfig& scene, const std::vector<YamlCursor>& at);
ClothConfig readCloth(const YamlCursor& at, const ReadContext& context, const std::string& default_name);
/// The list `tracked`: appends to the cloths.
void readTrackedCloths(const YamlCursor& at, const ReadContext& context, std::vector<ClothConfig>& cloths);
/// The contact methods of the cloths have been chosen.
ContactConfig readContact(const YamlCursor& at, const SceneConfig& scene);
ObstacleConfig readObstacle(const YamlCursor& at, const ReadContext& context, const std::string& default_name);
/// Reads robots. Returns the obstacles for their collision shapes, each with the entry of its robot.
std::vector<std::pair<ObstacleConfig, YamlCursor>> readRobots(const YamlCursor& at, const ReadContext& context);
/// Replaces names of ROS parameters in `robot` by their texts, so that the scene is complete. Returns true if there
/// were such names. `directory` is the folder of the scene.
bool takeRobotParameters(YamlTree& scene, const std::string& directory);
std::vector<BodyConfig> readBodies(const YamlCursor& at, const ReadContext& context,
                                   const std::vector<RodConfig>& rods);
TimeConfig readTime(const YamlCursor& at);
/// Chooses the integrator if the scene names none. Reports integrators and options that the objects of the scene do not
/// support. Call it when all objects are read. `time` is the value of the key `time`.
void chooseIntegrator(YamlMap& map, const YamlCursor& time, SceneConfig& scene);
RecordConfig readRecord(const YamlCursor& at);
StartConfig readStart(const YamlCursor& at);
/// Warns of keys of a sound scene that do nothing beside its other keys. `map`: the whole scene, from which `scene` was
/// read.
void warnOfIgnoredKeys(YamlMap& map, const SceneConfig& scene);
/// Nothing without the key.
std::optional<StaticsConfig> readStatics(const YamlCursor& at);
/// Reports what statics cannot do with this scene; called when all objects have been read.
void checkStatics(const YamlCursor& at, const SceneConfig& scene);
/// Reports fields that nothing in the scene has, and finds the nodes that are chosen; called when all objects have been
/// read.
void completeRecord(const YamlCursor& at, SceneConfig& scene);

}   // namespace slender
