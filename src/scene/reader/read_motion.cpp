
#include "read_parts.h"
#include "slender_sim/scene/pose_file.h"

namespace slender {

namespace {

std::optional<TableMotion> readTable(const YamlCursor& at, bool needs_orientation)
{
  TableMotion motion;
  const std::size_t before = at.problems().size();
  at.takes("rows [t, x, y, z, qx, qy, qz, qw]; or [t, x, y, z] where no orientation is needed");
  for (const YamlCursor& item : at.items(1))
  {
    const auto row = item.numbers(Range::closed(-1e9, 1e9));
    if (!row)
      continue;
    if (row->size() != 8 && (needs_orientation || row->size() != 4))
    {
      item.problem("has " + std::to_string(row->size()) + " numbers; must be [t, x, y, z, qx, qy, qz, qw]" +
                   (needs_orientation ? "" : " or [t, x, y, z]"));
      continue;
    }
    std::vector<double> numbers = *row;
    if (numbers.size() == 4)
      numbers.insert(numbers.end(), {0, 0, 0, 1});
    item.attempt([&] { appendRecorded(motion.poses, numbers[0], checkedPose(numbers.data() + 1)); });
  }
  return at.problems().size() == before && !motion.poses.empty() ? std::optional<TableMotion>(std::move(motion))
                                                                 : std::nullopt;
}

/// Reads the motion of the named body, or of the only body in the file.
std::optional<TableMotion> readFileMotion(const YamlCursor& path, const YamlCursor& body, const ReadContext& context)
{
  const auto file = path.text();
  const auto name = body.text();
  std::vector<BodyTrajectory> bodies;
  if (!file || (body.present() && !name) || !path.attempt([&] { bodies = readPoseFile(context.resolve(*file)); }))
    return std::nullopt;
  std::vector<std::string> names;
  for (BodyTrajectory& entry : bodies)
  {
    if (name ? entry.body == *name : bodies.size() == 1)
      return TableMotion{std::move(entry.poses)};
    names.push_back(entry.body);
  }
  return body.problem(name ? "is not in " + *file + "; it has: " + joinWords(names)
                           : "is missing; " + *file +
                                 " holds several bodies, of which it names one: " + joinWords(names));
}

/// The keys that say how something moves.
struct PoseKeys
{
  YamlCursor topic, body, tf, offset, table, file;

  /// Number of ways in which they say it.
  int given() const { return topic.present() + tf.present() + table.present() + (body.present() || file.present()); }
};

/// Reads the keys, of which some mean different things for different objects.
PoseKeys readPoseKeys(const YamlCursor& at, const char* topic, const char* body, const char* table)
{
  YamlMap map(at);
  PoseKeys keys{
      map.get("topic", topic),
      map.get("body", body),
      map.get("tf",
              "Name of a frame of tf that is followed, for example tool0; a node looks it up, and without a "
              "node nothing moves."),
      map.get("offset", "With `tf`: pose in the frame of what is moved. Without the key: the frame's own pose."),
      map.get("table", table),
      map.get("file",
              "CSV file with the columns t,body,x,y,z,qx,qy,qz,qw. If it holds several bodies, give `body` "
              "as well.")};
  if (keys.offset.present() && !keys.tf.present())
    keys.offset.problem("is for motion: {tf: FRAME}");
  return keys;
}

/// Returns nothing if a problem was reported.
std::optional<TfMotion> readTf(const YamlCursor& tf, const YamlCursor& offset)
{
  TfMotion motion;
  const auto frame = readFrameName(tf);
  const std::size_t before = offset.problems().size();
  assign(motion.offset, readPose(offset));
  if (!frame || offset.problems().size() != before)
    return std::nullopt;
  motion.frame = *frame;
  return motion;
}

/// Reads the motion that the keys give in one way: by messages, with a frame of tf, or by timed poses. It is fixed if a
/// problem was reported.
template <class SomeMotion>
SomeMotion readKeys(const PoseKeys& keys, const ReadContext& context, bool needs_orientation)
{
  SomeMotion motion = FixedMotion{};
  if (keys.topic.present())
  {
    if (!keys.topic.boolean().value_or(true))
      keys.topic.problem("must be true; without a topic it is written motion: fixed");
    motion = TopicMotion{};
  }
  else if (keys.tf.present())
    assign(motion, readTf(keys.tf, keys.offset));
  else if (keys.table.present())
    assign(motion, readTable(keys.table, needs_orientation));
  else
    assign(motion, readFileMotion(keys.file, keys.body, context));
  return motion;
}

}   // namespace

std::optional<std::string> readFrameName(const YamlCursor& at)
{
  const auto name = at.text();
  if (!name)
    return std::nullopt;
  const std::string frame = name->empty() || name->front() != '/' ? *name : name->substr(1);
  if (frame.empty() || frame.front() == '/' || frame.find_first_of(" \t\n") != std::string::npos)
    return at.problem("is no name of a frame of tf; must be one word, for example tool0");
  return frame;
}

Motion readMotion(const YamlCursor& at, const ReadContext& context, bool needs_orientation)
{
  Motion motion = FixedMotion{};
  at.sharesKeysOf("rods.N.grasps.NAME.motion");
  if (!at.present())
    return motion;
  if (at.isScalar())
  {
    assign(motion, at.choice<Motion>({{"fixed", FixedMotion{}}, {"topic", TopicMotion{}}}));
    return motion;
  }
  const std::size_t before = at.problems().size();
  const PoseKeys keys = readPoseKeys(
      at, "Must be true: the motion comes by messages. Same as the word topic.",
      "Name of the body to follow: a driven body or an obstacle of the scene, or one that only messages tell of. With "
      "`file`: name of the body in the file.",
      "Timed poses: rows [t, x, y, z, qx, qy, qz, qw], with t in s, lengths in m and a unit quaternion. Poses between "
      "rows are interpolated smoothly.");
  if (keys.given() != 1 && at.problems().size() == before)
  {
    at.problem(
        "must be fixed or one of {topic: true}, {tf: FRAME}, {body: NAME}, {table: [...]}, {file: PATH, body: NAME}");
  }
  if (keys.given() != 1)
    return motion;
  if (!keys.body.present() || keys.file.present())
    return readKeys<Motion>(keys, context, needs_orientation);
  if (const auto name = keys.body.text())
    motion = BodyMotion{*name};
  return motion;
}

std::optional<GivenMotion> readSolidMotion(const YamlCursor& at, const ReadContext& context, bool may_be_free)
{
  const std::optional<GivenMotion> fixed = GivenMotion{FixedMotion{}};
  at.sharesKeysOf("obstacles.N.motion");
  if (!at.present())
    return may_be_free ? std::nullopt : fixed;
  if (at.isScalar())
  {
    std::vector<std::pair<std::string, std::optional<GivenMotion>>> words{{"fixed", fixed},
                                                                          {"topic", GivenMotion{TopicMotion{}}}};
    if (may_be_free)
      words.emplace_back("free", std::nullopt);
    return at.choice(words).value_or(fixed);
  }
  const std::size_t before = at.problems().size();
  const PoseKeys keys = readPoseKeys(
      at,
      "Must be true: the motion comes by messages on the topic `bodies`, or `nozzle/pose` for a nozzle. Same as the "
      "word topic.",
      "Name of the body in `file`.",
      "Timed poses: rows [t, x, y, z, qx, qy, qz, qw] or [t, x, y, z], with t in s, lengths in m and a unit "
      "quaternion. "
      "Poses between rows are interpolated smoothly.");
  if (keys.given() == 1 && (keys.file.present() || !keys.body.present()))
    return readKeys<GivenMotion>(keys, context, false);
  if (at.problems().size() == before)
  {
    at.problem(std::string("must be ") + (may_be_free ? "free, " : "") +
               "fixed or one of {topic: true}, {tf: FRAME}, {table: [...]}, {file: PATH, body: NAME}");
  }
  return fixed;
}

}   // namespace slender
