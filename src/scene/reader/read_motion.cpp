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

std::optional<TableMotion> readFileMotion(const YamlCursor& path, const YamlCursor& body, const ReadContext& context)
{
  const auto file = path.text();
  const auto name = body.text();
  if (!file || !name)
    return std::nullopt;
  try
  {
    auto bodies = readPoseFile(context.resolve(*file));
    std::vector<std::string> names;
    for (BodyTrajectory& entry : bodies)
    {
      if (entry.body == *name)
        return TableMotion{std::move(entry.poses)};
      names.push_back(entry.body);
    }
    body.problem("is not in " + *file + "; it has: " + joinWords(names));
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

}   // namespace

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
                   table = map.get("table",
                                   "Timed poses: rows [t, x, y, z, qx, qy, qz, qw], with t in s, lengths in m and a "
                                   "unit quaternion. Poses between rows are interpolated smoothly."),
                   file = map.get("file", "CSV file with the columns t,body,x,y,z,qx,qy,qz,qw. Give `body` as well.");
  map.finish();
  const int given = topic.present() + table.present() + (body.present() || file.present());
  if (given != 1)
  {
    if (at.problems().size() == before)
      at.problem("must be fixed or one of {topic: true}, {body: NAME}, {table: [...]}, {file: PATH, body: NAME}");
  }
  else if (topic.present())
  {
    checkTopic(topic);
    motion = TopicMotion{};
  }
  else if (table.present())
  {
    assign(motion, readTable(table, needs_orientation));
  }
  else if (file.present())
  {
    if (!body.present())
      body.problem("is missing; the file holds several bodies");
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
                   body = map.get("body", "Name of the body in `file`."),
                   table = map.get("table",
                                   "Timed poses: rows [t, x, y, z, qx, qy, qz, qw] or [t, x, y, z], with t in s, "
                                   "lengths in m and a unit quaternion. Poses between rows are interpolated smoothly."),
                   file = map.get("file", "CSV file with the columns t,body,x,y,z,qx,qy,qz,qw. Give `body` as well.");
  map.finish();
  std::optional<TableMotion> poses;
  if (topic.present() + table.present() + (body.present() || file.present()) != 1 || body.present() != file.present())
  {
    if (at.problems().size() == before)
    {
      at.problem(std::string("must be ") + (may_be_free ? "free, " : "") +
                 "fixed or one of {topic: true}, {table: [...]}, {file: PATH, body: NAME}");
    }
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
