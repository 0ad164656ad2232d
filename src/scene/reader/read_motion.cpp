#include <stdexcept>

#include "read_parts.h"
#include "slender_sim/scene/pose_file.h"
#include "slender_sim/scene/reader.h"

namespace slender {

namespace {

std::optional<TableMotion> readTable(const YamlCursor& at, bool needs_orientation)
{
  TableMotion motion;
  bool good = true;
  at.takes("rows [t, x, y, z, qx, qy, qz, qw]; or [t, x, y, z] where no orientation is needed");
  for (const YamlCursor& item : at.items(1))
  {
    const auto row = item.numbers(Range::closed(-1e9, 1e9));
    if (!row)
    {
      good = false;
      continue;
    }
    if (row->size() != 8 && (needs_orientation || row->size() != 4))
    {
      item.problem("has " + std::to_string(row->size()) + " numbers; must be [t, x, y, z, qx, qy, qz, qw]" +
                   (needs_orientation ? "" : " or [t, x, y, z]"));
      good = false;
      continue;
    }
    std::vector<double> numbers = *row;
    if (numbers.size() == 4)
      numbers.insert(numbers.end(), {0, 0, 0, 1});
    try
    {
      appendRecorded(motion.poses, numbers[0], checkedPose(numbers.data() + 1));
    }
    catch (const std::invalid_argument& error)
    {
      item.problem(error.what());
      good = false;
    }
  }
  return good && !motion.poses.empty() ? std::optional<TableMotion>(std::move(motion)) : std::nullopt;
}

/// Reads the motion of the named body, or of the only body in the file.
std::optional<TableMotion> readFileMotion(const YamlCursor& path, const YamlCursor& body, const ReadContext& context)
{
  const auto file = path.text();
  const auto name = body.text();
  if (!file || (body.present() && !name))
    return std::nullopt;
  try
  {
    auto bodies = readPoseFile(context.resolve(*file));
    std::vector<std::string> names;
    for (BodyTrajectory& entry : bodies)
    {
      if (name ? entry.body == *name : bodies.size() == 1)
        return TableMotion{std::move(entry.poses)};
      names.push_back(entry.body);
    }
    body.problem(name ? "is not in " + *file + "; it has: " + joinWords(names)
                      : "is missing; " + *file + " holds several bodies, of which it names one: " + joinWords(names));
  }
  catch (const SceneError& error)
  {
    path.problem(error.what());
  }
  return std::nullopt;
}

void checkTopic(const YamlCursor& topic)
{
  const auto on = topic.boolean();
  if (on && !*on)
    topic.problem("must be true; without a topic it is written motion: fixed");
}

constexpr const char* kTfMeaning =
    "Name of a frame of tf that is followed, for example tool0; a node looks it up, and without a node nothing moves.";
constexpr const char* kTfOffsetMeaning =
    "With `tf`: pose in the frame of what is moved. Without the key: the frame's own pose.";

void refuseOffset(const YamlCursor& offset, const YamlCursor& tf)
{
  if (offset.present() && !tf.present())
    offset.problem("is for motion: {tf: FRAME}");
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

}   // namespace

std::optional<std::string> readFrameName(const YamlCursor& at)
{
  const auto name = at.text();
  if (!name)
    return std::nullopt;
  const std::string frame = name->empty() || name->front() != '/' ? *name : name->substr(1);
  if (frame.empty() || frame.front() == '/' || frame.find_first_of(" \t\n") != std::string::npos)
  {
    at.problem("is no name of a frame of tf; must be one word, for example tool0");
    return std::nullopt;
  }
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
  YamlMap map(at);
  const YamlCursor topic = map.get("topic", "Must be true: the motion comes by messages. Same as the word topic."),
                   body = map.get("body",
                                  "Name of the body to follow: a driven body or an obstacle of the scene, or one that "
                                  "only messages tell of. With `file`: name of the body in the file."),
                   tf = map.get("tf", kTfMeaning), offset = map.get("offset", kTfOffsetMeaning),
                   table = map.get("table",
                                   "Timed poses: rows [t, x, y, z, qx, qy, qz, qw], with t in s, lengths in m and a "
                                   "unit quaternion. Poses between rows are interpolated smoothly."),
                   file = map.get("file",
                                  "CSV file with the columns t,body,x,y,z,qx,qy,qz,qw. If it holds several bodies, "
                                  "give `body` as well.");
  map.finish();
  refuseOffset(offset, tf);
  const int given = topic.present() + tf.present() + table.present() + (body.present() || file.present());
  if (given != 1)
  {
    if (at.problems().size() == before)
    {
      at.problem(
          "must be fixed or one of {topic: true}, {tf: FRAME}, {body: NAME}, {table: [...]}, {file: PATH, body: NAME}");
    }
  }
  else if (topic.present())
  {
    checkTopic(topic);
    motion = TopicMotion{};
  }
  else if (tf.present())
  {
    assign(motion, readTf(tf, offset));
  }
  else if (table.present())
  {
    assign(motion, readTable(table, needs_orientation));
  }
  else if (file.present())
  {
    assign(motion, readFileMotion(file, body, context));
  }
  else if (const auto name = body.text())
  {
    motion = BodyMotion{*name};
  }
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
  YamlMap map(at);
  const YamlCursor topic = map.get("topic",
                                   "Must be true: the motion comes by messages on the topic `bodies`, or `nozzle/pose` "
                                   "for a nozzle. Same as the word topic."),
                   tf = map.get("tf", kTfMeaning), offset = map.get("offset", kTfOffsetMeaning),
                   body = map.get("body", "Name of the body in `file`."),
                   table = map.get("table",
                                   "Timed poses: rows [t, x, y, z, qx, qy, qz, qw] or [t, x, y, z], with t in s, "
                                   "lengths in m and a unit quaternion. Poses between rows are interpolated smoothly."),
                   file = map.get("file",
                                  "CSV file with the columns t,body,x,y,z,qx,qy,qz,qw. If it holds several bodies, "
                                  "give `body` as well.");
  map.finish();
  refuseOffset(offset, tf);
  std::optional<TableMotion> poses;
  const int given = topic.present() + tf.present() + table.present() + (body.present() || file.present());
  if (given != 1 || (body.present() && !file.present()))
  {
    if (at.problems().size() == before)
    {
      at.problem(std::string("must be ") + (may_be_free ? "free, " : "") +
                 "fixed or one of {topic: true}, {tf: FRAME}, {table: [...]}, {file: PATH, body: NAME}");
    }
  }
  else if (tf.present())
  {
    const auto motion = readTf(tf, offset);
    return motion ? GivenMotion{*motion} : fixed;
  }
  else if (topic.present())
  {
    checkTopic(topic);
    return GivenMotion{TopicMotion{}};
  }
  else
  {
    poses = table.present() ? readTable(table, false) : readFileMotion(file, body, context);
  }
  return poses ? GivenMotion{std::move(*poses)} : fixed;
}

}   // namespace slender
