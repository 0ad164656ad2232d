// The guide of a tracked cloth: its mesh and how it moves.
#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "read_tracking.h"
#include "slender_sim/geometry/mesh_defects.h"
#include "slender_sim/scene/file_paths.h"
#include "slender_sim/scene/pose_file.h"
#include "slender_sim/scene/recorded_guide.h"

namespace slender {

namespace {

/// Files that a path with one '*' in its last part stands for, by the number in place of the star. Throws
/// std::runtime_error naming a folder that is not there, a file without a number, and numbers that are missing or come
/// twice.
std::vector<std::string> matchingFiles(const std::string& pattern)
{
  const std::filesystem::path path(pattern);
  const std::filesystem::path folder = path.parent_path().empty() ? "." : path.parent_path();
  const std::string name = path.filename().string();
  const auto star = name.find('*');
  const std::string head = name.substr(0, star), tail = name.substr(star + 1);
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    throw std::runtime_error("there is no folder " + folder.string());
  std::vector<std::pair<long, std::string>> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
  {
    const std::string file = entry.path().filename().string();
    if (file.size() < head.size() + tail.size() || file.compare(0, head.size(), head) != 0 ||
        file.compare(file.size() - tail.size(), tail.size(), tail) != 0)
      continue;
    const std::string middle = file.substr(head.size(), file.size() - head.size() - tail.size());
    if (middle.empty() || middle.size() > 9 || middle.find_first_not_of("0123456789") != std::string::npos)
    {
      throw std::runtime_error(entry.path().string() +
                               " matches, but has no frame's number in place of the star; move it elsewhere");
    }
    found.emplace_back(std::stol(middle), entry.path().string());
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> files;
  for (std::size_t k = 0; k < found.size(); ++k)
  {
    const long stride = k > 0 ? found[1].first - found[0].first : 0,
               here = k > 0 ? found[k].first - found[k - 1].first : 0;
    if (k > 0 && here == 0)
      throw std::runtime_error(found[k - 1].second + " and " + found[k].second + " are the same frame");
    if (here != stride)   // every so manieth frame is fine
    {
      const std::size_t gap = here > stride ? k : 1;
      throw std::runtime_error("frame " + std::to_string(found[gap - 1].first + std::min(here, stride)) +
                               " is missing between " + found[gap - 1].second + " and " + found[gap].second);
    }
    files.push_back(found[k].second);
  }
  return files;
}

std::optional<GuideMotion> readFrames(const YamlCursor& at, double rate, double begin, const ReadContext& context,
                                      const GuideSource& source)
{
  const auto pattern = at.text();
  if (!pattern || source.config.mesh.vertices.cols() == 0)
    return std::nullopt;
  const auto star = pattern->find('*');
  if (star == std::string::npos || pattern->find('*', star + 1) != std::string::npos ||
      pattern->find('/', star) != std::string::npos)
    return at.problem("must have one * in the name of the file, for example guide/frame_*.obj");
  std::vector<std::string> files;
  if (!at.attempt([&] { files = matchingFiles(context.resolve(*pattern)); }))
    return std::nullopt;
  if (files.empty())
    return at.problem("no such file; there must be at least one");
  const TriangleMesh& mesh = source.config.mesh;
  if (3 * static_cast<std::size_t>(mesh.vertices.cols()) * files.size() > kMaxGuideNumbers)
  {
    return at.problem("has " + std::to_string(files.size()) +
                      " frames, too many for memory; leave out some and lower the rate");
  }
  FrameGuide guide;
  const bool good = at.attempt([&] {
    for (std::size_t k = 0; k < files.size(); ++k)
    {
      requireRegularFile(files[k]);
      TriangleMesh frame = readMesh(files[k]);
      if (frame.vertices.cols() != mesh.vertices.cols() || frame.triangles != mesh.triangles)
      {
        throw std::runtime_error(files[k] + " has " + std::to_string(frame.vertices.cols()) + " vertices and " +
                                 std::to_string(frame.triangles.cols()) + " triangles, the guide's mesh has " +
                                 std::to_string(mesh.vertices.cols()) + " and " +
                                 std::to_string(mesh.triangles.cols()) +
                                 "; all frames must have the mesh's triangles, in its order");
      }
      if (source.file)
        source.file->place(frame.vertices);
      requireCoordinates(frame.vertices, files[k] + " ");
      guide.points.append(begin + static_cast<double>(k) / rate, frame.vertices);
    }
  });
  if (!good)
    return std::nullopt;
  if (begin <= 0)   // else the guide stands still until then
    guide.points.startInMotion();
  return GuideMotion(std::move(guide));
}

/// Which bodies carry which vertices.
std::optional<CarriedGuide> readGroups(const YamlCursor& at, const ReadContext& context, const GuideSource& source)
{
  const int vertices = static_cast<int>(source.config.mesh.vertices.cols());
  CarriedGuide guide{{}, GuideBinding(Eigen::Matrix3Xd(3, 0), {}, {}), true, {}, false, {}};
  std::vector<GuideBinding::Share> shares;
  const auto add = [&](const std::string& name, const std::vector<int>& group) {
    for (const int vertex : group)
      shares.push_back({vertex, static_cast<int>(guide.bodies.size()), 1.0});
    guide.bodies.push_back(name);
  };
  if (at.isScalar())
    for (const VertexGroup& group : readGroupsOf(at, context, source.file))
      add(group.name, group.vertices);
  else if (at.present())
    for (const auto& [name, list] : at.members("Vertices that the body of this name carries; \"3..7\" is a range."))
      add(name, readIndexList(list, vertices));
  if (vertices == 0 || guide.bodies.empty())
    return std::nullopt;
  const bool good = at.attempt([&] {
    guide.binding = GuideBinding(source.config.mesh.vertices, std::vector<Pose>(guide.bodies.size()), shares);
  });
  return good ? std::make_optional(std::move(guide)) : std::nullopt;
}

/// Takes the poses of those bodies that carry vertices.
void takeBodyPoses(const YamlCursor& at, const std::vector<BodyTrajectory>& recorded, CarriedGuide& guide)
{
  std::vector<std::string> names;
  for (const BodyTrajectory& body : recorded)
    names.push_back(body.body);
  for (const std::string& name : guide.bodies)
  {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
    {
      at.problem("has no body " + name + ", which carries vertices; it has: " + joinWords(names));
      return;
    }
    guide.poses.push_back(recorded[found - names.begin()].poses);
  }
}

/// The keys of a guide's motion, and which kind of motion they stand for.
struct MotionKeys
{
  YamlCursor frames, bodies, topic, bag, tf, offset, rate, begin, groups, attach, late;
  bool by_points = false;   ///< by topic
  bool by_bodies = false;   ///< by file, bag or topic
};

/// Reports keys that are for another kind of motion.
void refuseOtherKeys(const MotionKeys& keys)
{
  const auto only_for = [](const YamlCursor& key, bool fits, const char* what) {
    if (key.present() && !fits)
      key.problem(std::string("is for ") + what);
  };
  only_for(keys.rate, keys.frames.present(), "frames");
  only_for(keys.begin, keys.frames.present() || keys.bag.present(), "frames and bags");
  only_for(keys.groups, keys.by_bodies, "bodies");
  only_for(keys.attach, keys.by_bodies || keys.tf.present(), "bodies and tf");
  only_for(keys.late, keys.topic.present() || keys.tf.present(), "guides by topic or tf");
  only_for(keys.offset, keys.tf.present(), "tf");
}

/// Nothing, after a report, unless the keys say one kind of motion.
std::optional<MotionKeys> readMotionKeys(const YamlCursor& at)
{
  YamlMap map(at);
  MotionKeys keys{
      map.get("frames",
              "One mesh file per frame: a path with one * in place of the frame's number, for example "
              "guide/frame_*.obj. Give one of `frames`, `bodies`, `bag`, `topic` and `tf`."),
      map.get("bodies",
              "CSV file with the columns t,body,x,y,z,qx,qy,qz,qw of bodies that carry vertices of the guide, see "
              "`groups`."),
      map.get(
          "topic",
          "The guide comes by messages: its vertices on `guide/points`, or bodies that carry them on `guide/bodies`."),
      map.get("bag",
              "Bag with the recorded motion of the guide: the path of the file, or a map if the bag holds several "
              "motions."),
      map.get("tf", "Name of a frame of tf that carries the whole guide; a node looks it up."),
      map.get("offset",
              "With `tf`: pose of the mesh in the frame. Without the key, the mesh is carried as `attach` says."),
      map.get("rate", "Frames per second; needed with `frames`."),
      map.get("begin",
              "Time of the first frame in the scene; of a bag, the time after its first stamp at which the scene "
              "begins. Without the key: 0."),
      map.get("groups",
              "Vertices that each body carries: obj for the groups of the guide's OBJ file, or a map from bodies to "
              "vertices. Needed for bodies."),
      map.get("attach",
              "Which frame the poses of bodies describe. `initial`: bodies carry the vertices from where both are at "
              "first. `frame`: the guide's mesh is given in the frames of the bodies. Without the key: initial."),
      map.get("late",
              "What the guide does when no message comes: hold the last one, or go on at the last speed, which dies "
              "out. Without the key: hold.")};
  map.finish();
  if (!map.hasOne({keys.frames, keys.bodies, keys.topic, keys.bag, keys.tf},
                  "must be fixed or one of {frames: DIR/NAME_*.obj, rate: HZ}, {bodies: FILE.csv, groups: obj}, {bag: "
                  "FILE.bag}, {topic: points}, {topic: bodies, groups: obj}, {tf: FRAME}"))
    return std::nullopt;
  const std::optional<bool> chosen = keys.topic.choice<bool>({{"points", true}, {"bodies", false}});
  if (keys.topic.present() && !chosen)
    return std::nullopt;
  keys.by_points = chosen.value_or(false);
  keys.by_bodies = keys.bodies.present() || (keys.topic.present() && !keys.by_points) ||
                   (keys.bag.present() && keys.groups.present());
  refuseOtherKeys(keys);
  return keys;
}

/// A guide whose vertices ride on bodies. `first`: time of a bag [s] at which the scene begins.
void readCarriedMotion(const YamlCursor& at, const MotionKeys& keys, const ReadContext& context, double first,
                       const std::string& object, GuideSource& source)
{
  if (!keys.groups.present())
  {
    YamlMap(at).missing("groups");
    return;
  }
  auto carried = readGroups(keys.groups, context, source);
  if (!carried)
    return;
  assign(carried->keeps_offset, keys.attach.choice<bool>({{"initial", true}, {"frame", false}}));
  if (keys.bag.present())
  {
    const auto recorded = readBag(keys.bag, context, true, first, object);
    if (!recorded)
      return;
    takeBodyPoses(keys.bag, recorded->bodies, *carried);
  }
  else if (const auto file = keys.bodies.text())
  {
    keys.bodies.attempt([&] { takeBodyPoses(keys.bodies, readPoseFile(context.resolve(*file)), *carried); });
  }
  if (keys.topic.present() || carried->poses.size() == carried->bodies.size())   // else reported
    source.config.motion = std::move(*carried);
}

void readGuideMotion(const YamlCursor& at, const ReadContext& context, const std::string& object, GuideSource& source)
{
  GuideMotion& motion = source.config.motion;
  if (!at.present())
    return;
  if (at.isScalar())
  {
    at.choice<bool>({{"fixed", true}});
    return;
  }
  const std::optional<MotionKeys> keys = readMotionKeys(at);
  if (!keys)
    return;
  assign(source.config.coast, readLate(keys->late));
  const double first = keys->begin.number(Range::closed(-1e6, 1e6, "s")).value_or(0.0);
  if (keys->frames.present())
  {
    if (!keys->rate.present())
      YamlMap(at).missing("rate");
    if (const auto hertz = keys->rate.number(Range::above(0, 1e6, "Hz")))
      assign(motion, readFrames(keys->frames, *hertz, first, context, source));
  }
  else if (keys->tf.present())
  {
    readFramedMotion(keys->tf, keys->offset, keys->attach, source.config);
  }
  else if (keys->by_points)
  {
    motion = TopicGuide{};
  }
  else if (keys->bag.present() && !keys->by_bodies)
  {
    readBagPoints(keys->bag, context, first, object, source);
  }
  else
  {
    readCarriedMotion(at, *keys, context, first, object, source);
  }
}

/// A cloth of the scene as the guide.
void readPreview(const YamlCursor& at, const std::vector<ClothConfig>& cloths, GuideSource& source)
{
  const auto name = at.name();
  if (!name)
    return;
  std::vector<std::string> names;
  for (std::size_t k = 0; k < cloths.size(); ++k)
  {
    const ClothConfig& cloth = cloths[k];
    if (cloth.tracking)
      continue;
    names.push_back(cloth.name);
    if (cloth.name == *name)
    {
      source.config.mesh = cloth.mesh;
      source.grid = cloth.grid;
      ClothGuide guide{static_cast<int>(k), cloth.start.cols() ? cloth.start : cloth.mesh.vertices,
                       cloth.start_velocity};
      if (guide.velocity.cols() == 0)
        guide.velocity.setZero(3, guide.start.cols());
      source.config.motion = std::move(guide);
      return;
    }
  }
  at.problem(names.empty() ? "there is no such cloth: the scene has no cloths: [{...}]"
                           : "there is no such cloth; the scene's cloths are: " + joinWords(names));
}

}   // namespace

std::optional<double> readLate(const YamlCursor& at)
{
  if (!at.isMap())
    return at.choice<double>({{"hold", 0.0}, {"extrapolate", 0.2}});
  YamlMap map(at);
  std::optional<double> coast;
  map.require("extrapolate", coast, Range::above(0, 60, "s"),
              "Time within which the last speed dies out. The word extrapolate alone means 0.2 s.");
  return coast;
}

std::vector<VertexGroup> readGroupsOf(const YamlCursor& at, const ReadContext& context,
                                      const std::optional<MeshFile>& file)
{
  std::vector<VertexGroup> groups;
  if (!at.choice<bool>({{"obj", true}}))
    return groups;
  at.attempt([&] {
    if (!file)
    {
      throw std::runtime_error(
          "needs a mesh from an OBJ file, whose groups (g NAME) it takes; give {NAME: [vertices]} instead");
    }
    groups = readObjGroups(context.resolve(file->path));
    if (groups.empty())
      throw std::runtime_error(file->path + " has no groups (g NAME); give {NAME: [vertices]} instead");
  });
  return groups;
}

void readFramedMotion(const YamlCursor& tf, const YamlCursor& offset, const YamlCursor& attach, GuideConfig& config)
{
  const auto frame = readFrameName(tf);
  const std::size_t before = tf.problems().size();
  CarriedGuide guide{{}, GuideBinding(Eigen::Matrix3Xd(3, 0), {}, {}), !offset.present(), {}, true, {}};
  assign(guide.offset, readPose(offset));
  assign(guide.keeps_offset, attach.choice<bool>({{"initial", true}, {"frame", false}}));
  if (offset.present() && guide.keeps_offset)
    offset.problem("says where the guide is in the frame, and attach: initial keeps it where it is; give one");
  const Eigen::Matrix3Xd& vertices = config.mesh.vertices;
  if (!frame || vertices.cols() == 0 || tf.problems().size() != before)
    return;
  guide.bodies.push_back(*frame);
  std::vector<GuideBinding::Share> shares;
  for (int vertex = 0; vertex < static_cast<int>(vertices.cols()); ++vertex)
    shares.push_back({vertex, 0, 1.0});
  guide.binding = GuideBinding(vertices, {Pose()}, shares);
  config.motion = std::move(guide);
}

GuideSource readGuide(const YamlCursor& at, const ReadContext& context, const std::vector<ClothConfig>& cloths,
                      const std::string& object)
{
  GuideSource source;
  YamlMap map(at);
  const YamlCursor mesh = map.get("mesh", "Undeformed shape of the guide from a file; it may touch itself.");
  const YamlCursor grid = map.get("grid", "Undeformed shape of the guide as a rectangle.");
  const YamlCursor motion = map.get("motion", "How the guide moves. Without the key: fixed.");
  const YamlCursor cloth =
      map.get("cloth", "Name of a cloth of the scene that is the guide, with its mesh and motion.");
  if (cloth.present())
  {
    for (const YamlCursor& other : {mesh, grid, motion})
      if (other.present())
        other.problem("does not go with cloth, which is mesh and motion of the guide");
    readPreview(cloth, cloths, source);
    return source;
  }
  const bool one = map.hasOne(
      {mesh, grid},
      "must have one of mesh: {file: PATH}, grid: {corner: [...], sides: [[...], [...]], cells: N}, cloth: NAME");
  if (one && grid.present())
  {
    source.grid = readClothGrid(grid, context, source.config.mesh);
  }
  else if (one && (source.file = readMeshFile(mesh.sharesKeysOf("cloths.N.mesh"), context)))
  {
    source.config.mesh = source.file->mesh;
    const std::vector<MeshDefect> defects = topologyDefects(source.config.mesh);   // it may meet itself
    if (!defects.empty())
    {
      mesh.find("file").problem(source.file->path + ": " + defects.front().message);
      source.config.mesh = TriangleMesh{};
    }
  }
  readGuideMotion(motion, context, object, source);
  return source;
}

}   // namespace slender
