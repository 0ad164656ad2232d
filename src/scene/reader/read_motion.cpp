#include <type_traits>

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

/// Says what the keys of a motion mean for one kind of object.
struct MotionTexts
{
  const char *topic, *body, *table;
  std::string kinds;   ///< the motions that this kind may have, for messages
};

/// Reads a motion that is a map: by messages, with a frame of tf, with a body, or by timed poses. It is fixed if a
/// problem was reported.
template <class SomeMotion>
SomeMotion readMap(const YamlCursor& at, const MotionTexts& texts, const ReadContext& context, bool needs_orientation)
{
  SomeMotion motion = FixedMotion{};
  const std::size_t before = at.problems().size();
  YamlMap map(at);
  const YamlCursor topic = map.get("topic", texts.topic);
  const YamlCursor body = map.get("body", texts.body);
  const YamlCursor tf = map.get("tf",
                                "Name of a frame of tf that is followed, for example tool0; a node looks it up, and "
                                "without a node nothing moves.");
  const YamlCursor offset =
      map.get("offset", "With `tf`: pose in the frame of what is moved. Without the key: the frame's own pose.");
  const YamlCursor table = map.get("table", texts.table);
  const YamlCursor file = map.get("file",
                                  "CSV file with the columns t,body,x,y,z,qx,qy,qz,qw. If it holds several bodies, "
                                  "give `body` as well.");
  if (offset.present() && !tf.present())
    offset.problem("is for motion: {tf: FRAME}");
  map.finish();
  constexpr bool may_follow = std::is_same_v<SomeMotion, Motion>;
  const bool follows = body.present() && !file.present();
  const int given = topic.present() + tf.present() + table.present() + (body.present() || file.present());
  if (given != 1 || (follows && !may_follow))
  {
    if (at.problems().size() == before)
      at.problem("must be " + texts.kinds);
    return motion;
  }
  if (topic.present())
  {
    if (!topic.boolean().value_or(true))
      topic.problem("must be true; without a topic it is written motion: fixed");
    motion = TopicMotion{};
  }
  else if (tf.present())
    assign(motion, readTf(tf, offset));
  else if (table.present())
    assign(motion, readTable(table, needs_orientation));
  else if (!follows)
    assign(motion, readFileMotion(file, body, context));
  else if constexpr (may_follow)
    if (const auto name = body.text())
      motion = BodyMotion{*name};
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
  at.sharesKeysOf("rods.N.grasps.NAME.motion");
  if (at.isScalar())
    return at.choice<Motion>({{"fixed", FixedMotion{}}, {"topic", TopicMotion{}}}).value_or(FixedMotion{});
  if (!at.present())
    return FixedMotion{};
  const MotionTexts texts{
      "Must be true: the motion comes by messages. Same as the word topic.",
      "Name of the body to follow: a driven body or an obstacle of the scene, or one that only messages tell of. With "
      "`file`: name of the body in the file.",
      "Timed poses: rows [t, x, y, z, qx, qy, qz, qw], with t in s, lengths in m and a unit quaternion. Poses between "
      "rows are interpolated smoothly.",
      "fixed or one of {topic: true}, {tf: FRAME}, {body: NAME}, {table: [...]}, {file: PATH, body: NAME}"};
  return readMap<Motion>(at, texts, context, needs_orientation);
}

std::optional<GivenMotion> readSolidMotion(const YamlCursor& at, const ReadContext& context, bool may_be_free)
{
  const std::optional<GivenMotion> fixed = GivenMotion{FixedMotion{}};
  at.sharesKeysOf("obstacles.N.motion");
  if (!at.present())
    return may_be_free ? std::nullopt : fixed;
  if (at.isScalar())
  {
    Choices<std::optional<GivenMotion>> words{{"fixed", fixed}, {"topic", GivenMotion{TopicMotion{}}}};
    if (may_be_free)
      words.emplace_back("free", std::nullopt);
    return at.choice(words).value_or(fixed);
  }
  const MotionTexts texts{
      "Must be true: the motion comes by messages on the topic `bodies`, or `nozzle/pose` for a nozzle. Same as the "
      "word topic.",
      "Name of the body in `file`.",
      "Timed poses: rows [t, x, y, z, qx, qy, qz, qw] or [t, x, y, z], with t in s, lengths in m and a unit "
      "quaternion. Poses between rows are interpolated smoothly.",
      std::string(may_be_free ? "free, " : "") +
          "fixed or one of {topic: true}, {tf: FRAME}, {table: [...]}, {file: PATH, body: NAME}"};
  return readMap<GivenMotion>(at, texts, context, false);
}

}   // namespace slender
